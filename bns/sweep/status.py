"""How far the sweeps in a store are."""

from __future__ import annotations

import json
from dataclasses import dataclass
from datetime import datetime
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from bns.errors import SpecError
from bns.spec import RunSpec
from bns.store.archive.read import connect_archives, stored_archives
from bns.store.read.reader import finished, load
from bns.store.read.snapshot import snapshot
from bns.sweep.expand.grid import Sweep, parse_stored

if TYPE_CHECKING:  # a third of a second to load, and a sweep needs no table
    import pandas as pd

_COLUMNS = ["sweep", "task", "status", "started_at", "wall_s", "spec"]


@dataclass(frozen=True)
class SweepRow:
    """One sweep and task. ``total`` is None without a known sweep file; ``last``: when the last run began, None before any.

    Only runs that the newest sweep file of that name describes are done, failed or quarantined; ``other`` are
    all the rest, those of an earlier file or an earlier engine. Without a known file there are none. ``archived``: how many of
    the runs lie in archives in the folder ``archived`` of the results; a sweep does not repeat them, so they count as the others.
    """

    sweep: str
    task: str
    done: int
    failed: int
    quarantined: int
    total: int | None
    last: datetime | None
    mean_wall_s: float
    other: int = 0
    archived: int = 0

    @property
    def remaining(self) -> int | None:
        """Runs without any result; None where the total is not known."""
        return None if self.total is None else max(0, self.total - self.done - self.failed - self.quarantined)


def sweep_status(results: Path) -> list[SweepRow]:
    """A row for every sweep and task with results or a sweep file, in alphabetic order; StoreError if there is nothing at all.

    ``mean_wall_s`` is the mean of the runs that are done, NaN without any.
    """
    if stored_archives(results) and snapshot(results).is_empty:
        runs, files = _only_archived(results), {}
    else:
        runs = _with_archived(results, _that_count(results, load(results, "runs", columns=["run_id", *_COLUMNS])))
        files = _newest_files(load(results, "specs", columns=["sweep", "written_at", "text"]))
    return [row for name in sorted({*runs["sweep"], *files}) for row in _rows(name, runs[runs["sweep"] == name], files)]


def _that_count(results: Path, runs: pd.DataFrame) -> pd.DataFrame:
    """``runs`` without those that are ok and have lost rows: the sweep does them again."""
    known = {name: finished(results, str(name)) for name in runs["sweep"].unique()}
    whole = [run in known[sweep] for run, sweep in zip(runs["run_id"], runs["sweep"], strict=True)]
    return runs.loc[np.array(whole, bool)]  # an empty list would choose no columns


def _with_archived(results: Path, runs: pd.DataFrame) -> pd.DataFrame:
    """``runs`` and those that only archives have; with a column ``archived``."""
    import pandas as pd  # noqa: PLC0415  # as above

    runs = runs.assign(archived=False)
    if not stored_archives(results):
        return runs
    both = pd.concat([runs, _only_archived(results)], ignore_index=True)  # those of the store come first
    return both.drop_duplicates(["sweep", "run_id"]).reset_index(drop=True)


def _only_archived(results: Path) -> pd.DataFrame:
    """The runs of all archives; when they began, and how long they took, is not kept there."""
    import pandas as pd  # noqa: PLC0415  # as above

    with connect_archives(stored_archives(results)) as connection:
        kept = connection.execute("SELECT run_id, sweep, task, status, spec FROM runs").df()
    return kept.assign(started_at=pd.Series(dtype="datetime64[us, UTC]"), wall_s=float("nan"), archived=True)


def _rows(name: str, runs: pd.DataFrame, files: dict[str, Sweep]) -> list[SweepRow]:
    """Of one sweep; ``runs``: those of its name."""
    file = files.get(name)
    described = runs["sweep"] == name if file is None else _described(file, runs["spec"])
    totals = {} if file is None else file.runs_by_task()
    return [
        _row(name, task, group, described[group.index], None if file is None else totals.get(task, 0))
        for task in sorted({*runs["task"], *totals})
        for group in [runs[runs["task"] == task]]
    ]


def _row(sweep: str, task: str, runs: pd.DataFrame, described: pd.Series[bool], total: int | None) -> SweepRow:
    import pandas as pd  # noqa: PLC0415  # as above

    own = runs[described]
    counts = own["status"].value_counts()
    last = runs["started_at"].max()
    done, failed, quarantined = (int(counts.get(status, 0)) for status in ("ok", "failed", "quarantined"))
    return SweepRow(
        sweep,
        task,
        done,
        failed,
        quarantined,
        total,
        None if pd.isna(last) else last.to_pydatetime(),
        float(own.loc[own["status"] == "ok", "wall_s"].mean()),
        len(runs) - len(own),
        int(runs["archived"].sum()),
    )


def _described(file: Sweep, specs: pd.Series[str]) -> pd.Series[bool]:
    """Which runs the file describes: combination by combination, for a file may have millions of seeds."""
    combos = {RunSpec(robot=file.robot, **combo).canonical_json() for combo in file.combos}
    return specs.map(lambda text: _is_one_of(combos, file.all_seeds, text)).astype(bool)


def _is_one_of(combos: set[str], seeds: range, text: str) -> bool:
    spec = json.loads(text)
    first = json.dumps(spec | {"seed": 0}, sort_keys=True, separators=(",", ":"))
    return spec["seed"] in seeds and first in combos


def _newest_files(specs: pd.DataFrame) -> dict[str, Sweep]:
    """The latest sweep file of every sweep that has one."""
    files = {}
    for name, group in specs.sort_values("written_at").groupby("sweep"):
        try:
            files[str(name)] = parse_stored(group["text"].iloc[-1], str(name))
        except SpecError:
            continue  # written by another version: what it describes is not known
    return files
