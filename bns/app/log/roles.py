"""Which column of a log is what, and in which unit: what menus show of a mapping, and the mapping after another choice."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from copy import deepcopy
from dataclasses import dataclass
from typing import Any

import pandas as pd
import yaml

from bns.diagnose.data.guess.columns import METRES_A_COUNT, RADIUS, unit_of_column
from bns.diagnose.data.guess.mapping import guessed
from bns.diagnose.data.guess.numbers import SCALE
from bns.diagnose.data.guess.words import rank, words_of
from bns.diagnose.data.mapping import FORWARD, SPLITS, TURN, UNITS
from bns.measurements import COMMANDS

Mapped = dict[str, Any]
"""A mapping of `bns import` as a tree."""
Source = str | tuple[str, ...]
"""A column, or the four of a quaternion."""
Place = tuple[str, Source]
"""File ("" for the one beside which the mapping lies) and column."""

ROLES = {
    "trial": "Trial",
    "t_s": "Time",
    "left_m_s": "Left wheel, commanded",
    "right_m_s": "Right wheel, commanded",
    FORWARD: "Forward speed, commanded",
    TURN: "Turning speed, commanded",
    "x_m": "Position x",
    "y_m": "Position y",
    "heading_rad": "Heading",
}
"""Column of the table of measurements -> what it is called on the page."""
WHEELS, BODY = "speeds of both wheels", "forward and turning speed"
COMMANDED = {WHEELS: COMMANDS, BODY: (FORWARD, TURN)}
"""How a robot is commanded -> the columns for it."""
TURNS, COUNTED = "rad/s × radius of the wheel", "counts of an encoder"
"""Units of a wheel's column that need a number which no log tells."""
_KINDS = {
    "t_s": "s",
    **dict.fromkeys((*COMMANDS, FORWARD), "m/s"),
    TURN: "rad/s",
    **dict.fromkeys(("x_m", "y_m"), "m"),
    "heading_rad": "rad",
}
_AXES = ("x", "y", "z", "w")
FROM_X, FROM_NORTH = "counter-clockwise from x", "clockwise from y (a compass)"
RUNNING: Mapping[str, Mapping[str, Any]] = {FROM_X: {}, FROM_NORTH: {"clockwise": True, "zero_deg": 90}}
"""How a heading may run -> what its entry says."""
BY_COLUMN, WHOLE = "by a column", "the log is one trial"
CUTS = {
    "standing_s": "where the robot stands still for (s)",
    "lasting_s": "into pieces of (s)",
    "gap_s": "where nothing was logged for (s)",
}
"""How one long log is cut into trials: key of a mapping -> what it is called on the page."""
assert set(CUTS) == set(SPLITS)


@dataclass(frozen=True)
class Picked:
    """What a mapping says of a role; ``unit``: one of `units`."""

    place: Place
    unit: str


class Menus:
    """The choices that the columns of some files allow. ``tables``: files by name, the first is "" (`Place`)."""

    def __init__(self, tables: Mapping[str, pd.DataFrame]) -> None:
        self.tables = dict(tables)
        first, *others = self.tables.items()
        self.guess = guessed(first[1], dict(others))

    def columns(self, role: str) -> dict[str, Place]:
        """What may be chosen for a role, by its label."""
        found: dict[str, Place] = {}
        for file, table in self.tables.items():
            before = f"{file}: " if file else ""
            names = [str(name) for name in table.columns]
            if role == "heading_rad":
                found |= {f"{before}quaternion {', '.join(four)}": (file, four) for four in _quaternions(names)}
            found |= {f"{before}{name}": (file, name) for name in names}
        return found

    def with_column(self, mapping: Mapped, role: str, place: Place | None) -> Mapped:
        """The mapping with a role taken from another column, in the unit that its name and numbers suggest; None: from none."""
        new = without_role(mapping, role)
        if role == "trial" and place is not None:
            new.pop("trials", None)
        if place is None:
            return new
        file, source = place
        entries = self._entries(new, file)
        entries[role] = {"from": list(source), "unit": "quaternion"} if isinstance(source, tuple) else {"from": source}
        if isinstance(source, str) and role != "trial":
            entries[role] |= unit_of_column(role, source, self.tables[file][source])
        return new

    def _entries(self, mapping: Mapped, file: str) -> dict[str, Any]:
        """The mapping's entries for a file, which are begun with its time where it has none yet."""
        if not file:
            return dict_in(mapping, "columns")
        also = mapping.setdefault("also", [])
        for one in also:
            if one["file"] == file:
                return dict_in(one, "columns")
        time = guessed(self.tables[file]).mapping["columns"].get("t_s")
        also.append({"file": file, "columns": {"t_s": time} if time else {}})
        return dict_in(also[-1], "columns")


def label(mapping: Mapping[str, Any], role: str) -> str:
    """What a role is called beside the column that was chosen for it: wheels that were measured are not commanded."""
    said, found = ROLES[role], picked(mapping, role)
    if found is None or role not in {*COMMANDS, FORWARD, TURN} or rank(words_of(str(found.place[1])), truth=False) >= 0:
        return said
    return said.replace("commanded", "measured")


def units(role: str, source: Source) -> list[str]:
    """The units that a role may be in; the first is its own."""
    if isinstance(source, tuple):
        return ["quaternion"]
    kind = _KINDS.get(role)
    fitting = [u for u, (measures, _) in UNITS.items() if measures == kind and u != "quaternion"]
    return [*fitting, TURNS, COUNTED] if role in COMMANDS else fitting


