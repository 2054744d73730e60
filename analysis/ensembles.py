"""What several networks and more generations gain under noise: the sweep ``noise-ensemble`` beside a row of ``noise-late``.

`python -m analysis.ensembles [--runs ARCHIVE] [--drives CSV]`: by default from what is published.
"""

from __future__ import annotations

import argparse
from collections.abc import Mapping, Sequence
from pathlib import Path

import pandas as pd

from analysis import ceiling, limits
from analysis.results import Results

SWEEP, ALONE = "noise-ensemble", "bns+noise=16+renew=10+missed=100+shorten=0.1"
CELLS = ("1 | 20", "3 | 20", "1 | 60", "3 | 60")
"""Networks and generations an evaluation; the first one's runs are those of the sweep `limits.LATE`."""
_CHANGES = {
    "three networks, 20 generations": (CELLS[0], CELLS[1]),
    "60 generations, one network": (CELLS[0], CELLS[2]),
    "both": (CELLS[0], CELLS[3]),
    "three networks, at 60 generations": (CELLS[2], CELLS[3]),
    "60 generations, with three networks": (CELLS[1], CELLS[3]),
}
_GROUPS = {"circle": ("circle",), "infinity": ("infinity",), "complex": ("complex",), "all three": ceiling.TASKS}


def evaluations(runs: Path) -> pd.DataFrame:
    """A row an evaluation, as `limits.evaluations`, with the cell as approach; seeds of a task that all cells have."""
    before = limits.evaluations(Results(limits.PUBLISHED / f"{limits.LATE}.parquet", archived=True), limits.LATE)
    return _common(_in_cells(before, limits.evaluations(Results(runs, archived=True), SWEEP)))


def drives(path: Path) -> pd.DataFrame:
    """Rows of `analysis.margins` of the final controllers, with the cell as approach; seeds of a task that all cells have."""
    return _common(_in_cells(pd.read_csv(limits.PUBLISHED / f"{limits.LATE}-drives.csv"), pd.read_csv(path)))


def _in_cells(before: pd.DataFrame, rows: pd.DataFrame) -> pd.DataFrame:
    together = pd.concat([before[before.approach == ALONE], rows], ignore_index=True)
    networks = together.approach.map({ALONE: "1", f"{ALONE}+ensemble=3": "3"})
    return together.assign(approach=networks + " | " + together.generations.astype(str))


def _common(rows: pd.DataFrame) -> pd.DataFrame:
    have = rows.groupby(["task", "seed"]).approach.transform("nunique")
    return rows[have == len(CELLS)]


def changes(
    rows: pd.DataFrame, driven: pd.DataFrame, pairs: Mapping[str, tuple[str, str]] = _CHANGES, measures: Sequence[str] = ("last",)
) -> pd.DataFrame:
    """Changes paired by seed, with bootstrap intervals over seeds, of each task and of the mean of all three: in the evaluations
    of each of ``measures`` (``early``, ``last``), and of the final controllers in the world (``world``). ``pairs``: of which
    approach, and to which, under a name."""
    cells = {cell: limits.of_seeds(own) for cell, own in rows.groupby(["task", "approach"])}
    shares = pd.concat(cells, names=["task", "approach"])
    world = driven.set_index(["task", "approach", "seed"]).noisy
    table = []
    for name, values in (*((measure, shares[measure]) for measure in measures), ("world", world)):
        by_cell = values.unstack("approach").astype(float)
        for what, (base, new) in pairs.items():
            gained = (by_cell[new] - by_cell[base]).unstack("task")
            for group, tasks in _GROUPS.items():
                own = gained[list(tasks)].dropna().mean(axis=1)
                table.append({"measure": name, "what": what, "of": group} | limits.interval("change", own.to_numpy()))
    return pd.DataFrame(table)


def changes_in_words(table: pd.DataFrame, measure: str) -> list[str]:
    """The rows of `changes` as the page shows them."""
    lines = []
    own_rows = table[table.measure == measure].round(6)  # halves are halves on every machine
    for what, own in own_rows.groupby("what", sort=False):
        cells = [f"{row.change:+.0f} ({row.change_low:+.0f} to {row.change_high:+.0f})" for row in own.itertuples()]
        lines.append(f"| {what} | {' | '.join(cells)} |".replace("-", "−").replace("+0", "0").replace("−0", "0"))
    return lines


def main(arguments: Sequence[str] | None = None) -> int:
    """Print the tables."""
    parser = argparse.ArgumentParser(prog="python -m analysis.ensembles", description=__doc__.split("\n\n", maxsplit=1)[0])
    parser.add_argument("--runs", type=Path, default=limits.PUBLISHED / f"{SWEEP}.parquet", help="archive of the sweep")
    parser.add_argument("--drives", type=Path, default=limits.PUBLISHED / f"{SWEEP}-drives.csv", help="rows of analysis.margins")
    wanted = parser.parse_args(arguments)
    rows, driven = evaluations(wanted.runs), drives(wanted.drives)
    print(*limits.late_in_words(rows, driven, "{}"), sep="\n")
    table = changes(rows, driven)
    for measure in ("last", "world"):
        print(*changes_in_words(table, measure), sep="\n")
    return 0


if __name__ == "__main__":
    raise SystemExit(main())
