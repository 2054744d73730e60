"""A first mapping for a log that has none, guessed from the names of its columns: to be read and mended, never used unseen."""

from __future__ import annotations

import re
from collections.abc import Iterator, Sequence
from typing import Any

import numpy as np
import pandas as pd
import yaml

from bns.diagnose.data.mapping import FORWARD, TURN, UNITS
from bns.diagnose.settings import DEFAULTS

_WORDS: dict[str, tuple[str, ...]] = {
    "trial": ("trial", "run", "episode", "experiment"),
    "t_s": ("t", "time", "stamp", "timestamp"),
    "left_m_s": ("left", "vl", "wl"),
    "right_m_s": ("right", "vr", "wr"),
    FORWARD: ("v", "linear x", "twist x", "vx", "speed", "velocity"),
    TURN: ("omega", "angular z", "w", "wz", "yaw rate", "yawrate"),
    "x_m": ("position x", "pos x", "px", "x"),
    "y_m": ("position y", "pos y", "py", "y"),
    "heading_rad": ("yaw", "heading", "theta", "psi", "compass", "orientation"),
}
"""Column of the table -> words that its sources have in their names, the surer first."""
_QUATERNION = (("qx", "qy", "qz", "qw"), tuple(f"orientation {axis}" for axis in "xyzw"))
_STEPS = DEFAULTS.data.guess_units
_LARGE_RAD = DEFAULTS.data.guess_degrees


def drafted(table: pd.DataFrame) -> str:
    """The guess as YAML; an empty ``columns`` where no name tells anything."""
    names = {str(name): _words(str(name)) for name in table.columns}
    entries: dict[str, Any] = {}
    quaternion = next((q for words in _QUATERNION if len(q := list(_each(words, names))) == 4), None)
    for column, words in _WORDS.items():
        selected = {entry["from"] for entry in entries.values()} | set(quaternion or ())
        source = _source(words, {name: said for name, said in names.items() if name not in selected})
        if column == "heading_rad" and quaternion is not None:  # the last
            entries[column] = {"from": quaternion, "unit": "quaternion"}
        elif source is not None and not (column in {FORWARD, TURN} and "left_m_s" in entries):
            entries[column] = {"from": source, **_unit(column, names[source], table[source])}
    more = {"wheelbase_m": "METRES"} if {FORWARD, TURN} <= set(entries) else {}
    cut = {} if "trial" in entries else {"trials": {"standing_s": 1}}
    return yaml.safe_dump({"columns": entries, **more, **cut}, sort_keys=False, default_flow_style=None, width=120)


def _words(name: str) -> str:
    """A column's name in small words: `pose.position.x`, `cmdVel_left (mm/s)` -> `pose position x`, `cmd vel left mm s`."""
    spaced = re.sub(r"(?<=[a-z])(?=[A-Z])", " ", name)
    return " ".join(re.findall(r"[a-z0-9]+", spaced.lower()))


def _source(words: Sequence[str], names: dict[str, str]) -> str | None:
    return next((name for word in words for name, said in names.items() if re.search(rf"\b{word}\b", said)), None)


def _each(words: Sequence[str], names: dict[str, str]) -> Iterator[str]:
    for word in words:
        source = _source((word,), names)
        if source is not None:
            yield source


def _unit(column: str, said: str, values: pd.Series) -> dict[str, str]:
    """The unit that a name ends with, or that the numbers show."""
    if column == "trial":
        return {}
    numbers = pd.to_numeric(values, errors="coerce")
    if column == "t_s" and numbers.isna().all():
        return {"unit": "date"}
    kind = {"t_s": "s", "x_m": "m", "y_m": "m", "heading_rad": "rad", TURN: "rad/s"}.get(column, "m/s")
    for unit, (measures, size) in UNITS.items():
        if measures == kind and size != 1.0 and re.search(rf"\b{' '.join(re.findall('[a-z]+', unit))}$", said):
            return {"unit": unit}
    if column == "t_s":
        step = float(numbers.diff().abs().replace(0, np.nan).median())
        return next(({"unit": unit} for least, unit in _STEPS if step > least), {})
    return {"unit": "deg"} if column == "heading_rad" and float(numbers.abs().max()) > _LARGE_RAD else {}
