"""One setting: its value, its unit, and why it has that value."""

from __future__ import annotations

from dataclasses import field
from typing import TypeVar

T = TypeVar("T")

BY_HAND = "chosen by hand; not measured"
"""The honest reason of a number that nobody has compared with others."""


def setting(value: T, unit: str, why: str) -> T:
    """A field of a frozen dataclass with this value; ``unit`` ("1" for bare numbers) and ``why`` are its metadata."""
    made: T = field(default=value, metadata={"unit": unit, "why": why})
    return made
