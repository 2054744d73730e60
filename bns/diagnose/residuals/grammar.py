"""A small typed grammar of terms that may stand for what no listed effect explains: signals, a nonlinearity, a memory.

A family is a velocity that is added to and a few functions whose sum, each with a number of its own, is a free curve of one
signal (a wheel's speed, its distance since it last changed direction, the time in a trial), a field over the floor, or a short
polynomial of speed and turn. All are written as formulas: whatever a family turns out to be can be added to a model file.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from itertools import pairwise
from keyword import iskeyword

import numpy as np
from numpy.typing import NDArray

from bns.diagnose.data.tracks import Array
from bns.diagnose.predict.base import Predictor
from bns.diagnose.predict.wheels import WheelPredictor
from bns.diagnose.settings import DEFAULTS
from bns.physics.effects import all_effects
from bns.physics.formula import LEFT, OF_A_WHEEL, RIGHT, SHARE, VARIABLES, WHEELS, may_be_number
from bns.physics.formula_check import AGO
from bns.physics.formula_value import FUNCTIONS

RESPONSE = "response of each wheel in time"
SHIFTS = ("clock-offset", "command-delay")
"""Effects that shift all motion in time: beside a free response in time (`RESPONSE`) nothing tells their number from it."""
APART = ("heading-delay",)
"""Effects that shift the motion forwards against the turning: likewise beside a free response of one of both (`RESPONSE_OF`)."""
RESPONSE_OF = {"v": "response of the forward velocity in time", "w": "response of the turning velocity in time"}
RESPONSE_ALONE = {LEFT: "response of the left wheel in time", RIGHT: "response of the right wheel in time"}
"""What an effect that acts alike on both wheels cannot be: beside a lag of both, the other lag of one."""
SLOWING = "response of each wheel in time while it slows down"
SESSION = "time of the session"
DRIFT = "time of the session, whatever the turn rate"
"""A turn of its own that grows during the session: a gyro that holds the heading, and drifts."""
CHANGES = "changes of speed of each wheel"
CHANGES_ALONE = {LEFT: "changes of speed of the left wheel", RIGHT: "changes of speed of the right wheel"}
"""What one wheel loses while it speeds up: a tyre with less grip, a joint that gives."""
PAST = frozenset({RESPONSE, SLOWING, CHANGES, *RESPONSE_OF.values(), *RESPONSE_ALONE.values(), *CHANGES_ALONE.values()})
"""Answers to past commands."""
BY_DIRECTION = {
    WHEELS: "speed of each wheel, forwards and backwards",
    LEFT: "speed of the left wheel, forwards and backwards",
    RIGHT: "speed of the right wheel, forwards and backwards",
}
"""A curve of its own in each direction: what an odd one beside a share cannot draw, others would repair between them."""
ALONG = "forward velocity, forwards and backwards"
"""What the robot as a whole loses on the way, whatever its wheels do: a caster that drags, a cable that is pulled along."""
OF_SPEED = {WHEELS: "speed of each wheel", LEFT: "speed of the left wheel", RIGHT: "speed of the right wheel"}
PLACE, STEPPED, SURFACE = "place", "speed in steps", "speed with turn"
SPEED_THERE = "forward speed at a place"
TRAVEL = "direction of travel"
"""Where the robot drives to: its heading, or the opposite where it reverses."""
PULL = "heading, in proportion to the speed"
"""A turn for each metre driven, whichever way: a magnet, or a nap that guides the wheels."""
LOGGED, LOGGED_OFFSET = "the logged ", ", whatever the speed"
"""Signals that are a further column of the log, by its name; as a factor of a velocity, and as an addition to it."""
TWIST = "turn since the trial began"
"""What winds up as the robot turns and unwinds as it turns back: a cable that hangs on it."""
STRAIGHT = "straight lines"
"""What happens only while both wheels are told the same, such as a heading that is held by a gyro."""
SPEED_KNOTS = DEFAULTS.residuals.speed_knots
SESSION_KNOTS = DEFAULTS.residuals.session_knots
LATER_KNOTS = DEFAULTS.residuals.session_change_knots
TIME_KNOTS = DEFAULTS.residuals.time_knots
REVERSAL_KNOTS = DEFAULTS.residuals.reversal_knots
RESPONSE_KNOTS_S = DEFAULTS.residuals.response_knots_s
SURFACE_KNOTS = DEFAULTS.residuals.surface_knots
SURFACE_DRIVEN = DEFAULTS.residuals.surface_driven
SWING_KNOTS = DEFAULTS.residuals.swing_knots
STRAIGHT_AT, STRAIGHT_WITHIN = DEFAULTS.residuals.straight_within
STRAIGHT_SHARE = DEFAULTS.residuals.straight_share
COLUMN_KNOTS = DEFAULTS.residuals.column_knots
FLOOR_SIDE = DEFAULTS.residuals.floor_side


@dataclass(frozen=True)
class Family:
    """Functions (formulas without their numbers) of a ``signal``, added to the velocity ``on`` (`bns.physics.formula.ON`)."""

    signal: str
    on: str
    functions: tuple[str, ...]

    @property
    def term(self) -> str:
        """The family as one formula with a number for each function."""
        return " + ".join(f"k{i} * {function}" for i, function in enumerate(self.functions))


def families(predictor: Predictor, wheelbase_m: float, response: bool = True) -> list[Family]:
    """All families that these tracks can speak of; `RESPONSE` only where asked for: it can imitate every effect that is late."""
    if not isinstance(predictor, WheelPredictor):
        return []
    seen = predictor.variables()
    wheels = np.concatenate([seen["left_m_s"].ravel(), seen["right_m_s"].ravel()])
    reverses, knots = bool((wheels < 0.0).any()), [share * float(np.abs(wheels).max()) for share in SPEED_KNOTS]
    of_speed, by_direction = _of_speed(knots, reverses), _by_direction(knots)
    found = [
        *(Family(signal, on, of_speed) for on, signal in OF_SPEED.items()),
        *(Family(signal, on, by_direction) for on, signal in BY_DIRECTION.items() if reverses),
        *_along(seen),
        Family("speed and turn", "v", ("v * w", "v * w**2", "v * abs(v)", "v**3", "moving * abs(w)")),
        Family("speed and turn", "w", ("w * abs(w)", "w * abs(v)", "w**3", "w * v**2", "w * v", "v * abs(w)")),
        Family("speed and turn", "s", ("v * w * abs(w)", "v * w * abs(v)", "w")),
        *_surfaces(seen, predictor.grid.step_s, wheelbase_m),
        Family("side of the turn", "v", ("v * max(w, 0)", "v * min(w, 0)", "moving * max(w, 0)", "moving * min(w, 0)")),
        *_of_columns(predictor),
    ]
    if not predictor.tracks.relative:
        found += [f for f in _of_tracks(predictor, seen, wheelbase_m) if response or f.signal != RESPONSE]
    return found


def may_join(terms: Iterable[tuple[str, str]], tried: Iterable[Family]) -> list[Family]:
    """The families that may stand beside terms (signal, velocity): none twice, and one answer to past commands.

    Free responses in time and changes of speed contain one another, so the words for one say nothing next to the other; and next
    to those of forward velocity and of turns together a lag of the wheels has no number of its own.
    """
    used = set(terms)
    barred = PAST if any(signal in PAST for signal, _ in used) else frozenset()
    return [f for f in tried if (f.signal, f.on) not in used and f.signal not in barred]


def _along(seen: dict[str, Array]) -> Iterator[Family]:
    """Two free curves of the robot's forward velocity, of logs in which it drives backwards, too."""
    v = (seen["left_m_s"] + seen["right_m_s"]) / 2.0
    if float(v.min()) < 0.0:
        yield Family(ALONG, "v", _by_direction([share * float(np.abs(v).max()) for share in SPEED_KNOTS], "v"))


