"""A user's own columns, units and conventions, turned into the table of measurements.

The mapping is a small YAML, kept beside the data as ``DATA.import.yaml``, so that the data stay as they were logged:

    columns:
      t_s: {from: time_ms, unit: ms}
      x_m: {from: X, unit: cm}
      heading_rad: {from: yaw, unit: deg, clockwise: true, zero_deg: 90}
    repeated_poses: lost

The last line is for a tracker that is slower than the log: a pose that repeats the one before it while the robot is told to move
was not measured anew, and counts as lost.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import yaml

from bns.errors import DataError, unknown_name
from bns.measurements import COLUMNS, COMMANDS, POSE

UNITS: Mapping[str, tuple[str, float]] = {
    "s": ("s", 1.0),
    "ms": ("s", 1e-3),
    "us": ("s", 1e-6),
    "ns": ("s", 1e-9),
    "m": ("m", 1.0),
    "cm": ("m", 1e-2),
    "mm": ("m", 1e-3),
    "in": ("m", 0.0254),
    "rad": ("rad", 1.0),
    "deg": ("rad", math.pi / 180),
    "m/s": ("m/s", 1.0),
    "cm/s": ("m/s", 1e-2),
    "mm/s": ("m/s", 1e-3),
}
"""Unit -> what it measures in SI units, and its size."""
_SI = {
    "t_s": "s",
    "left_m_s": "m/s",
    "right_m_s": "m/s",
    "x_m": "m",
    "y_m": "m",
    "heading_rad": "rad",
    "session_s": "s",
    "before_left_m_s": "m/s",
    "before_right_m_s": "m/s",
}
REPEATED = ("kept", "lost")
_KEYS = ("from", "unit", "scale", "offset", "clockwise", "zero_deg")


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
    if not isinstance(tree, dict) or not isinstance(tree.get("columns"), dict) or set(tree) - {"columns", "repeated_poses"}:
        raise DataError(
            f"The mapping {path} must have the one key columns, with an entry for each column of the table; "
            "repeated_poses may stand beside it."
        )
    if tree.get("repeated_poses", "kept") not in REPEATED:
        raise DataError(f"{path}: " + unknown_name("word for repeated_poses", tree["repeated_poses"], REPEATED))
    for name, entry in tree["columns"].items():
        _check_entry(path, name, entry)
    return tree


def _check_entry(path: Path, name: str, entry: Any) -> None:
    if not isinstance(entry, dict) or "from" not in entry:
        raise DataError(f"{path}: {name} is {entry!r}; write {{from: COLUMN, unit: UNIT}}.")
    for key in entry:
        if key not in _KEYS:
            raise DataError(f"{path}: {name}: " + unknown_name("key", key, _KEYS))
    unit = entry.get("unit")
    if unit is not None and unit not in UNITS:
        raise DataError(f"{path}: {name}: " + unknown_name("unit", unit, UNITS))
    if unit is not None and name in _SI and UNITS[unit][0] != _SI[name]:
        fitting = ", ".join(u for u, (kind, _) in UNITS.items() if kind == _SI[name])
        raise DataError(f"{path}: {name} cannot be in {unit}; it may be in {fitting}.")


def applied(table: pd.DataFrame, mapping: Mapping[str, Any]) -> pd.DataFrame:
    """The table under its new names and in SI units; columns that no entry names are kept."""
    out = table.copy()
    for name, entry in mapping["columns"].items():
        source = entry["from"]
        if source not in table.columns:
            raise DataError("The mapping asks for an " + unknown_name("column", source, map(str, table.columns)))
        out[name] = _converted(name, table[source], entry)
    used = {entry["from"] for entry in mapping["columns"].values()} - set(mapping["columns"]) - set(COLUMNS)
    out = out.drop(columns=list(used))
    if "trial" not in out.columns:
        out.insert(0, "trial", 0)
    if mapping.get("repeated_poses") == "lost":
        out.loc[repeated(out), list(POSE)] = np.nan
    return out[[*(c for c in COLUMNS if c in out.columns), *(c for c in out.columns if c not in COLUMNS)]]


def repeated(table: pd.DataFrame) -> pd.Series:
    """Rows whose pose is exactly the one before it in the trial, though the robot was told to move; (rows,) of bool."""
    if not {"trial", *POSE, *COMMANDS} <= set(table.columns):
        return pd.Series(False, index=table.index)
    same = table[[*POSE]].eq(table[[*POSE]].shift()).all(axis=1) & table["trial"].eq(table["trial"].shift())
    told = (table[list(COMMANDS)].abs().max(axis=1) > 0).shift(fill_value=False)
    return same & told


def _converted(name: str, values: pd.Series, entry: Mapping[str, Any]) -> pd.Series:
    if name == "trial":
        return values
    size = UNITS[entry["unit"]][1] if "unit" in entry else 1.0
    out = values.astype(float) * size * float(entry.get("scale", 1.0)) + float(entry.get("offset", 0.0))
    if entry.get("clockwise"):
        out = -out
    return out + math.radians(float(entry.get("zero_deg", 0.0)))
