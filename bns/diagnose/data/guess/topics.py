"""Which topics of a recording may be poses and which commands."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import pandas as pd

from bns.diagnose.data.guess.columns import RADIUS
from bns.diagnose.data.guess.words import rank, words_of
from bns.diagnose.data.mapping import FORWARD, TURN
from bns.measurements import COMMANDS

_PLACES = (
    ("position.x", "position.y", "orientation"),
    ("translation.x", "translation.y", "rotation"),
)


def of_topic_columns(table: pd.DataFrame) -> dict[str, Any]:
    """Entries for the table of a recording: its time, the best topic of poses, and the best of commands."""
    names = [str(name) for name in table.columns]
    poses = sorted(_poses(names), key=lambda item: -rank(words_of(item[0]), truth=True))
    told = sorted(_commands(names), key=lambda item: -rank(words_of(item[0]), truth=False))
    entries: dict[str, Any] = {"t_s": {"from": "t_s"}}
    return entries | (told[0][1] if told else {}) | (poses[0][1] if poses else {})


def _poses(names: list[str]) -> Iterator[tuple[str, dict[str, Any]]]:
    """Where a pose is told, and its entries."""
    there = set(names)
    for name in names:
        for x, y, turned in _PLACES:
            base = name.removesuffix(x)
            quaternion = [f"{base}{turned}.{axis}" for axis in "xyzw"]
            if name.endswith(f".{x}") and {f"{base}{y}", *quaternion} <= there:
                heading = {"from": quaternion, "unit": "quaternion"}
                yield base, {"x_m": {"from": name}, "y_m": {"from": f"{base}{y}"}, "heading_rad": heading}
        base = name.removesuffix("theta")
        if name.endswith(".theta") and {f"{base}x", f"{base}y"} <= there:
            yield base, {"x_m": {"from": f"{base}x"}, "y_m": {"from": f"{base}y"}, "heading_rad": {"from": name}}


def _commands(names: list[str]) -> Iterator[tuple[str, dict[str, Any]]]:
    """Where speeds are told, and their entries: of joints with left and right in their names, of the body."""
    turning = [name for name in names if ".velocity." in name]
    sides = [
        next((n for n in turning if side in words_of(n.split(".velocity.")[1]).split()), None)
        for side in ("left", "right")
    ]
    if None not in sides:
        yield str(sides[0]), {c: {"from": side, "scale": RADIUS} for c, side in zip(COMMANDS, sides, strict=True)}
    for name in names:
        base = name.removesuffix("linear.x")
        if base != name and f"{base}angular.z" in names:
            yield base, {FORWARD: {"from": name}, TURN: {"from": f"{base}angular.z"}}