def _of_speed(knots: Sequence[float], reverses: bool) -> tuple[str, ...]:
    """A free curve of a wheel's own speed that is nothing at rest, odd but for a share of backward speeds."""
    hats = _hats("abs(u)", knots)[1:]
    return (*(f"sign(u) * {h}" for h in hats), *(("min(u, 0)",) if reverses else ()))


def _by_direction(knots: Sequence[float], speed: str = "u") -> tuple[str, ...]:
    """Two free curves of a wheel's own speed, or of the robot's, that are nothing at rest: one forwards, one backwards."""
    return tuple(hat for ahead in (speed, f"-{speed}") for hat in _hats(f"({ahead})", knots)[1:])


def _surfaces(seen: dict[str, Array], lasted_s: Array, wheelbase_m: float) -> Iterator[Family]:
    """Free surfaces over speed and turn: limits of grip and the like, which no polynomial follows.

    ``lasted_s``: how long each of what was ``seen`` lasted. A knot near which the robot hardly drove has the number of the
    nearest knot near which it did: one of its own would draw out to there whatever slope is found at the edge of what was driven.
    """
    v, w = np.abs(seen["left_m_s"] + seen["right_m_s"]) / 2, np.abs(seen["right_m_s"] - seen["left_m_s"]) / wheelbase_m
    if not (v.any() and w.any()):
        return
    at = [[share * float(own.max()) for share in shares] for own, shares in zip((v, w), SURFACE_KNOTS, strict=True)]
    near = [_nearest(own, knots) for own, knots in zip((v, w), at, strict=True)]
    driven = np.zeros((len(at[0]), len(at[1])))
    np.add.at(driven, tuple(near), lasted_s)
    known = driven >= SURFACE_DRIVEN * driven.sum()
    speeds, turns = _hats("abs(v)", at[0]), _hats("abs(w)", at[1])
    for on, sign, least in (("w", "sign(w) * ", (0, 1)), ("v", "sign(v) * ", (1, 0)), (SHARE, "", (0, 0))):
        parts: dict[tuple[int, int], list[str]] = {}
        for knot in np.ndindex(*known.shape):
            if knot[0] >= least[0] and knot[1] >= least[1]:
                for to in _known_near(known, knot, least):
                    parts.setdefault(to, []).append(f"{speeds[knot[0]]} * {turns[knot[1]]}")
        sums = [one[0] if len(one) == 1 else f"({' + '.join(one)})" for one in parts.values()]
        if sums:
            yield Family(SURFACE, on, tuple(sign + one for one in sums))


