"""Which columns of a plain table may be what, by their names, their units and the sizes of their numbers."""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from typing import Any

import numpy as np
import pandas as pd

from bns.diagnose.data.guess.numbers import heading_convention, unit_of_positions, unit_of_speeds
from bns.diagnose.data.guess.upwards import with_up
from bns.diagnose.data.guess.words import (
    QUATERNIONS,
    WORDS,
    may_be_pose,
    rank,
    ranked_source,
    source,
    unit_of,
    words_of,
)
from bns.diagnose.data.mapping import DURATION, FORWARD, TURN, UNITS
from bns.diagnose.settings import DEFAULTS
from bns.measurements import COLUMNS, COMMANDS, POSE

RADIUS, METRES_A_COUNT = "RADIUS_M", "METRES_A_COUNT"
"""Stand where a number is that no log tells: the wheel's radius, and the way of a wheel for one count."""
_STEPS = DEFAULTS.data.guess_units
_LARGE_RAD = DEFAULTS.data.guess_degrees
_STILL = DEFAULTS.data.guess_still
_KINDS = {"t_s": "s", "x_m": "m", "y_m": "m", "heading_rad": "rad", TURN: "rad/s"}
_COUNTS = re.compile(r"\b(ticks?|counts?|encoders?|enc|steps?|pulses?)\b")
_TURNING = {"rad/s", "deg/s"}
_A_SECOND_OF = {"rad": "rad/s", "deg": "deg/s"}
"""A turn rate's unit where its name ends with the unit of an angle: `omega_deg`."""
_A_SECOND = re.compile(r"\b(s|sec|second|hz|rate|speed|vel|velocity)$")


def of_columns(table: pd.DataFrame) -> dict[str, Any]:
    """Entries of a mapping, as far as names tell; a column that has the table's own name already comes first."""
    names = {name: words_of(name) for name in _still_bodies_last(table)}
    quaternion = next((q for words in QUATERNIONS if len(q := list(_each(words, names))) == 4), None)
    free = {name: said for name, said in names.items() if name not in (quaternion or ())}
    entries = _entries(table, ("trial", "t_s"), free)
    entries |= _commands(table, _without(free, entries))
    entries |= _entries(table, POSE, _without(free, entries))
    if quaternion is not None:
        entries["heading_rad"] = {"from": quaternion, "unit": "quaternion"}
    entries = with_up(table, entries)
    lengths = unit_of_positions(table, entries)
    entries |= {name: {**entries[name], **lengths} for name in ("x_m", "y_m") if lengths}
    by_numbers = unit_of_speeds(table, entries)
    counted_from = heading_convention(table, entries)
    forward = {} if "scale" in by_numbers else by_numbers  # a robot's own units are those of its motors
    more = {**dict.fromkeys(COMMANDS, by_numbers), FORWARD: forward, "heading_rad": counted_from}
    return {name: {**entry, **more.get(name, {})} for name, entry in entries.items()}


def _still_bodies_last(table: pd.DataFrame) -> list[str]:
    """The columns; of things that are told alike (``robot.position.x [m]``, ``table.position.x [m]``), what stood still last."""
    names = [str(name) for name in table.columns]
    parts = {name: name.partition(".")[::2] for name in names}
    alike = Counter(rest for _, rest in parts.values() if rest)
    moved: dict[str, float] = {}
    for name, (body, rest) in parts.items():
        unit = unit_of(words_of(name))
        if alike[rest] > 1 and unit is not None and UNITS[unit][0] == "m":
            places = pd.to_numeric(table[name], errors="coerce")
            moved[body] = max(moved.get(body, 0.0), float(places.quantile(0.95) - places.quantile(0.05)))
    still = {body for body, far in moved.items() if far < _STILL * max(moved.values())}
    return sorted(names, key=lambda name: parts[name][0] in still)


def motions_of(table: pd.DataFrame) -> dict[str, Any] | None:
    """Entries for a table of single relative motions (scan matching): a duration, both wheels, and a list of three numbers."""
    names = {str(name): words_of(str(name)) for name in table.columns}
    bases = [
        name[:-2] for name in names if name.endswith("_2") and {f"{name[:-2]}_{i}" for i in range(3)} <= set(names)
    ]
    lasted = source(("duration", "duration s", "dt", "t"), names)
    wheels = [source(WORDS[name], names) for name in COMMANDS]
    if not bases or lasted is None or None in wheels:
        return None
    moved = zip(("x_m", "y_m", "heading_rad"), range(3), strict=True)
    speeds = {c: {"from": w, **_speed(names[str(w)])} for c, w in zip(COMMANDS, wheels, strict=True)}
    return {DURATION: {"from": lasted}, **speeds, **{name: {"from": f"{bases[0]}_{i}"} for name, i in moved}}


