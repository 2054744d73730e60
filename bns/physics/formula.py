"""An effect written as a formula, by people who would rather not write Python: ``term: k * v * abs(w)``, ``on: v``.

A name in it is one of `VARIABLES`, a column of the log, or a number to fit, which is a letter, perhaps with digits (k, a, b2),
or begins with ``k_``. Any other name is an error: a misspelt column must not become a number.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Iterable, Mapping, Sequence
from functools import partial
from typing import Any

import numpy as np

from bns.errors import ModelError, unknown_name
from bns.physics.effect import Effect, Parameter
from bns.physics.formula_check import AGO
from bns.physics.formula_value import Ago, Compiled, compiled
from bns.physics.order import FORMULAS
from bns.physics.signals import CREEP_M_S, Array, Body
from bns.physics.wheels.scans import carried_on, first_order, reversed_since, trailing

SHARE, WHEELS, LEFT, RIGHT = "share", "wheels", "left", "right"
ON: Mapping[str, str] = {
    "v": "forward_m_s",
    "s": "sideways_m_s",
    "w": "yaw_rad_s",
    "east": "east",
    "north": "north",
    SHARE: SHARE,
    WHEELS: WHEELS,
    LEFT: LEFT,
    RIGHT: RIGHT,
}
"""What a term can be added to: forward, sideways (to the right) and turning velocity, velocity in the world's frame, the factor
of all velocities (`SHARE`), the speed of each wheel, worked out for the left and for the right one (`WHEELS`), or of one."""
WHICH_WHEELS: Mapping[str, tuple[bool, bool]] = {WHEELS: (True, True), LEFT: (True, False), RIGHT: (False, True)}
"""Does a term act on the left, on the right wheel?"""
VARIABLES: Mapping[str, str] = {
    "v": "forward velocity, m/s",
    "w": "turn rate, rad/s, left positive",
    "l": "speed of the left wheel, m/s",
    "r": "speed of the right wheel, m/s",
    "t": "time since the session began, s",
    "tau": "time since the trial began, s",
    "d": "distance driven in the trial, m",
    "x": "position east, m",
    "y": "position north, m",
    "heading": "heading, rad",
    "turned": "turn since the trial began, rad, left positive; whole turns count",
    "moving": "1 while a wheel turns, else 0; with wheels that lag it comes and goes as late",
    "swing": "how far the present direction of motion differs from that over the last half wheelbase of distance: 0 the same, "
    "1 the opposite",
}
OF_A_WHEEL: Mapping[str, str] = {
    "u": "speed of this wheel, m/s",
    "since": "distance of this wheel since it last changed direction, m (1000 before the first change)",
    "fresh": "speed of this wheel minus its mean over the last 0.15 s (exponential decay), m/s",
    "lately10": "distance of this wheel over the last 10 s (exponential decay), m; carries over from trial to trial",
    "lately100": "the same over the last 100 s",
}
"""Further names in a term on `WHEELS`, `LEFT` or `RIGHT`."""
PAST: Mapping[str, str] = {
    AGO: "ago(0.1, 0.2): mean from 0.1 to 0.2 s ago of this wheel's speed (m/s); with v or w, of that velocity (m/s, rad/s)"
}
"""A function in a term on `WITH_PAST`: its arguments are times in seconds, the smaller first."""
WITH_PAST = (*WHICH_WHEELS, "v", "w")
_MAGNITUDES = tuple((sign * size,) for size in (1e-3, 3e-3, 1e-2, 3e-2, 0.1, 0.3, 1.0, 3.0, 10.0) for sign in (1.0, -1.0))
"""Where the fit of a nonlinear term's only number begins: far from it a limit limits nothing, and no slope leads back."""
_SIZES = tuple(sign * size for sign in (1.0, -1.0) for size in (1.0, 0.1, 0.01, 1e-3, 10.0))
"""Where the numbers of a term begin that it is not linear in: a rate of something in seconds may be one in an hour."""
RECENT_S = 0.15
NEVER_M = 1e3
LARGEST = 1e9
"""Of a number in a term. At 1 mm/s a speed that is halved by a term in v**3 has a number of 5e5, in v**4 of 5e8."""
_PLACE = {"x", "y", "heading", "turned"}
_NUMBER = re.compile(r"[A-Za-z]\d*|k_\w+")