def _nearest(values: Array, knots: Sequence[float]) -> NDArray[np.int64]:
    """Which knot each value is nearest to."""
    return np.asarray(np.searchsorted([(a + b) / 2 for a, b in pairwise(knots)], values))


def _known_near(known: NDArray[np.bool_], knot: tuple[int, int], least: tuple[int, int]) -> list[tuple[int, int]]:
    """The knot itself, or the nearest that is known, none below ``least``; of equally near ones the slowest. Empty if none is."""
    there = [one for one in np.ndindex(*known.shape) if known[one] and one[0] >= least[0] and one[1] >= least[1]]
    return sorted(there, key=lambda one: (abs(one[0] - knot[0]) + abs(one[1] - knot[1]), one))[:1]


def _of_tracks(predictor: Predictor, seen: dict[str, Array], wheelbase_m: float) -> Iterator[Family]:
    """Families of what single motions have not: times, memories, places."""
    for signal, on in ((CHANGES, WHEELS), *((signal, on) for on, signal in CHANGES_ALONE.items())):
        yield Family(signal, on, ("fresh", "max(fresh, 0)", "fresh * abs(fresh)", "fresh * abs(u)"))
    of_wheels = ((RESPONSE, WHEELS, "u"), *((signal, on, "u") for on, signal in RESPONSE_ALONE.items()))
    for signal, on, now in (*of_wheels, *((signal, on, on) for on, signal in RESPONSE_OF.items())):
        yield Family(signal, on, tuple(f"(ago({a:g}, {b:g}) - {now})" for a, b in pairwise(RESPONSE_KNOTS_S)))
    past = [f"ago({a:g}, {b:g})" for a, b in pairwise(RESPONSE_KNOTS_S)]
    yield Family(SLOWING, WHEELS, tuple(f"({ago} - u) * max(sign(abs({ago}) - abs(u)), 0)" for ago in past))
    if min(seen["left_m_s"].min(), seen["right_m_s"].min()) < 0.0:
        ways = [share * wheelbase_m for share in REVERSAL_KNOTS]
        yield Family("distance since each wheel reversed", WHEELS, tuple(f"u * {h}" for h in _hats("since", ways)[:-1]))
    yield Family("recent work of each wheel", WHEELS, ("u * lately10", "u * lately100"))
    yield Family("direction of motion", SHARE, tuple(_hats("swing", SWING_KNOTS)[1:]))
    longest = float(predictor.tracks.own_s.max())
    times = [share * longest for share in TIME_KNOTS]
    yield Family("time in the trial", SHARE, tuple(_hats("tau", times)[:-1]))
    if predictor.tracks.start_known:
        session = predictor.tracks.session_s
        first, last = float(session.min()), float(session.max())
        times = [first + share * (last - first) for share in SESSION_KNOTS]
        yield Family(SESSION, SHARE, tuple(_hats("t", times)))
        # what has changed since the session began: a load that was moved, a tyre that was pumped
        later = _hats("t", [first + share * (last - first) for share in LATER_KNOTS])[1:]
        for on, now in ((LEFT, "u"), (RIGHT, "u"), ("w", "w")):
            yield Family(SESSION, on, tuple(f"{now} * {h}" for h in later))
        yield Family(DRIFT, "w", tuple(f"moving * {h}" for h in later))
    yield from _straight(seen, wheelbase_m)
    turns = ("cos(heading)", "sin(heading)", "cos(2*heading)", "sin(2*heading)")
    uphill = ("moving * cos(heading)", "moving * sin(heading)")  # a slope on which wheels do not slip sideways
    yield Family("heading", "v", (*(f"v * {t}" for t in turns), *uphill))
    if float((seen["left_m_s"] + seen["right_m_s"]).min()) < 0.0:
        yield Family(TRAVEL, "v", ("v", *(f"abs(v) * {t}" for t in turns)))  # a carpet's nap, forwards and backwards
    yield Family("heading", "w", tuple(f"moving * {t}" for t in turns))
    yield Family(TWIST, "w", ("moving * turned", "moving * turned * abs(turned)", "moving"))
    yield Family(PULL, "w", tuple(f"abs(v) * {t}" for t in turns))
    yield Family("heading", SHARE, turns)  # both wheels alike: a carpet's nap
    (x0, x1), (y0, y1) = (np.quantile(predictor.tracks.pose[:, i], [0.02, 0.98]) for i in (0, 1))
    bumps = tuple(_bumps(x0, x1, y0, y1))
    yield Family(PLACE, SHARE, bumps)
    yield Family(SPEED_THERE, "v", tuple(f"v * {b}" for b in bumps))
    yield Family(PLACE, "east", tuple(f"moving * {b}" for b in bumps))
    yield Family(PLACE, "north", tuple(f"moving * {b}" for b in bumps))
    yield Family(PLACE, "w", tuple(f"moving * {bump}" for bump in bumps))
    x, y = f"(x - {(x0 + x1) / 2:.3g})", f"(y - {(y0 + y1) / 2:.3g})"
    bends = (x, y, f"{x}**2", f"{x} * {y}", f"{y}**2")
    askew = [f"v * {b} * {t}" for b in bends for t in turns[2:]]
    yield Family(PLACE, "v", (*(f"v * {b}" for b in bends), *askew))
    yield Family(PLACE, "s", tuple(askew))


