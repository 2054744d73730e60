"""Which answers are right, worked out from what a set of effects does to poses, never from what the product says.

An answer is a verdict with explanations (sets of effects that are said to explain the data equally well). It is right when
it holds every `required` explanation and none beyond `required` and `allowed`.

Exact equivalences, seen from outside (open loop, the robot at rest before its first command):
* A command that acts d late moves every path by d, and so does a clock that stamps poses d late: pose stamped t taken at
  t - d. command-delay d = clock-offset d. A negative offset would be a negative delay, which no robot has.
* speed-gain g, wheelbase e and camera-scale f make the displacement of every moment (v g f, w g / e): two numbers for three
  causes. One of them alone is the simplest of its kind, but any two of them equal any other two.

Equivalences of some data (checked by `audit`: no method could decide there):
* floor-slope is a tether whose anchor is far. Of a slope, both answers are right: an anchor that far may be implausible.
  A tether is far where the pull differs so little across the arena that noisy poses, few trials and command ends hide it.
  There a carpet that carries the robot is as near, too (a chi-square of 25 and 23): it may be among the answers of the tie.
"""

from __future__ import annotations

from collections.abc import Iterable
from itertools import combinations, product

from tests.hidden_effects.world import Parameters, World

LIKE = ("camera-scale", "speed-gain", "wheelbase")
FAR_M = 8.0
"""Anchors at least so far from the arena's middle pull as a slope does, where the data is poor."""

LISTED_SINCE = {"left-dead-zone": "dead-zone-mismatch", "reverse-loss": "reverse-gain"}
"""Causes that no list held when their worlds were made, and the effects that are exactly these."""

Explanation = tuple[str, ...]
Answer = dict[str, object]


def acceptable(world: World) -> list[Answer]:
    """All right answers to a world."""
    since = [LISTED_SINCE.get(name, "") for name in world.unlisted]
    if since and all(since):
        return [_answer("effects", [tuple(sorted([*since, *world.hidden]))], [], "on the list by now")]
    if world.unlisted:
        return [{"verdict": "unlisted", "required": [], "allowed": [], "why": "no listed effect does this"}]
    required, allowed = explanations(world.hidden)
    if not world.hidden:
        return [_answer("none", required, [], "nothing is hidden")]
    if len(required) > 1:
        return [_answer("tie", required, allowed, "equal from outside whatever the data")]
    effects = _answer("effects", required, [], "one set explains the data")
    tie = _answer("tie", required, allowed, "a far tether would pull so too, if one that far is plausible")
    return [effects, tie] if allowed else [effects]


def explanations(hidden: dict[str, Parameters]) -> tuple[list[Explanation], list[Explanation]]:
    """(those that must be named, those that may be) for a set of effects and its parameters; names sorted."""
    same = [list(_swaps(hidden))]
    same += [[(name,), *_required(name, parameters)] for name, parameters in _others(hidden)]
    required = _sets(same)
    may = [list(_swaps(hidden))]
    may += [[(name,), *_required(name, parameters), *_allowed(name, parameters)] for name, parameters in _others(hidden)]
    return required, [found for found in _sets(may) if found not in required]


def _answer(verdict: str, required: list[Explanation], allowed: list[Explanation], why: str) -> Answer:
    return {"verdict": verdict, "required": required, "allowed": allowed, "why": why}


def _swaps(hidden: dict[str, Parameters]) -> Iterable[Explanation]:
    """Two of the three that are alike may be any two; one stays itself, and so do all three."""
    there = [name for name in LIKE if name in hidden]
    return combinations(LIKE, 2) if len(there) == 2 else [tuple(there)]


def _others(hidden: dict[str, Parameters]) -> list[tuple[str, Parameters]]:
    return [(name, parameters) for name, parameters in hidden.items() if name not in LIKE]


def _required(name: str, parameters: Parameters) -> list[Explanation]:
    late = name == "clock-offset" and parameters["offset_s"] > 0
    swaps = {"command-delay": "clock-offset"}
    if late:
        swaps["clock-offset"] = "command-delay"
    if _is_far(name, parameters):
        swaps["tether-pull"] = "floor-slope"
    return [(swaps[name],)] if name in swaps else []


def _allowed(name: str, parameters: Parameters) -> list[Explanation]:
    if _is_far(name, parameters):
        return [("carpet-drift",)]
    return [("tether-pull",)] if name == "floor-slope" else []


def _is_far(name: str, parameters: Parameters) -> bool:
    return name == "tether-pull" and _distance_m(parameters) >= FAR_M


def _distance_m(tether: Parameters) -> float:
    return float(abs(complex(tether["anchor_x_m"] - 0.8, tether["anchor_y_m"] - 0.5)))


def _sets(choices: list[list[Explanation]]) -> list[Explanation]:
    return sorted({tuple(sorted(name for part in parts for name in part)) for parts in product(*choices)})
