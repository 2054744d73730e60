"""Combinations drawn from ranges: `sample: {lhs: 40, ranges: {mutation_rate: [0.02, 0.3]}}` in a sweep file.

The draws depend on nothing but the kind, the number, the ranges and `seed` (0 unless it is given), so that a sweep has the same
combinations every time. Values are rounded to six digits: what is read back from a file or a table is the same number.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from bns.errors import SpecError, unknown_name
from bns.spec import FIELDS, evolvable, field_type, unquoted
from bns.sweep.expand.yaml_lines import Located

DIGITS = 6
MOST = 100_000
"""More combinations than any study has; they are laid out at once."""
_OTHER_KEYS = ("ranges", "seed")
_SEEDS = 2**32 - 1

Unit = NDArray[np.float64]


def _lhs(count: int, width: int, rng: np.random.Generator) -> Unit:
    from scipy.stats import qmc  # noqa: PLC0415  # takes a third of a second

    drawn: Unit = qmc.LatinHypercube(width, rng=rng).random(count)
    return drawn


def _sobol(count: int, width: int, rng: np.random.Generator) -> Unit:
    from scipy.stats import qmc  # noqa: PLC0415  # as above

    drawn: Unit = qmc.Sobol(width, rng=rng).random_base2(count.bit_length() - 1)
    return drawn


def _random(count: int, width: int, rng: np.random.Generator) -> Unit:
    return rng.random((count, width))


KINDS: Mapping[str, Callable[[int, int, np.random.Generator], Unit]] = {"lhs": _lhs, "sobol": _sobol, "random": _random}
"""Latin hypercube, scrambled Sobol' points, independent draws: (count, width) -> points in the unit cube."""


def read_sample(value: Located) -> list[dict[str, Any]]:
    """The points of a file's `sample`, each parameter -> value; SpecError with the line for what is wrong in it."""
    given = {name: (key, each) for name, key, each in value.items("sample")}
    for name, (key, _) in given.items():
        if name not in (*KINDS, *_OTHER_KEYS):
            key.fail(unknown_name("key of sample", name, (*KINDS, *_OTHER_KEYS)))
    kinds = [name for name in given if name in KINDS]
    if len(kinds) != 1 or "ranges" not in given:
        value.fail(
            "sample needs one of lhs, sobol and random with the number of combinations, and ranges: "
            "{lhs: 40, ranges: {mutation_rate: [0.02, 0.3]}}."
        )
    kind = kinds[0]
    count = _whole(given[kind][1], kind, 1, MOST)
    if kind == "sobol" and count & (count - 1):
        near = 2 ** (count.bit_length() - 1)
        given[kind][1].fail(f"sobol is {count}; its points are balanced in powers of two only: write {near} or {2 * near}.")
    seed = _whole(given["seed"][1], "seed", 0, _SEEDS) if "seed" in given else 0
    ranges = {name: _range(name, key, each) for name, key, each in given["ranges"][1].items("ranges")}
    if not ranges:
        given["ranges"][1].fail("ranges is empty; give a parameter with its range: mutation_rate: [0.02, 0.3].")
    names = sorted(ranges)  # the order in the file is of no matter
    points = KINDS[kind](count, len(names), np.random.default_rng(seed))
    return [{name: _at(name, ranges[name], u) for name, u in zip(names, point, strict=True)} for point in points]


def range_names(value: Located) -> list[tuple[str, Located]]:
    """The parameters that a `sample` draws, each with its key."""
    ranges = [each for name, _, each in value.items("sample") if name == "ranges"]
    return [(name, key) for each in ranges for name, key, _ in each.items("ranges")]


def _whole(value: Located, name: str, low: int, high: int) -> int:
    given = value.value()
    if not isinstance(given, int) or isinstance(given, bool) or not low <= given <= high:
        value.fail(f"{name} is {given!r}; it must be a whole number from {low} to {high}.{unquoted(given)}")
    return int(given)


def _range(name: str, key: Located, value: Located) -> tuple[float, float]:
    if name not in FIELDS or field_type(name) is str or name == "seed":
        numeric = [each for each in FIELDS if field_type(each) is not str and each != "seed"]
        key.fail(unknown_name("parameter with a range", name, numeric))
    ends = value.value()
    if not isinstance(ends, list) or len(ends) != 2:
        value.fail(f"the range of {name} is {ends!r}; give its two ends: [low, high].")
    try:
        low, high = (evolvable(name, end) for end in ends)
    except SpecError as fault:
        value.fail(f"the range of {name}: {fault}")
    if not low < high:
        value.fail(f"the range of {name} is {ends!r}; its first end must be below its second. One value belongs under fixed.")
    return low, high


def _at(name: str, ends: tuple[float, float], share: float) -> float | int:
    """The value at a share of the range; whole numbers have equal parts of it."""
    low, high = ends
    if field_type(name) is int:
        return int(min(low + math.floor(share * (high - low + 1)), high))
    return float(min(max(float(f"{low + share * (high - low):.{DIGITS}g}"), low), high))
