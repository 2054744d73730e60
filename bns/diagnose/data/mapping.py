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
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import yaml

from bns.errors import DataError, unknown_name

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
    "rad/s": ("rad/s", 1.0),
    "deg/s": ("rad/s", math.pi / 180),
}
"""Unit -> what it measures in SI units, and its size."""
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
REPEATED = ("kept", "lost")
SPLITS = ("standing_s", "lasting_s", "gap_s")
_LENGTHS = ("wheelbase_m", "hold_commands_s")
DURATION, WAYS = "duration_s", ("left_m", "right_m")
"""Of a log of single relative motions (``relative: true``): how long each took, and the way of each wheel in it."""
_TABLE_KEYS = ("columns", "also", *_LENGTHS, "trials", "repeated_poses", "relative")
_ALSO_KEYS = ("file", "columns")
_KEYS = ("from", "unit", "scale", "offset", "clockwise", "zero_deg", "up", "counts")
_UP = ("z", "y")


def mapping_beside(data: Path) -> dict[str, Any] | None:
    """The mapping kept beside a data file; None if there is none."""
    path = data.with_name(data.name + ".import.yaml")
    return load_mapping(path) if path.is_file() else None


def load_mapping(path: Path) -> dict[str, Any]:
    """A mapping file, checked; DataError with the key that is wrong."""
    try:
        tree = yaml.safe_load(path.read_text(encoding="utf-8"))
    except (OSError, yaml.YAMLError) as fault:
        raise DataError(f"The mapping {path} does not read: {fault}.") from fault
    return checked_mapping(tree, path)


def checked_mapping(tree: Any, path: Path) -> dict[str, Any]:
    """A mapping that was read already, checked; ``path`` names it. DataError with the key that is wrong."""
    if not isinstance(tree, dict) or not isinstance(tree.get("columns"), dict):
        raise DataError(f"The mapping {path} must have the key columns, with an entry for each column of the table.")
    _check_keys(f"{path}", tree, _TABLE_KEYS)
    if tree.get("repeated_poses", "kept") not in REPEATED:
        raise DataError(f"{path}: " + unknown_name("word for repeated_poses", tree["repeated_poses"], REPEATED))
    for name in _LENGTHS:
        if name in tree and not _positive(tree[name]):
            raise DataError(f"{path}: {name} is {tree[name]!r}; it must be a number above 0.")
    if not isinstance(tree.get("relative", False), bool):
        raise DataError(f"{path}: relative is {tree['relative']!r}; it must be true or false.")
    _check_trials(path, tree)
    _check_columns(path, tree["columns"])
    _check_also(path, tree.get("also", []))
    return tree


def _check_keys(where: str, given: Mapping[str, Any], valid: tuple[str, ...]) -> None:
    for key in given:
        if key not in valid:
            raise DataError(f"{where}: " + unknown_name("key", key, valid))


def _positive(value: Any) -> bool:
    return isinstance(value, int | float) and not isinstance(value, bool) and value > 0


def _check_trials(path: Path, tree: Mapping[str, Any]) -> None:
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
            f"{path}: trials is {split!r}; write one of {{standing_s: 1}}, {{lasting_s: 20}}, {{gap_s: 2}}."
        )
    if "trial" in tree["columns"]:
        raise DataError(
            f"{path}: trials are cut by {next(iter(split))} and named by a column; leave out one of the two."
        )


def _check_also(path: Path, others: Any) -> None:
    if not isinstance(others, list):
        raise DataError(f"{path}: also is {others!r}; it must be a list of {{file: NAME, columns: ...}}.")
    for other in others:
        if (
            not isinstance(other, dict)
            or not isinstance(other.get("file"), str)
            or not isinstance(other.get("columns"), dict)
        ):
            raise DataError(f"{path}: also has {other!r}; write {{file: NAME, columns: ...}}.")
        _check_keys(f"{path}: also", other, _ALSO_KEYS)
        _check_columns(path, other["columns"])
        if "t_s" not in other["columns"]:
            raise DataError(f"{path}: also: {other['file']} needs an entry t_s, by the same clock as the log's.")


def _check_columns(path: Path, columns: Mapping[str, Any]) -> None:
    for name, entry in columns.items():
        if not isinstance(entry, dict) or "from" not in entry:
            raise DataError(f"{path}: {name} is {entry!r}; write {{from: COLUMN, unit: UNIT}}.")
        _check_keys(f"{path}: {name}", entry, _KEYS)
        _check_unit(path, name, entry)
        _check_quaternion(path, name, entry)


def _check_unit(path: Path, name: str, entry: Mapping[str, Any]) -> None:
    unit = entry.get("unit")
    if unit is None:
        return
    if unit not in UNITS:
        raise DataError(f"{path}: {name}: " + unknown_name("unit", unit, UNITS))
    wanted = "m" if entry.get("counts") and _SI.get(name) == "m/s" else _SI.get(name)
    if wanted is not None and UNITS[unit][0] != wanted:
        fitting = ", ".join(u for u, (kind, _) in UNITS.items() if kind == wanted)
        more = (
            "; of turns of a wheel, give no unit but scale: its radius in metres" if unit in {"rad/s", "deg/s"} else ""
        )
        raise DataError(f"{path}: {name} cannot be in {unit}; it may be in {fitting}{more}.")


def _check_quaternion(path: Path, name: str, entry: Mapping[str, Any]) -> None:
    source, quaternion = entry["from"], entry.get("unit") == "quaternion"
    if quaternion != isinstance(source, list) or (quaternion and len(source) != 4):
        raise DataError(
            f"{path}: {name}: a quaternion is {{from: [QX, QY, QZ, QW], unit: quaternion}}; given: {source!r}."
        )
    if "up" in entry and (not quaternion or entry["up"] not in _UP):
        raise DataError(f"{path}: {name}: up is {entry['up']!r}; it is for quaternions, and z or y.")
