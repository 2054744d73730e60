"""How a user's columns, units and conventions become the table of measurements: a small YAML, kept beside the data as
``DATA.import.yaml``, so that the data stay as they were logged:

    columns:
      t_s: {from: time_ms, unit: ms}
      x_m: {from: X, unit: cm}
      heading_rad: {from: yaw, unit: deg, clockwise: true, zero_deg: 90}
    repeated_poses: lost

`docs/logs.md` lists all that may stand in it.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any

from bns.diagnose.data.located import LocatedMapping
from bns.errors import DataError, unknown_name
from bns.safe_yaml import Lines, read_yaml_file, shown

UNITS: Mapping[str, tuple[str, float]] = {
    "s": ("s", 1.0),
    "ms": ("s", 1e-3),
    "us": ("s", 1e-6),
    "ns": ("s", 1e-9),
    "date": ("s", 1.0),
    "m": ("m", 1.0),
    "cm": ("m", 1e-2),
    "mm": ("m", 1e-3),
    "in": ("m", 0.0254),
    "rad": ("rad", 1.0),
    "deg": ("rad", math.pi / 180),
    "quaternion": ("rad", 1.0),
    "m/s": ("m/s", 1.0),
    "cm/s": ("m/s", 1e-2),
    "mm/s": ("m/s", 1e-3),
    "km/h": ("m/s", 1 / 3.6),
    "in/s": ("m/s", 0.0254),
    "rad/s": ("rad/s", 1.0),
    "deg/s": ("rad/s", math.pi / 180),
}
"""Unit -> what it measures in SI units, and its size."""
WORDS: Mapping[str, str] = {
    **{"seconds": "s", "milliseconds": "ms", "microseconds": "us", "nanoseconds": "ns", "datetime": "date", "iso8601": "date"},
    **{"metres": "m", "meters": "m", "centimetres": "cm", "centimeters": "cm", "millimetres": "mm", "millimeters": "mm"},
    **{"inches": "in", "radians": "rad", "degrees": "deg"},
    **{"metres per second": "m/s", "meters per second": "m/s", "mps": "m/s", "kmh": "km/h", "kph": "km/h"},
    **{"radians per second": "rad/s", "degrees per second": "deg/s", "dps": "deg/s"},
}
"""What units are called elsewhere -> the unit."""
_TURNS_A_MINUTE = {"rpm", "rev/min", "1/min", "r/min", "turns/min"}
SIZES = {unit: size for unit, (_, size) in UNITS.items()}
"""Unit -> its size in SI units."""
FORWARD, TURN = "forward_m_s", "turn_rad_s"
"""Speeds of the body, from which those of the wheels follow where a log has no others."""
_SI = {
    "t_s": "s",
    "left_m_s": "m/s",
    "right_m_s": "m/s",
    FORWARD: "m/s",
    TURN: "rad/s",
    "x_m": "m",
    "y_m": "m",
    "heading_rad": "rad",
    "session_s": "s",
    "before_left_m_s": "m/s",
    "before_right_m_s": "m/s",
    "duration_s": "s",
    "left_m": "m",
    "right_m": "m",
}
_WORDS = {"repeated_poses": ("kept", "lost"), "lost_commands": ("kept", "held")}
"""Keys of the table whose values are words: the first by default."""
SPLITS = ("standing_s", "lasting_s", "gap_s")
_LENGTHS = ("wheelbase_m", "hold_commands_s")
DURATION, WAYS = "duration_s", ("left_m", "right_m")
"""Of a log of single relative motions (``relative: true``): how long each took, and the way of each wheel in it."""
_TABLE_KEYS = ("columns", "also", *_LENGTHS, "trials", *_WORDS, "relative")
_ALSO_KEYS = ("file", "columns")
_KEYS = ("from", "unit", "scale", "offset", "clockwise", "zero_deg", "up", "counts")
_NUMBERS, _FLAGS = ("scale", "offset", "zero_deg"), ("clockwise", "counts")
_UP = ("z", "y")


def mapping_beside(data: Path) -> LocatedMapping | None:
    """The mapping kept beside a data file; None if there is none."""
    path = data.with_name(data.name + ".import.yaml")
    return load_mapping(path) if path.is_file() else None


def files_behind(files: Sequence[Path], mapping: Mapping[str, Any] | None = None) -> list[Path]:
    """All files that a table is made from: those given, the mapping beside each, and the files that a mapping joins.

    ``mapping``: of the first; by default the one beside it.
    """
    beside = [file.with_name(file.name + ".import.yaml") for file in files]
    rules = mapping if mapping is not None else mapping_beside(files[0])
    return [*files, *beside, *(files[0].parent / str(one["file"]) for one in (rules or {}).get("also", ()))]


def refuse_to_replace(output: Path, sources: Iterable[Path], how: str = "read") -> None:
    """DataError if a file to be written is one of these: a log is not made a second time."""
    for source in sources:
        if output.resolve() == source.resolve() or (output.exists() and source.exists() and output.samefile(source)):
            raise DataError(f"{output} is what is {how} ({source}); nothing was written. Give another file with -o.")


def load_mapping(path: Path) -> LocatedMapping:
    """A mapping file, checked; DataError with its line and the key that is wrong."""
    tree, lines = read_yaml_file(path, "the mapping", DataError)
    return checked_mapping(tree, path, lines)


def checked_mapping(tree: Any, path: Path | None = None, lines: Lines | None = None) -> LocatedMapping:
    """A mapping that was read already, checked. DataError with the file, the line and the key that is wrong.

    ``path``: of its file; None for one in memory.
    """
    rules = LocatedMapping(tree if isinstance(tree, dict) else {}, path, lines)
    with rules.at():
        if not isinstance(rules.get("columns"), dict):
            raise DataError(f"it is {shown(tree)}; it must have the key columns, with an entry for each column of the table.")
    for key in rules:
        with rules.at(key):
            _check_keys("", {key: None}, _TABLE_KEYS)
    for name, words in _WORDS.items():
        with rules.at(name):
            if rules.get(name, words[0]) not in words:
                raise DataError(unknown_name(f"word for {name}", rules[name], words))
    for name in (name for name in _LENGTHS if name in rules):
        with rules.at(name):
            if not _positive(rules[name]):
                raise DataError(f"{name} is {shown(rules[name])}; it must be a number above 0.")
    with rules.at("relative"):
        if not isinstance(rules.get("relative", False), bool):
            raise DataError(f"relative is {shown(rules['relative'])}; it must be true or false.")
    with rules.at("trials"):
        _check_trials(rules)
    for name in rules["columns"]:
        with rules.at("columns", name):
            _check_columns({name: rules["columns"][name]})
    with rules.at("also"):
        if not isinstance(rules.get("also", []), list):
            raise DataError(f"also is {shown(rules['also'])}; it must be a list of {{file: NAME, columns: ...}}.")
    for number, other in enumerate(rules.get("also", [])):
        with rules.at("also", number):
            _check_also(rules, number, other)
    return rules


def _check_keys(where: str, given: Mapping[str, Any], valid: tuple[str, ...]) -> None:
    for key in given:
        if key not in valid:
            raise DataError((f"{where}: " if where else "") + unknown_name("key", key, valid))


def _positive(value: Any) -> bool:
    return isinstance(value, int | float) and not isinstance(value, bool) and value > 0


def _check_trials(tree: Mapping[str, Any]) -> None:
    if "trials" not in tree:
        return
    split = tree["trials"]
    if (
        not isinstance(split, dict)
        or len(split) != 1
        or not set(split) <= set(SPLITS)
        or not _positive(*split.values())
    ):
        raise DataError(
            f"trials is {shown(split)}; write one of {{standing_s: 1}}, {{lasting_s: 20}}, {{gap_s: 2}}."
        )


def _check_also(rules: LocatedMapping, number: int, other: Any) -> None:
    if not isinstance(other, dict) or not isinstance(other.get("file"), str) or not isinstance(other.get("columns"), dict):
        raise DataError(f"also has {shown(other)}; write {{file: NAME, columns: ...}}.")
    _check_keys("also", other, _ALSO_KEYS)
    for name in other["columns"]:
        with rules.at("also", number, "columns", name):
            _check_columns({name: other["columns"][name]})
    if "t_s" not in other["columns"]:
        raise DataError(f"also: {other['file']} needs an entry t_s, by the same clock as the log's.")


def _check_columns(columns: Mapping[str, Any]) -> None:
    for name, entry in columns.items():
        if not isinstance(entry, dict) or "from" not in entry:
            raise DataError(f"{name} is {shown(entry)}; write {{from: COLUMN, unit: UNIT}}.")
        _check_keys(f"{name}", entry, _KEYS)
        _check_entry(name, entry)
        _check_unit(name, entry)
        _check_quaternion(name, entry)


def _check_entry(name: str, entry: Mapping[str, Any]) -> None:
    sources = entry["from"] if isinstance(entry["from"], list) else [entry["from"]]
    if not isinstance(name, str) or not all(isinstance(source, str) for source in sources):
        raise DataError(f"{name!r} is taken from {shown(entry['from'])}; both are names of columns: put them in quotes.")
    for key in (key for key in _NUMBERS if key in entry):
        value = entry[key]
        if isinstance(value, bool) or not isinstance(value, int | float) or not abs(value) < math.inf:
            raise DataError(f"{name}: {key} is {shown(value)}; it must be a number.")
        if key == "scale" and value == 0:
            raise DataError(f"{name}: scale is 0, so that every value would be the same; it must be another number.")
    for key in (key for key in _FLAGS if key in entry):
        if not isinstance(entry[key], bool):
            raise DataError(f"{name}: {key} is {shown(entry[key])}; it must be true or false.")


def _check_unit(name: str, entry: Mapping[str, Any]) -> None:
    unit = entry.get("unit")
    if unit is None:
        return
    if isinstance(unit, str) and unit.lower() in _TURNS_A_MINUTE and _SI.get(name) in {"m/s", "rad/s"}:
        scale = "the wheel's radius in metres times 0.10472" if _SI[name] == "m/s" else "0.10472 (rad/s for one of them)"
        raise DataError(f"{name}: {unit} is no unit here; turns per minute have a scale instead, {scale}.")
    if not isinstance(unit, str) or unit not in UNITS:
        raise DataError(f"{name}: " + unknown_name("unit", unit, UNITS, WORDS))
    wanted = "m" if entry.get("counts") and _SI.get(name) == "m/s" else _SI.get(name)
    if wanted is not None and UNITS[unit][0] != wanted:
        fitting = ", ".join(u for u, (kind, _) in UNITS.items() if kind == wanted)
        more = (
            "; of turns of a wheel, give no unit but scale: its radius in metres" if unit in {"rad/s", "deg/s"} else ""
        )
        raise DataError(f"{name} cannot be in {unit}; it may be in {fitting}{more}.")


def _check_quaternion(name: str, entry: Mapping[str, Any]) -> None:
    source, quaternion = entry["from"], entry.get("unit") == "quaternion"
    if quaternion != isinstance(source, list) or (quaternion and len(source) != 4):
        raise DataError(
            f"{name}: a quaternion is {{from: [QX, QY, QZ, QW], unit: quaternion}}; given: {shown(source)}."
        )
    if "up" in entry and (not quaternion or entry["up"] not in _UP):
        raise DataError(f"{name}: up is {shown(entry['up'])}; it is for quaternions, and z or y.")
