"""What a local search on the surest controller gains: the sweep ``noise-polish``.

`python -m analysis.polishing [--runs ARCHIVE] [--drives CSV]`: by default from what is published.
"""

from __future__ import annotations

import argparse
from collections.abc import Sequence
from pathlib import Path

import pandas as pd

from analysis import ensembles, limits
from analysis.results import Results

SWEEP = "noise-polish"
NAMES = {ensembles.ALONE: "(without)", f"{ensembles.ALONE}+polish=10": "`polish=10`"}
"""How the page calls the approaches."""
MEASURES = {"early": "evaluations 1 to 20", "last": "evaluations 56 to 60", "world": "final controllers in the world"}
_WITHOUT, _POLISHED = NAMES.values()


def evaluations(runs: Path) -> pd.DataFrame:
    """A row an evaluation, as `limits.evaluations`, of the seeds of a task that both have."""
    return _named(limits.evaluations(Results(runs, archived=True), SWEEP))


def drives(path: Path) -> pd.DataFrame:
    """Rows of `analysis.margins` of the final controllers, of the seeds of a task that both have."""
    rows = pd.read_csv(path)
    have = rows.groupby(["task", "seed"]).approach.transform("nunique")
    return _named(rows[have == len(NAMES)])


def _named(rows: pd.DataFrame) -> pd.DataFrame:
    return rows.assign(approach=rows.approach.map(NAMES))


def changes(rows: pd.DataFrame, driven: pd.DataFrame) -> pd.DataFrame:
    """As `ensembles.changes`, in the first and the last evaluations, and of final controllers."""
    return ensembles.changes(rows, driven, {"polish": (_WITHOUT, _POLISHED)}, ("early", "last"))


def changes_in_words(table: pd.DataFrame) -> list[str]:
    """The rows of `changes` as the page shows them, one a measure."""
    return [
        line.replace("| polish |", f"| {name} |")
        for measure, name in MEASURES.items()
        for line in ensembles.changes_in_words(table, measure)
    ]


def main(arguments: Sequence[str] | None = None) -> int:
    """Print the tables."""
    parser = argparse.ArgumentParser(prog="python -m analysis.polishing", description=__doc__.split("\n\n", maxsplit=1)[0])
    parser.add_argument("--runs", type=Path, default=limits.PUBLISHED / f"{SWEEP}.parquet", help="archive of the sweep")
    parser.add_argument("--drives", type=Path, default=limits.PUBLISHED / f"{SWEEP}-drives.csv", help="rows of analysis.margins")
    wanted = parser.parse_args(arguments)
    rows, driven = evaluations(wanted.runs), drives(wanted.drives)
    print(*limits.late_in_words(rows, driven, "{}"), sep="\n")
    print(*changes_in_words(changes(rows, driven)), sep="\n")
    return 0


if __name__ == "__main__":
    raise SystemExit(main())
