"""Who was blamed for what: true effects against what was said."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from pathlib import Path

import numpy as np
from matplotlib.figure import Figure

from bns.plotting.style import PAGE_IN, save, style
from tests.hidden_effects.listed import LISTED
from tests.hidden_effects.summary import Result

FAMILIES = {
    "pair": "two effects",
    "tie": "confusable set",
    "unlisted": "unlisted effect",
    "none": "nothing hidden",
    "removed": "listed effect, barred",
    "triple": "three effects",
    "size": "other sizes, rates, noise",
}
ELSE = ("right set", "other set", "right tie", "other tie", "unlisted", "none", "insufficient-data", "no answer")
LABEL = (
    "what was said: one effect, a set of effects, or a verdict\n(count of worlds; shade: share of the row; bold: right)"
)
ENOUGH_FOR_WHITE = 0.5


def confusion(results: Sequence[Result], path: Path) -> list[Path]:
    """PNG and SVG of the counts, shaded by their share of the row; right answers are bold."""
    rows, columns = _rows(results), _columns(results)
    counts = np.array([[Counter(one.said for one in of)[column] for column in columns] for of in rows.values()])
    right = np.array([[any(o.outcome == "right" and o.said == c for o in of) for c in columns] for of in rows.values()])
    with style():
        return save(_drawn(counts, right, list(rows), columns), path)


def _rows(results: Sequence[Result]) -> dict[str, list[Result]]:
    rows: dict[str, list[Result]] = {}
    for one in sorted(results, key=_order):
        rows.setdefault(_row(one), []).append(one)
    return {f"{name} ({len(of)})": of for name, of in rows.items()}


def _row(one: Result) -> str:
    return FAMILIES.get(one.world.family) or next(iter(one.world.hidden))


def _order(one: Result) -> tuple[int, int]:
    if one.world.family in FAMILIES:
        return 1, list(FAMILIES).index(one.world.family)
    return 0, list(LISTED).index(next(iter(one.world.hidden)))


def _columns(results: Sequence[Result]) -> list[str]:
    """Every listed effect, and whatever else was said; names that nobody listed come last."""
    others = sorted({one.said for one in results} - set(LISTED) - set(ELSE))
    return [*LISTED, *ELSE, *others]


def _drawn(counts: np.ndarray, right: np.ndarray, rows: list[str], columns: list[str]) -> Figure:
    figure = Figure(figsize=(PAGE_IN, 0.24 * len(rows) + 2.0))
    axes = figure.subplots()
    share = counts / np.maximum(counts.sum(axis=1, keepdims=True), 1)
    axes.imshow(share, cmap="Blues", vmin=0, vmax=1, aspect="auto")
    axes.set_xticks(range(len(columns)), columns, rotation=60, ha="right", rotation_mode="anchor")
    axes.set_yticks(range(len(rows)), rows)
    axes.grid(visible=False)
    for row, column in np.argwhere(counts > 0):
        colour = "white" if share[row, column] > ENOUGH_FOR_WHITE else "black"
        weight = "bold" if right[row, column] else "normal"
        axes.text(column, row, counts[row, column], ha="center", va="center", color=colour, weight=weight)
    axes.set_xlabel(LABEL)
    axes.set_ylabel("hidden (worlds)")
    return figure