def picked(mapping: Mapping[str, Any], role: str) -> Picked | None:
    """What the mapping says of a role; None if nothing."""
    for file, entries in _files(mapping):
        if role in entries:
            entry = entries[role]
            source = tuple(entry["from"]) if isinstance(entry["from"], list) else str(entry["from"])
            return Picked((file, source), _unit_of(role, entry, source))
    return None


def with_unit(mapping: Mapped, role: str, unit: str) -> Mapped:
    """The mapping with a role's column in another unit; how a heading runs stays."""
    new = deepcopy(mapping)
    for _, entries in _files(new):
        if role in entries:
            of_unit = {"unit", "scale", "counts"} if role in COMMANDS else {"unit"}
            entry = {k: v for k, v in entries[role].items() if k not in of_unit}
            entries[role] = {**entry, **_in_entry(role, unit, entries[role].get("scale"))}
    return new


def commanded(mapping: Mapping[str, Any]) -> str:
    """One of `COMMANDED`."""
    named = {role for _, entries in _files(mapping) for role in entries}
    return BODY if named & {FORWARD, TURN} and not named & set(COMMANDS) else WHEELS


def wheel_scale(mapping: Mapping[str, Any]) -> float | None:
    """Radius of the wheels, or metres a count; None where no unit needs one, or nobody has filled it in."""
    for role in COMMANDS:
        for _, entries in _files(mapping):
            value = entries.get(role, {}).get("scale")
            if isinstance(value, int | float):
                return float(value)
    return None


def name_of_scale(mapping: Mapping[str, Any]) -> str:
    """What the field for that number is called where it is no distance of a count."""
    unknown = any(entries.get(role, {}).get("scale") == SCALE for role in COMMANDS for _, entries in _files(mapping))
    return "Speed of one unit of the commands (m/s)" if unknown else "Radius of the wheels (m)"


def with_wheel_scale(mapping: Mapped, value: float) -> Mapped:
    """The mapping with that number for both wheels, where their unit needs one."""
    new = deepcopy(mapping)
    for role in COMMANDS:
        for _, entries in _files(new):
            if role in entries and "scale" in entries[role]:
                entries[role]["scale"] = value
    return new


def running(mapping: Mapping[str, Any]) -> str:
    """How the heading runs; "" where the mapping says something else, which menus leave as it is."""
    entry: Mapping[str, Any] = next(
        (entries["heading_rad"] for _, entries in _files(mapping) if "heading_rad" in entries), {}
    )
    said = {k: v for k, v in entry.items() if k in {"clockwise", "zero_deg"} and v}
    return next((name for name, more in RUNNING.items() if dict(more) == said), "")


def with_running(mapping: Mapped, name: str) -> Mapped:
    """The mapping with another of `RUNNING`."""
    new = deepcopy(mapping)
    for _, entries in _files(new):
        if "heading_rad" in entries:
            kept = {k: v for k, v in entries["heading_rad"].items() if k not in {"clockwise", "zero_deg"}}
            entries["heading_rad"] = {**kept, **RUNNING[name]}
    return new


def with_cut(mapping: Mapped, key: str, seconds: float) -> Mapped:
    """The mapping that cuts one long log into trials (`CUTS`) instead of taking their names from a column."""
    new = without_role(mapping, "trial")
    new["trials"] = {key: seconds}
    return new


def without_role(mapping: Mapped, role: str) -> Mapped:
    """The mapping without a role; files of which only the time is left are not read."""
    new = deepcopy(mapping)
    for _, entries in _files(new):
        entries.pop(role, None)
    if "also" in new:
        new["also"] = [one for one in new["also"] if set(one["columns"]) - {"t_s"} or role == "t_s"]
        if not new["also"]:
            del new["also"]
    return new


def written(mapping: Mapping[str, Any]) -> str:
    """As a file `LOG.import.yaml` has it."""
    return yaml.safe_dump(dict(mapping), sort_keys=False, default_flow_style=None, width=120, allow_unicode=True)


def dict_in(tree: dict[str, Any], key: str) -> dict[str, Any]:
    """The dictionary of a key, which is begun where it is missing."""
    inner: dict[str, Any] = tree.setdefault(key, {})
    return inner


def _files(mapping: Mapping[str, Any]) -> Iterator[tuple[str, dict[str, Any]]]:
    """Entries of every file."""
    yield "", mapping.get("columns") or {}
    for one in mapping.get("also", ()):
        yield one["file"], one["columns"]


def _unit_of(role: str, entry: Mapping[str, Any], source: Source) -> str:
    if entry.get("counts"):
        return COUNTED
    if role in COMMANDS and "scale" in entry and "unit" not in entry:
        return TURNS
    return str(entry.get("unit") or next(iter(units(role, source)), ""))


def _in_entry(role: str, unit: str, scale: Any) -> dict[str, Any]:
    """What an entry says of a unit; a number that was filled in stays."""
    if unit == TURNS:
        return {"scale": scale if isinstance(scale, int | float) else RADIUS}
    if unit == COUNTED:
        return {"scale": scale if isinstance(scale, int | float) else METRES_A_COUNT, "counts": True}
    return {} if unit == units(role, "")[0] else {"unit": unit}


def _quaternions(names: list[str]) -> list[tuple[str, ...]]:
    """Columns that end in x, y, z and w and are called alike before that."""
    there = set(names)
    fours = [tuple(f"{name[:-1]}{axis}" for axis in _AXES) for name in names if name.endswith("x")]
    return [four for four in fours if set(four) <= there]
