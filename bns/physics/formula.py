"""An effect written as a formula, by people who would rather not write Python: ``term: k * v * abs(w)``, ``on: v``.

A name in it is one of `VARIABLES`, a column of the log, or a number to fit, which is a letter, perhaps with digits (k, a, b2),
or begins with ``k_``. Any other name is an error: a misspelt column must not become a number.
"""

from __future__ import annotations

import ast
import re
from collections.abc import Callable, Iterable, Mapping
from functools import partial
from typing import Any

import numpy as np

from bns.errors import ModelError, unknown_name
from bns.physics.effect import Effect, Parameter
from bns.physics.formula_check import checked_formula
from bns.physics.order import FORMULAS
from bns.physics.signals import Array, Body

ON: Mapping[str, str] = {"v": "forward_m_s", "s": "sideways_m_s", "w": "yaw_rad_s", "east": "east", "north": "north"}
"""What a term can be added to: forward, sideways (to the right) and turning velocity, and velocity in the world's frame."""
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
    "moving": "1 while a wheel turns, else 0",
}
FUNCTIONS: Mapping[str, Callable[..., Any]] = {
    "abs": np.abs,
    "sign": np.sign,
    "sqrt": np.sqrt,
    "exp": np.exp,
    "log": np.log,
    "sin": np.sin,
    "cos": np.cos,
    "tanh": np.tanh,
    "min": np.minimum,
    "max": np.maximum,
}
_PLACE = {"x", "y", "heading"}
_NUMBER = re.compile(r"[A-Za-z]\d*|k_\w+")


def formula_effect(
    name: str, term: str, on: str, columns: Iterable[str] = (), numbers: Iterable[str] | None = None
) -> Effect:
    """The effect that adds ``term`` to the velocity ``on``.

    Args:
        columns: names of the log's further columns, which the term may use.
        numbers: names of its numbers where a model file lists them; all names that are neither these nor could be numbers are
            columns then, to be found in whatever log the model is held against.

    Raises:
        ModelError: the term does not parse, uses anything but arithmetic, `FUNCTIONS` and names, has an unknown name (the message
            lists all that there are) or no number to fit.
    """
    if on not in ON:
        raise ModelError(f"formula {name}: " + unknown_name("velocity to add to (on)", on, ON))
    names, code = _parsed(name, term)
    logged, unknown = _sorted(name, names - set(VARIABLES), set(columns), None if numbers is None else set(numbers))
    if not unknown:
        raise ModelError(f"formula {name}: {term!r} has no number to fit; multiply it by one, as in k * ({term}).")
    return Effect(
        name=name,
        stage="body",
        parameters=tuple(
            Parameter(p, "1", -1e3, 1e3, (-10.0, 10.0), 0.0 if p == unknown[0] else 1.0, "of a formula")
            for p in unknown
        ),
        equation=f"{on}' = {on} + {term}",
        residuals="as the formula says",
        lookalikes=(),
        apply=partial(_apply, name, code, on, logged),
        after=FORMULAS,
        needs_place=bool(names & _PLACE) or on in {"east", "north"},
    )


def _sorted(name: str, names: set[str], columns: set[str], numbers: set[str] | None) -> tuple[list[str], list[str]]:
    """Columns of the log and numbers to fit among the names that are no variables, in order."""
    logged, unknown = [], []
    for one in sorted(names):
        if numbers is not None and one in numbers:
            unknown.append(one)
        elif one in columns:
            logged.append(one)
        elif _NUMBER.fullmatch(one):
            unknown.append(one)
        elif numbers is not None:
            logged.append(one)
        else:
            known = unknown_name("name", one, [*VARIABLES, *columns])
            raise ModelError(f"formula {name}: {known} A number to fit is a letter (k, a, b2) or begins with k_ (k_drag).")
    return logged, unknown


class Compiled:
    """A checked term, ready to be calculated; pickled as its text."""

    def __init__(self, name: str, term: str) -> None:
        self._made_of = name, term
        self.code = compile(checked_formula(f"formula {name}", term, FUNCTIONS), name, "eval")

    def __reduce__(self) -> tuple[Any, ...]:
        return Compiled, self._made_of


def _parsed(name: str, term: str) -> tuple[set[str], Compiled]:
    tree = checked_formula(f"formula {name}", term, FUNCTIONS)
    called = {node.func.id for node in ast.walk(tree) if isinstance(node, ast.Call) and isinstance(node.func, ast.Name)}
    names = {node.id for node in ast.walk(tree) if isinstance(node, ast.Name)} - called
    return names, Compiled(name, term)


def _apply(name: str, code: Compiled, on: str, logged: list[str], body: Body, **numbers: float) -> Body:
    if body.place is None and _needs(code, on):
        return body  # first round of a simulation: nobody knows yet where the robot goes
    values = {**_values(body), **{column: body.logged[column] for column in logged}, **numbers}
    try:
        with np.errstate(all="ignore"):
            added = np.asarray(eval(code.code, {"__builtins__": {}}, {**FUNCTIONS, **values}))  # checked by _parsed
    except (ArithmeticError, TypeError, ValueError) as fault:  # of numbers that are fitted: k / (k - k), (-k)**0.5
        raise ModelError(f"formula {name} cannot be calculated with {numbers}: {fault}. Write it in another way.") from fault
    if added.dtype.kind == "c":
        raise ModelError(f"formula {name} is no real number with {numbers}: a root of what is below 0. Write it in another way.")
    added = np.broadcast_to(added, body.forward_m_s.shape) * (body.moving if on in {"east", "north"} else 1.0)
    if not np.isfinite(added).all():
        raise ModelError(
            f"formula {name} is {added[~np.isfinite(added)][0]} somewhere on these trials: a pole, a root or logarithm of "
            "what is not positive. Write it so that it is finite for every speed, at rest too."
        )
    if on not in {"east", "north"}:
        return body.with_added(ON[on], added)
    assert body.place is not None
    return body.with_drift(on, added, body.place[..., 2])


def _needs(code: Compiled, on: str) -> bool:
    return on in {"east", "north"} or bool(_PLACE & set(code.code.co_names))


def _values(body: Body) -> dict[str, Array]:
    begin = body.session_s[:, :1]
    values = {
        "v": body.forward_m_s,
        "w": body.yaw_rad_s,
        "l": body.left_m_s,
        "r": body.right_m_s,
        "t": body.session_s,
        "tau": body.session_s - begin,
        "d": np.cumsum(np.abs(body.forward_m_s) * np.diff(body.session_s, axis=1, prepend=begin), axis=1),
        "moving": body.moving,
    }
    if body.place is not None:
        values |= {"x": body.place[..., 0], "y": body.place[..., 1], "heading": body.place[..., 2]}
    return values