def _entries(table: pd.DataFrame, columns: Sequence[str], names: Mapping[str, str]) -> dict[str, Any]:
    """Entries for these columns of the table of measurements, each from another one of ``names``."""
    entries: dict[str, Any] = {}
    for column in columns:
        left = _without(names, entries)
        fitting = {name: said for name, said in left.items() if _fits(column, said)}
        found = column if column in COLUMNS and column in left else ranked_source(WORDS[column], fitting, column in POSE)
        if found is not None:
            entries[column] = {"from": found, **unit_of_column(column, found, table[found])}
    return entries


def _commands(table: pd.DataFrame, names: Mapping[str, str]) -> dict[str, Any]:
    """Entries for both wheels or for the body: for what names say was commanded rather than measured; of equals the wheels."""
    pairs = [_entries(table, pair, names) for pair in (COMMANDS, (FORWARD, TURN))]
    return max((pair for pair in pairs if len(pair) == 2), key=rank_of_commands, default={})


def rank_of_commands(entries: Mapping[str, Any]) -> int:
    """As `rank`, of the commands among entries; 2 for columns that have the table's own names."""
    told = [(name, entries[name]["from"]) for name in (*COMMANDS, FORWARD, TURN) if name in entries]
    return min((2 if name == of and name in COMMANDS else rank(words_of(of), truth=False) for name, of in told), default=0)


def _without(names: Mapping[str, str], entries: Mapping[str, Any]) -> dict[str, str]:
    """The names that no entry has taken."""
    taken = {entry["from"] for entry in entries.values()}
    return {name: said for name, said in names.items() if name not in taken}


def _fits(column: str, said: str) -> bool:
    """Whether the unit that a name ends with can be one of the column's; a wheel may be told in rad/s, a heading in anything."""
    unit = unit_of(said)
    if column in POSE and not may_be_pose(said):
        return False
    if unit is None or column in {"trial", "heading_rad", *COMMANDS}:
        return True
    kind = _KINDS.get(column, "m/s")
    return UNITS[unit][0] == kind or len(unit) == 1 or (column == TURN and unit in _A_SECOND_OF)


def _each(words: tuple[str, ...], names: Mapping[str, str]) -> Iterator[str]:
    for word in words:
        found = source((word,), names)
        if found is not None:
            yield found


def _speed(said: str) -> dict[str, Any]:
    """How a wheel's column becomes m/s, where its name tells that it is none."""
    unit = unit_of(said)
    if unit is not None and UNITS[unit][0] == "m/s":
        return {}
    if _COUNTS.search(said) and unit not in _TURNING:
        return {"scale": METRES_A_COUNT} if _A_SECOND.search(said) else {"scale": METRES_A_COUNT, "counts": True}
    turning = unit in _TURNING or re.search(r"\b(phi|wl|wr|omega|rad s)\b", said)
    return {"scale": RADIUS} if turning else {}


def unit_of_column(column: str, name: str, values: pd.Series) -> dict[str, Any]:
    """What an entry for ``column`` says of the unit: the one that the source's name ends with, or that its numbers show."""
    said = words_of(name)
    if column == "trial":
        return {}
    if column in COMMANDS and (speed := _speed(said)):
        return speed
    numbers = pd.to_numeric(values, errors="coerce")
    if column == "t_s" and numbers.isna().all():
        return {"unit": "date"}
    kind, angles = _KINDS.get(column, "m/s"), _A_SECOND_OF if column == TURN else {}
    for unit, (measures, size) in UNITS.items():
        fits = (measures == kind or unit in angles) and size != 1.0
        if fits and re.search(rf"\b{' '.join(re.findall('[a-z]+', unit))}$", said):
            return {"unit": angles.get(unit, unit)}
    if column == "t_s":
        step = float(numbers.diff().abs().replace(0, np.nan).median())
        return next(({"unit": unit} for least, unit in _STEPS if step > least), {})
    return {"unit": "deg"} if column == "heading_rad" and float(numbers.abs().max()) > _LARGE_RAD else {}
