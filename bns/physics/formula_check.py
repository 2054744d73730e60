"""Whether a formula is arithmetic of a sensible size, before any of it is calculated."""

from __future__ import annotations

import ast
import math
import operator
import threading
from collections.abc import Callable, Iterable, Mapping
from typing import Any

from bns.errors import ModelError, unknown_name

LONGEST, MOST_PIECES, DEEPEST = 2_000, 600, 60
"""Characters; numbers, names, operators and calls; levels of one within the other."""
LARGEST = 1e12
"""The largest number, also of those that follow from others."""
AGO, LONGEST_AGO_S = "ago", 60.0
"""The function of a wheel's past speeds, and how far back it reaches: its two arguments are numbers."""
_PARSING = threading.RLock()
"""Python's parser counts its levels for all threads together (CPython 106905): one at a time, or it fails at random."""
_ARGUMENTS: Mapping[str, int] = {"min": 2, "max": 2, AGO: 2}
_OPERATORS: Mapping[type[ast.AST], Callable[..., float]] = {
    ast.Add: operator.add,
    ast.Sub: operator.sub,
    ast.Mult: operator.mul,
    ast.Div: operator.truediv,
    ast.Pow: operator.pow,
    ast.USub: operator.neg,
    ast.UAdd: operator.pos,
}
_FUNCTIONS: Mapping[str, Callable[..., float]] = {
    "abs": abs,
    "sign": lambda x: math.copysign(1.0, x) if x else 0.0,
    "min": min,
    "max": max,
    "round": lambda x: float(round(x)),
    **{name: getattr(math, name) for name in ("sqrt", "exp", "log", "sin", "cos", "tanh")},
}


def checked_formula(where: str, term: str, functions: Iterable[str]) -> ast.Expression:
    """The syntax tree of ``term``; ModelError that begins with ``where`` for whatever keeps it from being calculated.

    Only + - * / **, numbers, names and ``functions`` with their number of arguments are allowed, and what is made of numbers
    alone must be a number of at most `LARGEST`.
    """
    if not isinstance(term, str) or not 0 < len(term.strip()) <= LONGEST:
        raise ModelError(
            f"{where} is {str(term)[:40]!r}; it must be a text of 1 to {LONGEST} characters: k * v * abs(w)."
        )
    try:
        with _PARSING:
            tree = ast.parse(term.strip(), mode="eval")
    except (SyntaxError, ValueError, MemoryError, RecursionError) as fault:
        raise ModelError(f"{where}: {_short(term)} is no formula: {fault}. Write it as in k * v * abs(w).") from fault
    pieces = sum(not isinstance(node, ast.Load) for node in ast.walk(tree))
    if pieces > MOST_PIECES or _depth(tree) > DEEPEST:
        raise ModelError(
            f"{where}: {_short(term)} is too long for a formula that can be fitted: {pieces} pieces, {_depth(tree)} levels; "
            f"{MOST_PIECES} and {DEEPEST} are allowed."
        )
    _Check(where, tuple(functions)).value(tree.body)
    return tree


class _Check:
    """Goes through the tree; the value of whatever is made of numbers alone, None of the rest."""

    def __init__(self, where: str, functions: tuple[str, ...]) -> None:
        self._where, self._functions = where, functions

    def value(self, node: ast.AST) -> float | None:
        if isinstance(node, ast.Constant) and type(node.value) in {int, float}:
            return self._bounded(node, lambda: node.value)
        if isinstance(node, ast.Name):
            if node.id in self._functions:
                raise ModelError(f"{self._where}: {node.id} is a function; write {node.id}(...).")
            return None
        if isinstance(node, ast.UnaryOp) and type(node.op) in _OPERATORS:
            return self._of(node, _OPERATORS[type(node.op)], [node.operand])
        if isinstance(node, ast.BinOp) and type(node.op) in _OPERATORS:
            return self._of(node, _OPERATORS[type(node.op)], [node.left, node.right])
        if isinstance(node, ast.Call):
            called = self._called(node)
            if called == AGO:
                self._past(node)
                return None
            return self._of(node, _FUNCTIONS[called], node.args)
        raise ModelError(
            f"{self._where}: {_short(ast.unparse(node))} is not allowed; use + - * / **, numbers, names and "
            f"{', '.join(self._functions)}."
        )

    def _called(self, node: ast.Call) -> str:
        if not isinstance(node.func, ast.Name) or node.func.id not in self._functions:
            raise ModelError(f"{self._where}: " + unknown_name("function", ast.unparse(node.func), self._functions))
        wanted = _ARGUMENTS.get(node.func.id, 1)
        if len(node.args) != wanted or node.keywords:
            given = len(node.args) + len(node.keywords)
            raise ModelError(
                f"{self._where}: {_short(ast.unparse(node))} has {given} arguments; {node.func.id} takes {wanted}."
            )
        return node.func.id

    def _past(self, node: ast.Call) -> None:
        times = [self.value(argument) for argument in node.args]
        if None in times or not 0.0 <= float(times[0] or 0.0) < float(times[1] or 0.0) <= LONGEST_AGO_S:
            raise ModelError(
                f"{self._where}: {_short(ast.unparse(node))} cannot be used: the arguments of {AGO} are two times in seconds, "
                f"0 to {LONGEST_AGO_S:g}, the smaller first: {AGO}(0.1, 0.2)."
            )

    def _of(self, node: ast.AST, function: Callable[..., Any], arguments: list[ast.expr]) -> float | None:
        values = [self.value(argument) for argument in arguments]
        if isinstance(node, ast.BinOp) and isinstance(node.op, ast.Div) and values[1] == 0.0:
            raise ModelError(f"{self._where}: {_short(ast.unparse(node))} divides by zero.")
        if None in values:
            return None
        return self._bounded(node, lambda: function(*(float(value) for value in values if value is not None)))

    def _bounded(self, node: ast.AST, calculate: Callable[[], Any]) -> float:
        try:
            value = calculate()
        except (ArithmeticError, ValueError) as fault:
            raise ModelError(f"{self._where}: {_short(_source(node))} cannot be used: {fault}.") from fault
        if isinstance(value, complex) or not abs(value) <= LARGEST:
            raise ModelError(
                f"{self._where}: {_short(_source(node))} cannot be used: it must be a real number of at most {LARGEST:g}."
            )
        return float(value)


def _depth(tree: ast.AST) -> int:
    level, depth = [tree], 0
    while level:
        level, depth = [child for node in level for child in ast.iter_child_nodes(node)], depth + 1
    return depth


def _source(node: ast.AST) -> str:
    try:
        return ast.unparse(node)
    except ValueError:  # a whole number of thousands of digits
        return "a number"


def _short(text: str) -> str:
    return repr(text if len(text) <= 60 else f"{text[:57]}...")
