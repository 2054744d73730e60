"""A log under a mapping: a user's own columns, units and conventions turned into the table of measurements."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

from bns.diagnose.data.located import LocatedMapping, located
from bns.diagnose.data.mapping import UNITS
from bns.diagnose.data.merge_topics import held, merged, named_topics, of_topics, wheels_from_body
from bns.diagnose.data.odd_commands import with_commands_held
from bns.diagnose.data.quaternions import yaw
from bns.diagnose.data.relative_motions import relative_motions
from bns.diagnose.data.split_trials import split
from bns.errors import DataError, one_slip, unknown_name
from bns.measurements import COLUMNS, COMMANDS, POSE

Reader = Callable[[Path], pd.DataFrame]


def applied(
    table: pd.DataFrame, mapping: Mapping[str, Any], folder: Path | None = None, read: Reader | None = None
) -> pd.DataFrame:
    """The table under its new names and in SI units; columns that no entry names are kept.

    ``folder`` and ``read``: where the files of ``also`` are, and how they are read. DataError where the mapping does not fit.
    """
    rules = located(mapping)
    _check_slips(table, rules)
    out = _renamed(table, rules["columns"], rules, ("columns",))
    if of_topics(table):
        out = named_topics(out)
    for number, other in enumerate(rules.get("also", [])):
        with rules.at("also", number):
            if folder is None or read is None:
                raise DataError(f"columns come from {other['file']}, too; give the log as a file in the same folder.")
            with _of_file(other["file"]):
                entries = read(folder / other["file"])
            within = ("also", number, "columns")
            out = merged(out, _renamed(entries, other["columns"], rules, within, others=False))
    if rules.get("relative"):
        with rules.at("relative"):
            out = relative_motions(out)
    with rules.at("wheelbase_m" if "wheelbase_m" in rules else "columns"):
        out = wheels_from_body(out, rules.get("wheelbase_m"))
    if "hold_commands_s" in rules:
        out = held(out, float(rules["hold_commands_s"]))
    if "trials" in rules:
        with rules.at("trials"):
            out = split(out, *next(iter(rules["trials"].items())))
    if "trial" not in out.columns:
        out.insert(0, "trial", 0)
    if rules.get("lost_commands") == "held" and _are_numbers(out, ("t_s", *COMMANDS)):
        out = with_commands_held(out, [np.asarray(rows) for rows in out.groupby("trial", sort=False).indices.values()])
    if rules.get("repeated_poses") == "lost":
        out.loc[repeated(out), list(POSE)] = np.nan
    return out[[*(c for c in COLUMNS if c in out.columns), *(c for c in out.columns if c not in COLUMNS)]]


def _are_numbers(table: pd.DataFrame, columns: Sequence[str]) -> bool:
    """Whether these columns are there and hold numbers; what is wrong with them is said when the whole table is checked."""
    return all(name in table.columns and pd.api.types.is_numeric_dtype(table[name]) for name in columns)


def _check_slips(table: pd.DataFrame, rules: LocatedMapping) -> None:
    """DataError for an entry that is a column of the measurements but for a slip, where nothing else gives that column."""
    within: list[tuple[str | int, ...]] = [("columns",), *(("also", n, "columns") for n in range(len(rules.get("also", []))))]
    entries = [rules["columns"], *(other["columns"] for other in rules.get("also", []))]
    there = {*map(str, table.columns), *(name for columns in entries for name in columns)}
    missing = [name for name in COLUMNS if name not in there and not (name == "trial" and "trials" in rules)]
    for place, columns in zip(within, entries, strict=True):
        for name in columns:
            meant = next((one for one in missing if _is_slip_of(one, name)), None)
            if meant is not None:
                with rules.at(*place, name):
                    raise DataError(
                        f"{name} would be a column of your own, and nothing gives {meant}. Did you mean {meant!r}? A column of "
                        "your own needs a name that is less like it."
                    )


def _is_slip_of(column: str, name: str) -> bool:
    """Short names differ by one letter anyway (z_m, x_m): of them only capitals are slips."""
    return one_slip(name, column) and (len(column) >= len("trial") or name.lower() == column.lower())


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


def _renamed(
    table: pd.DataFrame, columns: Mapping[str, Any], rules: LocatedMapping, within: tuple[str | int, ...], others: bool = True
) -> pd.DataFrame:
    """Columns by the entries, which lie ``within`` the mapping. Counters are last: they need time and trial.

    ``others``: columns that no entry names stay.
    """
    new: dict[str, pd.Series] = {}
    for name, entry in sorted(columns.items(), key=lambda item: bool(item[1].get("counts"))):
        with rules.at(*within, name):
            values = _converted(name, _source(table, name, entry), entry)
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


def _source(table: pd.DataFrame, name: str, entry: Mapping[str, Any]) -> pd.DataFrame:
    for source in _named(entry):
        if source not in table.columns:
            raise DataError(f"{name} asks for an " + unknown_name("column", source, map(str, table.columns)))
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
        wrong = values[values.notna() & values.map(_is_no_number)].iloc[0]
        hint = "; a date and time of day takes unit: date" if name == "t_s" else ""
        raise DataError(f"{name} is taken from {values.name}, which holds {wrong!r}: no number{hint}.") from fault


def _is_no_number(value: object) -> bool:
    try:
        float(value)  # type: ignore[arg-type]  # whatever a cell holds
    except (ValueError, TypeError):
        return True
    return False


def _dated(name: str, values: pd.Series) -> pd.Series:
    """Seconds since the first date."""
    if pd.api.types.is_numeric_dtype(values):
        raise DataError(f"{name} is taken from {values.name}, which holds numbers, no dates; give their unit: s, ms, us or ns.")
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