def formula_effect(
    name: str,
    term: str,
    on: str,
    columns: Iterable[str] = (),
    numbers: Iterable[str] | None = None,
    of_any_size: bool = True,
) -> Effect:
    """The effect that adds ``term`` to the velocity ``on``.

    Args:
        columns: names of the log's further columns, which the term may use.
        numbers: names of its numbers where a model file lists them; all names that are neither these nor could be numbers are
            columns then, to be found in whatever log the model is compared with.
        of_any_size: as of `Parameter`; False for terms whose numbers are of the size of speeds and of shares.

    Raises:
        ModelError: the term does not parse, uses anything but arithmetic, `FUNCTIONS` and names, has an unknown name (the message
            lists all that there are) or no number to fit.
    """
    if on not in ON:
        raise ModelError(f"formula {name}: " + unknown_name("velocity to add to (on)", on, ON))
    code = _parsed(name, term)
    if AGO in code.called and on not in WITH_PAST:
        raise ModelError(
            f"formula {name}: {AGO}(...) is of a wheel or a velocity; it needs on: {', '.join(WITH_PAST)}, not {on}."
        )
    known = set(VARIABLES) | (set(OF_A_WHEEL) if on in WHICH_WHEELS else set())
    logged, unknown = _sorted(name, code.names - known, set(columns), None if numbers is None else set(numbers))
    if not unknown:
        raise ModelError(f"formula {name}: {term!r} has no number to fit; multiply it by one, as in k * ({term}).")
    nothing = _linear_numbers(code, unknown)  # where these are nothing, so is the term
    placed = bool(code.names & _PLACE) or on in {"east", "north"}
    return Effect(
        name=name,
        stage="body",
        parameters=tuple(
            Parameter(
                p,
                "1",
                -LARGEST,
                LARGEST,
                (-10.0, 10.0),
                0.0 if p in nothing else 1.0,
                "of a formula",
                of_any_size=of_any_size,
            )
            for p in unknown
        ),
        starts=_MAGNITUDES
        if len(unknown) == 1 and not _is_linear(code, unknown)
        else tuple(dict.fromkeys(tuple(0.0 if p in nothing else size for p in unknown) for size in _SIZES)),
        equation=f"{on}' = {on} + {term}",
        residuals="as the formula says",
        lookalikes=(),
        apply=partial(_apply, name, code, on, logged),
        after=FORMULAS,
        needs_place=placed,
        revision=2 if placed else 1,
    )


def _linear_numbers(code: Compiled, numbers: Sequence[str]) -> list[str]:
    """Those numbers in which a term is a sum of them times something else each, the others held; if there is none, the first."""
    of_each = [p for p in numbers if _is_straight(code, numbers, p)]
    found = of_each if of_each and _is_linear(code, of_each) else [p for p in of_each if _is_linear(code, [p])][:1]
    return found or [numbers[0]]


def _is_straight(code: Compiled, numbers: Sequence[str], one: str) -> bool:
    """Whether a term is on a straight line over one of its numbers."""
    rng = np.random.default_rng(0)
    rest: dict[str, Any] = {n: rng.uniform(0.1, 0.9, 16) for n in sorted(code.names - set(numbers))}
    rest[AGO] = lambda from_s, to_s: np.linspace(from_s, to_s, 16)
    others = {n: rng.normal(size=1)[0] for n in numbers}
    for at, apart in rng.normal(size=(4, 2)):
        try:
            low, middle, high = (
                np.asarray(code.value({**rest, **others, one: at + k * apart}), dtype=np.float64) for k in (-1, 0, 1)
            )
        except ArithmeticError:
            return False
        if not (np.isfinite(low).all() and np.isfinite(high).all() and np.allclose(low + high, 2 * middle)):
            return False
    return True


