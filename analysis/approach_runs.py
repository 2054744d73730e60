"""Which runs of approaches may be compared: those of sweeps with several, at the same values of all other parameters."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from typing import Any

import pandas as pd

from analysis.labels import CELL, TITLES, percent
from analysis.results import NoDataError, Results, among
from analysis.selection import CONFIRMING, RUNS
from bns.spec import FIELDS, field_type

GROUP = ("sweep", "robot", "world")
OTHERS = (
    *CELL,
    *("evaluations", "generations_per_evaluation", "training_iterations_per_evaluation", "training_algorithm"),
    *("min_commands", "max_commands", "overhead_s", "root_seed", "engine"),
)
"""What may vary in a sweep beside task, world, approach and seed: columns of `done`."""
_ONE_BY_ONE = 6
"""Values of a parameter that a caption names; of more it says how many there are."""


def done(store: Results) -> str:
    """SQL: run_id, sweep, `OTHERS` and cpu_s of the finished runs of all sweeps that have several approaches, each seed once.

    Raises:
        NoDataError: there is none.
    """
    rows = store.query("""SELECT sweep FROM runs WHERE status = 'ok'
        GROUP BY sweep HAVING count(DISTINCT approach) > 1 ORDER BY sweep""")
    sweeps = [sweep for sweep in rows.sweep if not sweep.endswith(CONFIRMING)]
    if not sweeps:
        raise NoDataError("no sweep has runs of two approaches that are finished; run bns sweep approaches-small")
    overhead = f"""coalesce(TRY_CAST(regexp_extract(spec, '"overhead_s":([0-9]+)', 1) AS INT), {FIELDS["overhead_s"].default})"""
    columns = ", ".join(f"{overhead} AS {name}" if name == "overhead_s" else name for name in OTHERS)
    version = """coalesce(TRY_CAST(regexp_extract(spec, '"approach_version":([0-9]+)', 1) AS INT), 1)"""
    # Runs that differ in what they record alone, or in the version of their approach, are one run: it has one say.
    return f"""(SELECT run_id, sweep, cpu_s, {columns} FROM {RUNS} WHERE status = 'ok' AND {among("sweep", sweeps)}
        QUALIFY row_number() OVER (PARTITION BY {", ".join((*GROUP, "task", "approach", "seed"))}, {", ".join(OTHERS)}
        ORDER BY {version} DESC, run_id) = 1)"""


def with_settings(rows: pd.DataFrame) -> pd.DataFrame:
    """The rows with ``setting``: a number for each combination of `OTHERS`."""
    return rows.assign(setting=rows.groupby(list(OTHERS), dropna=False).ngroup())


def groups(rows: pd.DataFrame, by: Iterable[str] = GROUP) -> list[pd.DataFrame]:
    """The rows of each sweep, robot and world (and task) that has several approaches.

    Raises:
        NoDataError: there is none.
    """
    found = [own for _, own in rows.groupby(list(by)) if own.approach.nunique() > 1]
    if not found:
        raise NoDataError("no sweep has runs of two approaches on the same robot, task and world; run bns sweep approaches-small")
    return found


def on_the_same_seeds(runs: pd.DataFrame) -> pd.DataFrame:
    """The runs of tasks, settings and seeds that every approach has: a sweep that was stopped compares like with like."""
    have = runs.groupby(["task", "setting", "seed"]).approach.transform("nunique")
    return runs[have == runs.approach.nunique()]


def varied(runs: pd.DataFrame) -> list[str]:
    """Those of `OTHERS` that take more than one value."""
    return [name for name in OTHERS if runs[name].nunique(dropna=False) > 1]


def varied_in_any(sweeps: Iterable[pd.DataFrame]) -> list[str]:
    """Those of `OTHERS` that take more than one value within one of the sweeps."""
    names = {name for own in sweeps for name in varied(own)}
    return [name for name in OTHERS if name in names]


def titled(names: Iterable[str]) -> str:
    """Parameters in words: ``mutation rate and population size``."""
    *first, last = [TITLES.get(name, name.replace("_", " ")) for name in names]
    return f"{', '.join(first)} and {last}" if first else last


def pooled_over(runs: pd.DataFrame) -> str:
    """What a caption says of the other parameters of runs `on_the_same_seeds`; "" where they all have one value."""
    said = [f"{titled([name])} ({_values(name, runs[name])})" for name in varied(runs)]
    return f" Pooled over {', '.join(said)}: each approach with the same combinations and seeds." if said else ""


def none_alike(runs: Iterable[pd.DataFrame]) -> NoDataError:
    """Why no runs of any of these sweeps may be compared."""
    names = varied_in_any(runs)
    at = f" with the same {titled(names)}" if names else ""
    return NoDataError(f"no seed has a run of every approach{at}; let the sweep go on, or give every approach the same values")


def _values(name: str, values: pd.Series) -> str:
    different = sorted(values.unique())
    if len(different) > _ONE_BY_ONE:
        return f"{len(different)} values"
    in_words = _VALUED.get(field_type(name), str) if name in FIELDS else str
    return ", ".join(in_words(value) for value in different)


_VALUED: dict[type, Callable[[Any], str]] = {float: percent, int: "{:,}".format}
