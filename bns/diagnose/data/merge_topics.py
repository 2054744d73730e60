"""Logs whose columns were written at different rates, or that tell the body instead of the wheels what to do: the topics of a
bag, each a table of its own or each with rows of its own."""

from __future__ import annotations

import numpy as np
import pandas as pd

from bns.diagnose.data.mapping import FORWARD, TURN
from bns.errors import DataError
from bns.measurements import COMMANDS, POSE


def merged(table: pd.DataFrame, other: pd.DataFrame) -> pd.DataFrame:
    """The rows of both in the order of time, empty where a row's table has no such column; rows of one time are made one.

    DataError if they share columns beside time and trial, or if only one of them has trials.
    """
    keys = ["trial", "t_s"] if "trial" in table.columns else ["t_s"]
    if ("trial" in other.columns) != ("trial" in table.columns):
        raise DataError("only some of the tables that are joined have trials; give all of them an entry trial, or none.")
    both = sorted((set(table.columns) & set(other.columns)) - set(keys))
    if both:
        raise DataError(f"two tables give {', '.join(both)}; leave all but one of them out.")
    rows = pd.concat([table, other], ignore_index=True)
    if rows["t_s"].isna().any():
        raise DataError("Tables can be joined only if every row has a time; t_s is empty in some.")
    order = {name: number for number, name in enumerate(pd.unique(table["trial"]))} if "trial" in keys else {}
    began = rows["trial"].map(order) if order else pd.Series(0, index=rows.index)
    rows = rows.assign(began_=began).sort_values(["began_", "t_s"], kind="stable").drop(columns="began_")
    return rows.groupby(keys, sort=False, as_index=False, dropna=False).first()


def of_topics(table: pd.DataFrame) -> bool:
    """Is this a recording's table, whose columns are called after topics (``/cmd_vel.linear.x``)?"""
    return any(str(name).startswith("/") for name in table.columns)


def named_topics(table: pd.DataFrame) -> pd.DataFrame:
    """A recording's table with the columns that a mapping named, and the rows in which one of these says something."""
    named = table[[name for name in table.columns if not str(name).startswith("/")]]
    said = [name for name in named.columns if name not in {"t_s", "trial"}]
    return named[named[said].notna().any(axis=1)].reset_index(drop=True)


def held(table: pd.DataFrame, at_most_s: float) -> pd.DataFrame:
    """Every command in force until the next one, for at most so long: then the robot is told nothing, as by its watchdog.

    Rows of poses lie between those of commands and are empty there; a command that runs out between two rows ends at the later.
    """
    names = [name for name in (*COMMANDS, FORWARD, TURN) if name in table.columns]
    by = table["trial"].to_numpy() if "trial" in table.columns else np.zeros(len(table))
    told = table[names].notna().all(axis=1)
    since = table["t_s"].where(told).groupby(by).ffill()
    fresh = table["t_s"] - since <= at_most_s
    return table.assign(**{name: table[name].groupby(by).ffill().where(fresh) for name in names})


def wheels_from_body(table: pd.DataFrame, wheelbase_m: float | None) -> pd.DataFrame:
    """Speeds of both wheels from those of the body, v -+ w b / 2, where the table has the latter.

    DataError where the wheelbase is missing, or half of what is needed.
    """
    there = [name for name in (FORWARD, TURN) if name in table.columns]
    if not there:
        return table
    if len(there) == 1:
        other = FORWARD if there[0] == TURN else TURN
        raise DataError(f"there is {there[0]} but not {other}; the wheel speeds need both.")
    twice = [name for name in COMMANDS if name in table.columns]
    if twice:
        raise DataError(
            f"there are {' and '.join(twice)} and speeds of the body; leave out the ones that were not commanded."
        )
    if wheelbase_m is None:
        raise DataError(
            f"wheel speeds follow from {FORWARD} and {TURN} with the wheelbase that the robot's own controller assumes: "
            "add wheelbase_m: METRES to the mapping."
        )
    apart = table[TURN] * float(wheelbase_m) / 2
    return table.drop(columns=there).assign(left_m_s=table[FORWARD] - apart, right_m_s=table[FORWARD] + apart)


def without_commands(table: pd.DataFrame) -> float:
    """Share of the rows with a pose, after the first command, in which none is in force; 0 where there are no such rows."""
    told = table[list(COMMANDS)].notna().all(axis=1)
    begun = told.groupby(table["trial"].to_numpy()).cummax()
    seen = table[list(POSE)].notna().all(axis=1) & begun
    return float((~told[seen]).mean()) if seen.any() else 0.0