def _is_linear(code: Compiled, numbers: Sequence[str]) -> bool:
    """Whether a term is a sum of its numbers times something else each: one step of least squares finds these from nothing."""
    rng = np.random.default_rng(0)
    rest: dict[str, Any] = {n: rng.uniform(0.1, 0.9, 16) for n in sorted(code.names - set(numbers))}
    rest[AGO] = lambda from_s, to_s: np.linspace(from_s, to_s, 16)

    def value(at: Array) -> Array:
        return np.asarray(code.value({**rest, **dict(zip(numbers, at, strict=True))}), dtype=np.float64)

    for one, other in rng.normal(size=(4, 2, len(numbers))):  # some of them of other signs: an absolute value is not linear
        try:
            values = [value(at) for at in (one, other, 2 * one - 3 * other)]
        except ArithmeticError:
            return False
        if not (np.isfinite(values[:2]).all() and np.allclose(values[2], 2 * values[0] - 3 * values[1])):
            return False
    return True


def may_be_number(name: str) -> bool:
    """Whether a name that is no variable would be taken for a number to fit."""
    return _NUMBER.fullmatch(name) is not None


def value_of(term: str, names: Mapping[str, Any]) -> Array:
    """The value of a term for given numbers and arrays, one for each of its names; ModelError if it is no formula."""
    return np.asarray(_parsed("term", term).value(names), dtype=np.float64)


def names_in(term: str) -> set[str]:
    """All names in a term, of variables, columns and numbers alike; ModelError if it is no formula."""
    return set(_parsed("term", term).names)


def _sorted(name: str, names: set[str], columns: set[str], numbers: set[str] | None) -> tuple[list[str], list[str]]:
    """Columns of the log and numbers to fit among the names that are no variables, in order."""
    logged, unknown = [], []
    for one in sorted(names):
        if numbers is not None and one in numbers:
            unknown.append(one)
        elif one in columns or numbers is not None:
            logged.append(one)
        elif one.lower() in VARIABLES:
            meant = f"did you mean {one.lower()} by {one}?"
            raise ModelError(f"formula {name}: {meant} Give a number to fit another letter (k, a, b2).")
        elif may_be_number(one):
            unknown.append(one)
        else:
            known = unknown_name("name", one, [*VARIABLES, *columns])
            raise ModelError(f"formula {name}: {known} A number to fit is a letter (k, a, b2) or begins with k_ (k_drag).")
    return logged, unknown


def _parsed(name: str, term: str) -> Compiled:
    return compiled(name, term) if isinstance(term, str) else Compiled(name, term)  # a model file may hold anything


def _apply(name: str, code: Compiled, on: str, logged: list[str], body: Body, **numbers: float) -> Body:
    if body.place is None and _needs(code, on):
        return body  # first round of a simulation: nobody knows yet where the robot goes
    values = {**_values(body, code), **{column: body.logged[column] for column in logged}, **numbers}
    if on in WHICH_WHEELS:
        left, right = (
            _added(name, code, {**values, **_of_wheel(body, speed, code)}, body) if acts else np.zeros_like(speed)
            for speed, acts in zip((body.left_m_s, body.right_m_s), WHICH_WHEELS[on], strict=True)
        )
        turned = body.with_added("yaw_rad_s", (right - left) / body.wheelbase_m)
        return turned.with_added("forward_m_s", (left + right) / 2.0)
    if on in WITH_PAST:
        values |= _past(body, body.forward_m_s if on == "v" else body.yaw_rad_s, code)
    added = _added(name, code, values, body)
    if on == SHARE:
        return body.scaled(1.0 + added)
    if on not in {"east", "north"}:
        return body.with_added(ON[on], added)
    assert body.place is not None
    return body.with_drift(on, added * body.moving, body.place[..., 2])


