"""A sweep from its runs to its results: what is done is skipped, what finishes is stored, then counted."""

from __future__ import annotations

import warnings
from collections import Counter
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import partial
from pathlib import Path

from bns.errors import SweepWarning
from bns.spec import RunSpec
from bns.store.archive.read import recorded
from bns.store.record import RunRecord
from bns.store.write.writer import Writer
from bns.sweep.budget import Budget
from bns.sweep.expand.digests import WorldDigests
from bns.sweep.expand.grid import Sweep
from bns.sweep.expand.order import ordered_specs
from bns.sweep.expand.shard import Shard
from bns.sweep.interrupt import GRACE_S, Interrupts
from bns.sweep.jobs.executor import Executor, Job
from bns.sweep.jobs.heard import Heard
from bns.sweep.jobs.job import check_world_files, names_a_file, prepare, run_job
from bns.sweep.jobs.workers import LokyExecutor

_POLL_S = 0.2


@dataclass(frozen=True)
class Summary:
    """Where a sweep, or a shard, stands. ``done``, ``failed``, ``quarantined`` include earlier calls, ``new`` does not.

    ``new_failed`` is how many of the new ones failed or were quarantined.

    ``stopped_by`` is None (nothing left to do), "budget", "limit", "interrupt" (Ctrl-C), "terminated"
    (SIGTERM), "submitted" (the rest is queued with a batch system) or "ranking" (what was asked for is known).
    """

    sweep: str
    total: int
    done: int = 0
    failed: int = 0
    quarantined: int = 0
    new: int = 0
    new_failed: int = 0
    stopped_by: str | None = None

    @property
    def remaining(self) -> int:
        """Runs that have no result of any kind."""
        return self.total - self.done - self.failed - self.quarantined


def silent(_summary: Summary) -> None:
    """Progress that nobody wants to see."""


def run_sweep(
    sweep: Sweep,
    results: Path,
    *,
    jobs: int = 1,
    budget: Budget | None = None,
    retry_failed: bool = False,
    limit: int | None = None,
    job: Job = run_job,
    executor: Executor | None = None,
    warm_up: Callable[[], object] | None = None,
    on_progress: Callable[[Summary], None] = silent,
    grace_s: float = GRACE_S,
    shard: Shard | None = None,
) -> Summary:
    """Carry out the runs of a sweep that have no result yet, at most ``limit``.

    With ``retry_failed`` failed and quarantined runs are done again. ``jobs`` is the number of workers
    unless an ``executor`` is given; ``warm_up`` is called once before the first (by default it compiles the
    kernels). ``budget`` can be shared by several calls. After the first SIGINT or SIGTERM, runs in flight may
    finish for ``grace_s`` seconds; the second gives them up. `SweepWarning` if there are results under this
    sweep's name that it does not describe: those of another file of that name. With a ``shard`` only its share is
    done and counted; other shards may be at work at the same time, on other machines that share the folder.

    Raises:
        StoreError: another process writes this sweep (this shard), the disk is full, or the store's runs of this sweep
            come from other world files. What was finished before is kept.
        ModelError: a model file that runs to do name as their world is missing or no such file; nothing is written.
    """
    sweep_run = _SweepRun(sweep, Path(results), budget or Budget(), on_progress, shard)
    if job is run_job and any(names_a_file(str(combo.get("world", ""))) for combo in sweep.combos):
        known = recorded(Path(results), sweep.name)
        check_world_files((spec for spec in ordered_specs(sweep) if spec.run_id not in known), sweep.place_of)
    name = shard.name if shard else ""
    with Interrupts(grace_s) as sweep_run.interrupts:
        try:
            with Writer(
                sweep_run.results, sweep.name, sweep_text=sweep.text, sweep_runs=sweep.described, shard=name
            ) as writer:
                todo = sweep_run.plan(retry_failed, limit)
                if todo and sweep_run.budget.allows_another():
                    (warm_up or (partial(prepare, todo) if job is run_job else lambda: None))()
                    with executor or LokyExecutor(jobs, job) as ready:
                        sweep_run.interrupts.arm(ready.cancel)
                        sweep_run.carry_out(iter(todo), ready, writer)
        except KeyboardInterrupt:
            if sweep_run.interrupts.stopped_by is None:
                raise
        finally:
            sweep_run.heard.sum_up()
    return sweep_run.summary()