def formula_columns(predictor: Predictor) -> list[str]:
    """The log's further columns that vary, as far as a formula can name them and no listed effect has them for itself."""
    own = {p.column for effect in all_effects().values() for p in effect.parameters}
    taken = {*VARIABLES, *OF_A_WHEEL, *FUNCTIONS, AGO, *own, "session_s"}
    able = [c for c in predictor.tracks.extra if c.isidentifier() and not iskeyword(c) and not may_be_number(c)]
    return [c for c in able if c not in taken and np.ptp(_known(predictor, c)) > 0.0]


def _known(predictor: Predictor, column: str) -> Array:
    values = predictor.tracks.extra[column]
    known: Array = values[np.isfinite(values)]
    return known if len(known) else np.zeros(1)


def _of_columns(predictor: Predictor) -> Iterator[Family]:
    """What follows a further column of the log: in proportion to it, or by a curve; as a factor or as an addition."""
    for c in formula_columns(predictor):
        knots = np.unique(np.quantile(np.unique(_known(predictor, c)), COLUMN_KNOTS))
        if len(knots) < 2:
            continue
        hats = _hats(c, [float(k) for k in knots])
        for on, now in (("v", "v * "), ("w", "w * "), (SHARE, ""), (LEFT, "u * "), (RIGHT, "u * ")):
            yield Family(LOGGED + c, on, (f"{now}{c}",))
            if len(knots) > 2:
                yield Family(LOGGED + c, on, tuple(now + hat for hat in hats))
        for on in ("v", "w"):
            yield Family(LOGGED + c + LOGGED_OFFSET, on, (f"moving * {c}",))


