"""A log under a mapping: a user's own columns, units and conventions turned into the table of measurements."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

from bns.diagnose.data.mapping import UNITS
from bns.diagnose.data.merge_topics import held, merged, named_topics, of_topics, wheels_from_body
from bns.diagnose.data.quaternions import yaw
from bns.diagnose.data.relative_motions import relative_motions
from bns.diagnose.data.split_trials import split
from bns.errors import DataError, unknown_name
from bns.measurements import COLUMNS, COMMANDS, POSE

Reader = Callable[[Path], pd.DataFrame]


def applied(
    table: pd.DataFrame, mapping: Mapping[str, Any], folder: Path | None = None, read: Reader | None = None
) -> pd.DataFrame:
    """The table under its new names and in SI units; columns that no entry names are kept.

    ``folder`` and ``read``: where the files of ``also`` are, and how they are read. DataError where the mapping does not fit.
    """
    out = _renamed(table, mapping["columns"])
    if of_topics(table):
        out = named_topics(out)
    for other in mapping.get("also", []):
        if folder is None or read is None:
            raise DataError(f"The mapping takes columns from {other['file']}, too; give the log as a file in the same folder.")
        with _of_file(other["file"]):
            out = merged(out, _renamed(read(folder / other["file"]), other["columns"], others=False))
    if mapping.get("relative"):
        out = relative_motions(out)
    out = wheels_from_body(out, mapping.get("wheelbase_m"))
    if "hold_commands_s" in mapping:
        out = held(out, float(mapping["hold_commands_s"]))
    if "trials" in mapping:
        out = split(out, *next(iter(mapping["trials"].items())))
    if "trial" not in out.columns:
        out.insert(0, "trial", 0)
    if mapping.get("repeated_poses") == "lost":
        out.loc[repeated(out), list(POSE)] = np.nan
    return out[[*(c for c in COLUMNS if c in out.columns), *(c for c in out.columns if c not in COLUMNS)]]


@contextmanager
def _of_file(name: str) -> Iterator[None]:
    """Name the file in an error that is met with it."""
    try:
        yield
    except DataError as error:
        if name in str(error):
            raise
        raise DataError(f"{name}: {error}") from error


def repeated(table: pd.DataFrame) -> pd.Series:
    """Rows whose pose is exactly the one before it in the trial, though the robot was told to move; (rows,) of bool."""
    if not {"trial", *POSE, *COMMANDS} <= set(table.columns):
        return pd.Series(False, index=table.index)
    same = table[[*POSE]].eq(table[[*POSE]].shift()).all(axis=1) & table["trial"].eq(table["trial"].shift())
    if "t_s" in table.columns:  # a row that was written twice says nothing of the tracker
        same &= table["t_s"].ne(table["t_s"].shift())
    told = (table[list(COMMANDS)].abs().max(axis=1) > 0).shift(fill_value=False)
    return same & told


def _renamed(table: pd.DataFrame, columns: Mapping[str, Any], others: bool = True) -> pd.DataFrame:
    """Columns by the entries; ``others``: those that no entry names stay. Counters are last: they need time and trial."""
    new: dict[str, pd.Series] = {}
    for name, entry in sorted(columns.items(), key=lambda item: bool(item[1].get("counts"))):
        values = _converted(name, _source(table, entry), entry)
        if entry.get("counts"):
            by = {"t_s": table.get("t_s"), "trial": table.get("trial"), **new}
            values = _rate(name, values, by["t_s"], by["trial"])
        new[name] = values
    if not others:
        return pd.DataFrame(new)
    used = {name for entry in columns.values() for name in _named(entry)} - set(columns) - set(COLUMNS)
    return table.drop(columns=list(used)).assign(**new)


def _named(entry: Mapping[str, Any]) -> list[Any]:
    return entry["from"] if isinstance(entry["from"], list) else [entry["from"]]


def _source(table: pd.DataFrame, entry: Mapping[str, Any]) -> pd.DataFrame:
    for name in _named(entry):
        if name not in table.columns:
            raise DataError("The mapping asks for an " + unknown_name("column", name, map(str, table.columns)))
    return table[_named(entry)]


def _converted(name: str, values: pd.DataFrame, entry: Mapping[str, Any]) -> pd.Series:
    if name == "trial":
        return values.iloc[:, 0]
    unit = entry.get("unit")
    if unit == "quaternion":
        numbers = yaw(values, entry.get("up", "z"))
    else:
        numbers = (_dated if unit == "date" else _numbers)(name, values.iloc[:, 0])
    size = UNITS[unit][1] if unit else 1.0
    out = numbers * size * float(entry.get("scale", 1.0)) + float(entry.get("offset", 0.0))
    if entry.get("clockwise"):
        out = -out
    return out + math.radians(float(entry.get("zero_deg", 0.0)))


def _numbers(name: str, values: pd.Series) -> pd.Series:
    try:
        return values.astype(float)
    except (ValueError, TypeError) as fault:
        wrong = values[pd.to_numeric(values, errors="coerce").isna() & values.notna()].iloc[0]
        hint = "; a date and time of day takes unit: date" if name == "t_s" else ""
        raise DataError(f"{name} is taken from {values.name}, which holds {wrong!r}: no number{hint}.") from fault


def _dated(name: str, values: pd.Series) -> pd.Series:
    """Seconds since the first date."""
    try:
        stamps = pd.to_datetime(values, utc=True, format="ISO8601")
    except (ValueError, TypeError) as fault:
        text = f"{name} is taken from {values.name}, whose dates do not read: {fault}. Write 2026-05-31T12:00:00.25."
        raise DataError(text) from fault
    return (stamps - pd.Timestamp(0, tz="UTC")).dt.total_seconds()


def _rate(name: str, counted: pd.Series, t_s: pd.Series | None, trial: pd.Series | None) -> pd.Series:
    """Speed until the next row of the trial, from what has been counted; a trial's last row keeps the speed before."""
    if t_s is None:
        raise DataError(f"{name} is counted, and a speed needs times: add an entry t_s.")
    trials = pd.Series(0, index=counted.index) if trial is None else trial
    by = trials.to_numpy()
    span = t_s.groupby(by).diff()
    rate = (counted.groupby(by).diff() / span.where(span > 0)).groupby(by).shift(-1)
    return rate.groupby(by).ffill()
