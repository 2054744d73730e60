"""How much of what was planned a figure shows, in words."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from analysis.labels import counted
from analysis.results import Results, among, planned_runs
from analysis.selection import failures, finished, of_newest_files
from bns.store.schema import PARAMETERS


@dataclass(frozen=True)
class Coverage:
    """How much of what was planned is there, in words; ``missing`` says the same of what is not."""

    amount: str
    missing: tuple[str, ...]

    @property
    def sentences(self) -> tuple[str, ...]:
        """All of it, the amount first."""
        return self.amount, *(text for text in self.missing if text != self.amount)


def coverage(store: Results, sweeps: Sequence[str], n: int | None = None) -> Coverage:
    """What there is of ``sweeps``: ``n`` runs, of those that their files ask for.

    By default ``n`` is all finished runs of those sweeps that have a file; runs by hand have none.
    """
    plans = {sweep: store.plans[sweep] for sweep in sweeps if sweep in store.plans}
    whole, there = (
        finished(store, list(plans)),
        _finished_cells(store, [name for name, plan in plans.items() if plan.cells]),
    )
    n = whole if n is None else n
    planned, cells = planned_runs(plans.values()), sum(plan.cells for plan in plans.values())
    amount, missing = counted(n, "run"), []
    if n < planned:
        amount = f"{n:,} of {planned:,} runs"
        if whole < planned:
            amount += " so far"
            missing.append(amount)
    if there < cells:
        missing.append(f"{cells - there:,} of {counted(cells, 'combination')} without a finished run")
    if failed := failures(store, sweeps):
        missing.append(f"{counted(failed, 'failed run')} not shown")
    return Coverage(amount, tuple(missing))


def _finished_cells(store: Results, sweeps: Sequence[str]) -> int:
    return int(
        store.query(f"""SELECT count(*) AS n FROM (SELECT DISTINCT sweep, task, evaluations,
        {", ".join(name for name in PARAMETERS if name != "seed")}
        FROM runs WHERE status = 'ok' AND {among("sweep", sweeps)} AND {of_newest_files(store)})""").n[0]
    )