def _straight(seen: dict[str, Array], wheelbase_m: float) -> Iterator[Family]:
    """A turn on straight lines alone, at a rate of its own and one in proportion to the speed; of logs that have both."""
    left, right = seen["left_m_s"], seen["right_m_s"]
    sharpest = float(np.abs(right - left).max())
    driven = np.maximum(np.abs(left), np.abs(right)) > 0.0
    exact = np.abs(right - left)[driven] <= STRAIGHT_AT * sharpest
    if sharpest > 0.0 and min(exact.mean(), 1.0 - exact.mean()) >= STRAIGHT_SHARE:
        hat = f"max(1 - abs(w) / {STRAIGHT_WITHIN * sharpest / wheelbase_m:.4g}, 0)"
        yield Family(STRAIGHT, "w", (f"moving * {hat}", f"v * {hat}"))


def _hats(signal: str, knots: Sequence[float]) -> list[str]:
    """Piecewise linear functions of a signal, one a knot; they sum to 1 and stay as they are beyond the ends."""
    out = []
    for i, at in enumerate(knots):
        sides = []
        if i:
            sides.append(f"({signal} - {knots[i - 1]:.4g}) / {at - knots[i - 1]:.4g}")
        if i + 1 < len(knots):
            sides.append(f"({knots[i + 1]:.4g} - {signal}) / {knots[i + 1] - at:.4g}")
        inner = f"min({sides[0]}, {sides[1]})" if len(sides) == 2 else f"min({sides[0]}, 1)"
        out.append(f"max({inner}, 0)")
    return [text.replace("- -", "+ ") for text in out]


def _bumps(x0: float, x1: float, y0: float, y1: float) -> Iterator[str]:
    """Gaussian bumps on a grid over the floor."""
    wide, high = (0.6 * (top - low) / (FLOOR_SIDE - 1) + 1e-9 for low, top in ((x0, x1), (y0, y1)))
    for cx in np.linspace(x0, x1, FLOOR_SIDE):
        for cy in np.linspace(y0, y1, FLOOR_SIDE):
            yield f"exp(-(((x - {cx:.3g}) / {wide:.3g})**2 + ((y - {cy:.3g}) / {high:.3g})**2) / 2)".replace(
                "- -", "+ "
            )