def _added(name: str, code: Compiled, values: Mapping[str, Any], body: Body) -> Array:
    """The term's value in every step, (batch, steps)."""
    numbers = {key: value for key, value in values.items() if isinstance(value, float)}
    try:
        added = np.asarray(code.value_of_numbers(values))
    except (ArithmeticError, TypeError, ValueError) as fault:  # of numbers that are fitted: k / (k - k), (-k)**0.5
        raise ModelError(
            f"formula {name} cannot be calculated with {numbers}: {fault}. Write it in another way."
        ) from fault
    if added.dtype.kind == "c":
        raise ModelError(
            f"formula {name} is no real number with {numbers}: the root of a negative number. Rewrite it."
        )
    out: Array = np.broadcast_to(added, body.forward_m_s.shape)
    if not np.isfinite(out).all():
        raise ModelError(
            f"formula {name} is {out[~np.isfinite(out)][0]} somewhere on these trials: a pole, a root or logarithm of "
            "what is not positive. Write it so that it is finite for every speed, at rest too."
        )
    return out


def _needs(code: Compiled, on: str) -> bool:
    return on in {"east", "north"} or bool(_PLACE & code.names)


def _values(body: Body, code: Compiled) -> dict[str, Any]:
    """`VARIABLES`; only what the term names."""
    begin = body.session_s[:, :1]
    made: dict[str, Callable[[], Array]] = {
        "v": lambda: body.forward_m_s,
        "w": lambda: body.yaw_rad_s,
        "l": lambda: body.left_m_s,
        "r": lambda: body.right_m_s,
        "t": lambda: body.session_s,
        "tau": lambda: body.session_s - begin,
        "d": lambda: np.cumsum(np.abs(body.forward_m_s) * np.diff(body.session_s, axis=1, prepend=begin), axis=1),
        "moving": lambda: body.moving,
        "swing": lambda: swing(body),
    }
    if body.place is not None:
        x, y, heading = np.moveaxis(body.place, -1, 0)
        made |= {"x": lambda: x, "y": lambda: y, "heading": lambda: heading, "turned": lambda: heading - heading[:, :1]}
    return {name: make() for name, make in made.items() if name in code.names}


def _of_wheel(body: Body, speed: Array, code: Compiled) -> dict[str, Any]:
    """`OF_A_WHEEL` and `PAST` of the wheel with this speed; only what the term names."""
    made: dict[str, Callable[[], Array]] = {
        "u": lambda: speed,
        "since": lambda: since_reversal(speed, _step_s(body)),
        "fresh": lambda: speed - first_order(speed, _step_s(body), RECENT_S),
        "lately10": lambda: lately(body, speed, 10.0),
        "lately100": lambda: lately(body, speed, 100.0),
    }
    return {**_past(body, speed, code), **{name: make() for name, make in made.items() if name in code.names}}


def _past(body: Body, velocity: Array, code: Compiled) -> dict[str, Any]:
    """`PAST` of a velocity, where the term asks for it."""

    return {AGO: Ago(velocity, _step_s(body))} if AGO in code.called else {}


def lately(body: Body, speed: Array, fade_s: float) -> Array:
    """Way (m) of a wheel that has not faded yet, in every step; from trial to trial where the session's time is known."""
    return carried_on(np.abs(speed), _step_s(body), body.conditions.session_s, fade_s)


def swing(body: Body) -> Array:
    """How far the motion's direction is from that of the last half wheelbase of way, 0 to 1, in every step."""
    ahead, side = (body.left_m_s + body.right_m_s) / 2.0, (body.right_m_s - body.left_m_s) / 2.0
    speed = np.hypot(ahead, side)
    way = np.where(speed > CREEP_M_S, speed * _step_s(body), 0.0)
    out: Array = (1.0 - np.cos(trailing(np.arctan2(side, ahead), way, body.wheelbase_m / 2.0))) / 2.0
    return out


def since_reversal(speed: Array, step_s: Array) -> Array:
    """Way (m) of a wheel since it last changed direction, in the middle of each step; `NEVER_M` before it first does."""
    out = reversed_since(speed, step_s)
    return np.where(out < 0.0, NEVER_M, out)


def _step_s(body: Body) -> Array:
    """The length of every step, from the times in their middles."""
    if body.step_s is not None:
        return body.step_s
    return np.diff(body.session_s, axis=1, prepend=body.session_s[:, :1])
