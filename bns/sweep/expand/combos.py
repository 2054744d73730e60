"""What a sweep file says, part by part, and the parameter combinations that the parts make together."""

from __future__ import annotations

import itertools
import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from typing import Any

from bns.errors import SpecError
from bns.spec import FIELDS, RunSpec
from bns.sweep.expand.yaml_lines import Located

MOST_RUNS = 10_000_000
"""More runs than any machine carries out; a file that describes more has a slip in it."""

_SMALLER = "Give fewer seeds or shorter lists, or split the file into several."


@dataclass
class Parts:
    """What the file says, checked value by value; the places are kept for later complaints."""

    name: str = ""
    robot: str = ""
    seeds: int = 1
    first_seed: int = 0
    fixed: dict[str, Any] = field(default_factory=dict)
    grid: dict[str, list[Any]] = field(default_factory=dict)
    zip: dict[str, list[Any]] = field(default_factory=dict)
    sample: list[dict[str, Any]] = field(default_factory=list)
    include: list[tuple[Located, dict[str, Any]]] = field(default_factory=list)
    exclude: list[tuple[Located, dict[str, Any]]] = field(default_factory=list)
    tasks: list[tuple[Located, str]] = field(default_factory=list)
    world_lines: dict[str, int] = field(default_factory=dict)
    keys: dict[str, Located] = field(default_factory=dict)
    """Parameter -> its key under fixed, grid, zip or sample."""
    stored: bool = False
    """Is it a text of the results? Older versions let a value under grid come twice."""
    doubled: list[str] = field(default_factory=list)
    """``parameter: value`` of each such value, whose combinations are merged."""


def combinations(root: Located, parts: Parts) -> dict[RunSpec, dict[str, Any]]:
    """Product, exclusions, inclusions, in this order; combinations that describe the same run are merged.

    Each under the run of seed 0 that it describes. SpecError with the line for a combination that is no run,
    and for a product of more than `MOST_RUNS`.
    """
    combos: dict[RunSpec, dict[str, Any]] = {}
    for combo in _left_by_exclude(parts, _product(root, parts)):
        combos[_run(parts, combo, root)] = combo
    for place, more in parts.include:
        combo = parts.fixed | more
        combos.setdefault(_run(parts, combo, root, place), combo)
    if not combos:
        root.fail("exclude leaves no combination of the grid. Remove an element of exclude.")
    return combos


def check_size(runs: int, place: Located) -> None:
    """SpecError if a sweep has more than `MOST_RUNS` runs."""
    if runs > MOST_RUNS:
        place.fail(f"this makes {runs} runs, and a sweep may have {MOST_RUNS} at most. {_SMALLER}")


def _run(parts: Parts, combo: Mapping[str, Any], root: Located, place: Located | None = None) -> RunSpec:
    try:
        return RunSpec(robot=parts.robot, **combo)
    except SpecError as fault:
        # Every value is allowed by itself: the fault lies between parameters, and its text names them.
        text = str(fault)
        guilty = place or next((key for name, key in parts.keys.items() if name in text), root)
        guilty.fail(f"a combination cannot be run: {text}")


def _left_by_exclude(parts: Parts, product: list[dict[str, Any]]) -> list[dict[str, Any]]:
    excluded: set[int] = set()
    for place, pattern in parts.exclude:
        matching = {number for number, combo in enumerate(product) if _matches(combo, pattern)}
        if not matching:
            place.fail(f"exclude {pattern} matches no combination of the grid. Correct it or remove it.")
        excluded |= matching
    return [combo for number, combo in enumerate(product) if number not in excluded]


def _matches(combo: Mapping[str, Any], pattern: Mapping[str, Any]) -> bool:
    return all(combo.get(name, FIELDS[name].default) == value for name, value in pattern.items())


def _product(root: Located, parts: Parts) -> list[dict[str, Any]]:
    if parts.include and not parts.grid and not parts.zip and not parts.sample:
        return []
    size = math.prod(map(len, parts.grid.values())) * len(next(iter(parts.zip.values()), [None])) * max(len(parts.sample), 1)
    # Before it is laid out, which would take all memory.
    check_size(size, next((parts.keys[name] for name in (*parts.grid, *parts.zip)), root))
    return list(_laid_out(parts))


def _laid_out(parts: Parts) -> Iterator[dict[str, Any]]:
    in_step = zip(*parts.zip.values(), strict=True)
    steps = [dict(zip(parts.zip, values, strict=True)) for values in in_step] or [{}]
    drawn: list[dict[str, Any]] = parts.sample or [{}]
    for values in itertools.product(*parts.grid.values()):
        for step, point in itertools.product(steps, drawn):
            yield parts.fixed | dict(zip(parts.grid, values, strict=True)) | step | point