class _SweepRun:
    """One call of ``run_sweep``: counts and the loop."""

    def __init__(
        self,
        sweep: Sweep,
        results: Path,
        budget: Budget,
        on_progress: Callable[[Summary], None],
        shard: Shard | None,
    ) -> None:
        self.results, self.budget, self.interrupts = results, budget, Interrupts()
        self._sweep, self._on_progress, self._shard = sweep, on_progress, shard
        self._total = sweep.total
        self._digests = WorldDigests(results, sweep.name)
        self.heard = Heard()
        self._statuses: dict[str, str] = {}
        self._counts: Counter[str] = Counter()
        self._new = self._new_failed = self._submitted = self._todo = self._wanted = 0

    def plan(self, retry_failed: bool, limit: int | None) -> list[RunSpec]:
        """The runs to do, in order; whatever has a result is counted as such."""
        known = recorded(self.results, self._sweep.name)
        if "ok" in known.values():
            self._digests.read()
        skipped = {"ok"} if retry_failed else {"ok", "failed", "quarantined"}
        everything, todo = ordered_specs(self._sweep), []
        own = everything if self._shard is None else self._shard.share(everything)
        self._total = len(own)
        for spec in own:
            status = known.get(spec.run_id) if known else None
            if status is not None:
                self._count(spec.run_id, status)
            if status not in skipped:
                todo.append(spec)
        if len(known) > len(self._statuses) and self._sweep.chosen is None:
            self._warn_of_others(len(known.keys() - {spec.run_id for spec in everything}))
        self._wanted = len(todo)
        todo = todo if limit is None else todo[:limit]
        self._todo = len(todo)
        return todo

    def _warn_of_others(self, others: int) -> None:
        if others:
            warnings.warn(
                f"{self.results} already holds {others} finished runs of a sweep {self._sweep.name!r} that "
                f"{self._sweep.path} does not describe: they are of an earlier file of that name. Figures leave them out from "
                "now on, and say so; `bns query` and archives have both. To draw both files, stop and give the sweep another "
                "name.",
                SweepWarning,
                stacklevel=4,  # the caller of run_sweep
            )

    def carry_out(self, specs: Iterator[RunSpec], executor: Executor, writer: Writer) -> None:
        """Until all runs are stored, the budget is used up or a signal says to stop."""
        self._on_progress(self.summary())
        self._fill(specs, executor)
        while executor.in_flight:
            if self.interrupts.grace_is_over:
                executor.cancel()
            record = executor.next(_POLL_S)
            if record is None:
                continue
            if record.run["status"] == "ok":
                self.budget.add(record.run["wall_s"])
            self._fill(specs, executor)  # first of all: the worker need not wait for the disk
            self._store(record, writer)

    def _fill(self, specs: Iterator[RunSpec], executor: Executor) -> None:
        while executor.free and self.interrupts.stopped_by is None and self._submitted < self._todo:
            if not self.budget.allows_another():
                return
            executor.submit(next(specs))
            self._submitted += 1

    def _store(self, record: RunRecord, writer: Writer) -> None:
        self._digests.check(record)
        writer.append(record)
        self._count(record.spec.run_id, record.run["status"])
        self._new += 1
        self._new_failed += record.run["status"] != "ok"
        self._on_progress(self.summary())
        self.heard.add(record)

    def _count(self, run_id: str, status: str) -> None:
        self._counts.subtract([self._statuses.get(run_id, "none")])
        self._statuses[run_id] = status
        self._counts.update([status])

    def summary(self) -> Summary:
        """The counts now."""
        return Summary(
            self._sweep.name,
            self._total,
            self._counts["ok"],
            self._counts["failed"],
            self._counts["quarantined"],
            self._new,
            self._new_failed,
            self._stopped_by(),
        )

    def _stopped_by(self) -> str | None:
        if self.interrupts.stopped_by is not None:
            return self.interrupts.stopped_by
        if self._new < self._todo:
            return "budget"
        return "limit" if self._todo < self._wanted else None
