"""The value of a formula for arrays, asked for again and again while its numbers are fitted.

A fit changes the numbers, and in most cases not the velocities that they multiply. So what contains no number is worked out
once, and kept while the arrays are the same; results are the same to the last bit.
"""

from __future__ import annotations

import ast
import threading
from collections.abc import Callable, Iterable, Iterator, Mapping
from copy import deepcopy
from dataclasses import dataclass
from functools import lru_cache
from typing import Any

import numpy as np

from bns.physics.formula_check import AGO, checked_formula
from bns.physics.signals import Array
from bns.physics.wheels.scans import averaged

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
    "round": np.round,
}
WORTH_KEEPING = 2000
"""Elements of an array; what is made of smaller ones is worked out sooner than it is found."""
KEPT_BYTES = 128 * 2**20
"""Of all that is kept, with what it was made of."""


@dataclass(frozen=True)
class Ago:
    """The mean of a velocity over a past interval, in every step."""

    velocity: Array
    step_s: Array

    def __call__(self, from_s: float, to_s: float) -> Array:
        """The interval from ``from_s`` to ``to_s`` seconds ago."""
        return averaged(self.velocity, self.step_s, float(from_s), float(to_s))


class Compiled:
    """A checked term, ready to be calculated, and the names in it; pickled as its text."""

    def __init__(self, name: str, term: str) -> None:
        """ModelError, with ``name`` in it, if the term is none."""
        self._made_of = name, term
        self._tree = checked_formula(f"formula {name}", term, (*FUNCTIONS, AGO))
        calls = [node.func for node in ast.walk(self._tree) if isinstance(node, ast.Call)]
        self.called = {function.id for function in calls if isinstance(function, ast.Name)}
        self.names = _names(self._tree) - self.called
        self._code = compile(self._tree, name, "eval")
        self._split: dict[frozenset[str], _Split] = {}

    def __reduce__(self) -> tuple[Any, ...]:
        return Compiled, self._made_of

    def value(self, values: Mapping[str, Any]) -> Any:
        """The value for a number or an array for each name."""
        with np.errstate(all="ignore"):
            return eval(self._code, {"__builtins__": {}}, {**FUNCTIONS, **values})  # checked when it was made

    def value_of_numbers(self, values: Mapping[str, Any]) -> Any:
        """The same, where most arrays are expected to be those of a call before."""
        key = frozenset(self.names) & {name for name, value in values.items() if not isinstance(value, np.ndarray)}
        split = self._split.get(key)
        if split is None:
            split = self._split[key] = _Split(self._made_of[0], self._tree, key)
        with np.errstate(all="ignore"):
            return eval(split.code, {"__builtins__": {}}, {**FUNCTIONS, **values, **_KEPT.of(split, values)})


@lru_cache(maxsize=4096)
def compiled(name: str, term: str) -> Compiled:
    """The compiled term, remembered: a search asks for the same few hundred again and again."""
    return Compiled(name, term)


def _names(tree: ast.AST) -> set[str]:
    return {node.id for node in ast.walk(tree) if isinstance(node, ast.Name)}


class _Split(ast.NodeTransformer):
    """A term with a name for each part that contains no number, and the code of every part."""

    def __init__(self, name: str, tree: ast.Expression, numbers: frozenset[str]) -> None:
        self._numbers, self._known, self._name = numbers, dict[str, str](), name
        self.parts: dict[str, Any] = {}
        self.names: set[str] = set()
        body = self.visit(deepcopy(tree.body))
        self.code = compile(ast.fix_missing_locations(ast.Expression(body)), name, "eval")

    def visit(self, node: ast.AST) -> Any:
        """The node, or the name of a part in its place."""
        if isinstance(node, ast.Name | ast.Constant) or not isinstance(node, ast.expr):
            return node
        names = _names(node)
        if names & self._numbers:
            return self.generic_visit(node)
        text = ast.unparse(node)
        if text not in self._known:
            self._known[text] = part = f"part {len(self.parts)}"  # with a blank: no name in a formula is like it
            self.parts[part] = compile(ast.Expression(node), self._name, "eval")
            self.names |= names - set(FUNCTIONS)
        return ast.Name(self._known[text], ast.Load())

    def worked_out(self, values: Mapping[str, Any]) -> dict[str, Any]:
        """The value of every part."""
        known = {**FUNCTIONS, **values}
        return {part: eval(code, {"__builtins__": {}}, known) for part, code in self.parts.items()}


@dataclass(frozen=True)
class _Entry:
    arrays: tuple[Array, ...]
    parts: dict[str, Any]

    @property
    def bytes(self) -> int:
        return sum(a.nbytes for a in (*self.arrays, *(p for p in self.parts.values() if isinstance(p, np.ndarray))))


class _Parts:
    """Parts that were worked out lately, of all terms; the oldest are forgotten first."""

    def __init__(self) -> None:
        self._entries: dict[tuple[Any, ...], _Entry] = {}
        self._lock, self._bytes = threading.Lock(), 0

    def of(self, split: _Split, values: Mapping[str, Any]) -> dict[str, Any]:
        """The values of a term's parts, for these values of its names."""
        arrays = tuple(_arrays_of(values[name] for name in sorted(split.names)))
        if not arrays or max(a.size for a in arrays) < WORTH_KEEPING:
            return split.worked_out(values)
        key = (split, *((a.shape, float(a.sum())) for a in arrays))
        with self._lock:
            entry = self._entries.pop(key, None)
            if entry is not None:
                self._entries[key] = entry  # the latest is the last
        if entry is not None and all(np.array_equal(a, b) for a, b in zip(arrays, entry.arrays, strict=True)):
            return entry.parts
        new = _Entry(tuple(a.copy() for a in arrays), split.worked_out(values))
        with self._lock:
            self._forget(key)
            self._entries[key], self._bytes = new, self._bytes + new.bytes
            while self._bytes > KEPT_BYTES:
                self._forget(next(iter(self._entries)))
        return new.parts

    def _forget(self, key: tuple[Any, ...]) -> None:
        gone = self._entries.pop(key, None)
        self._bytes -= gone.bytes if gone is not None else 0


def _arrays_of(values: Iterable[Any]) -> Iterator[Array]:
    for value in values:
        if isinstance(value, Ago):
            yield from (value.velocity, value.step_s)
        elif isinstance(value, np.ndarray):
            yield value


_KEPT = _Parts()
