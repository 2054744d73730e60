"""Pieces of a model file, each checked by itself: ModelError says what is there and what may be."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

from bns.errors import ModelError, unknown_name
from bns.safe_yaml import shown

BASIS = ("measured", "published", "fitted", "guess")
"""How a value came to be known."""


def interval(where: str, given: Any) -> tuple[float, float]:
    """Both ends of an interval."""
    fits = isinstance(given, list) and len(given) == 2
    if not fits or any(isinstance(end, bool) or not isinstance(end, int | float) for end in given):
        raise ModelError(f"{where} is {shown(given)}; it must be two numbers: [0.1, 0.2].")
    return float(given[0]), float(given[1])


def flag(where: str, value: object) -> bool:
    """A truth value."""
    if not isinstance(value, bool):
        raise ModelError(f"{where} is {shown(value)}; it must be true or false.")
    return value


def why(where: str, given: dict[str, Any]) -> tuple[str, str]:
    """Basis and reason of a value."""
    if given["basis"] not in BASIS:
        raise ModelError(f"{where}: " + unknown_name("basis", given["basis"], BASIS))
    if not isinstance(given["reason"], str) or not given["reason"].strip():
        raise ModelError(f"{where}: reason is {shown(given['reason'])}; write down why the value is what it is.")
    return given["basis"], given["reason"].strip()


def keys(where: str, tree: Any, allowed: tuple[str, ...], required: tuple[str, ...] = ()) -> dict[str, Any]:
    """A mapping with all the ``required`` keys and none but the ``allowed`` ones."""
    if not isinstance(tree, dict):
        raise ModelError(f"{where} is {shown(tree)}; it must be a mapping with the keys {join(allowed)}.")
    for key in tree:
        if key not in allowed:
            raise ModelError(f"{where}: " + unknown_name("key", key, allowed))
    missing = [key for key in required if key not in tree]
    if missing:
        raise ModelError(f"{where} lacks {join(missing)}; write each of {join(required)}.")
    return tree


def join(names: Iterable[str]) -> str:
    """Names in a sentence."""
    return ", ".join(names)
