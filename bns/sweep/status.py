"""How far the sweeps in a store are."""

from __future__ import annotations

from dataclasses import dataclass
from datetime import datetime
from pathlib import Path

import pandas as pd

from bns.errors import SpecError
from bns.store.reader import load
from bns.sweep.grid import parse_sweep


@dataclass(frozen=True)
class SweepRow:
    """One sweep and task. ``total`` is None without a known sweep file; ``last``: when the last run began."""

    sweep: str
    task: str
    done: int
    failed: int
    quarantined: int
    total: int | None
    last: datetime
    mean_wall_s: float

    @property
    def remaining(self) -> int | None:
        """Runs without any result; None where the total is not known."""
        return None if self.total is None else max(0, self.total - self.done - self.failed - self.quarantined)


def sweep_status(results: Path) -> list[SweepRow]:
    """A row for every sweep and task with results, in alphabetic order; StoreError if there are none at all.

    ``mean_wall_s`` is the mean of the runs that are ok, NaN without any.
    """
    runs = load(results, "runs", columns=["sweep", "task", "status", "started_at", "wall_s"])
    totals = _totals(load(results, "specs", columns=["sweep", "written_at", "text"]))
    groups = runs.groupby(["sweep", "task"])
    return [_row(str(sweep), str(task), group, totals) for (sweep, task), group in groups]


def _row(sweep: str, task: str, runs: pd.DataFrame, totals: dict[tuple[str, str], int]) -> SweepRow:
    counts = runs["status"].value_counts()
    done, failed, quarantined = (int(counts.get(status, 0)) for status in ("ok", "failed", "quarantined"))
    last: pd.Timestamp = runs["started_at"].max()
    return SweepRow(
        sweep,
        task,
        done,
        failed,
        quarantined,
        totals.get((sweep, task)),
        last.to_pydatetime(),
        float(runs.loc[runs["status"] == "ok", "wall_s"].mean()),
    )


def _totals(specs: pd.DataFrame) -> dict[tuple[str, str], int]:
    """Runs by sweep and task, from the latest sweep file of each sweep."""
    totals: dict[tuple[str, str], int] = {}
    for sweep, group in specs.sort_values("written_at").groupby("sweep"):
        try:
            described = parse_sweep(group["text"].iloc[-1], Path(f"{sweep}.yaml"))
        except SpecError:
            continue  # written by another version: how many runs there should be is not known
        totals |= {(str(sweep), task): runs for task, runs in described.runs_by_task().items()}
    return totals
