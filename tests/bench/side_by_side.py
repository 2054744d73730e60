"""How much slower a job gets when the same job runs beside it: one worker and two, by turns, so that a machine which
others use as well is compared with itself."""

from __future__ import annotations

import time
from collections.abc import Iterator
from contextlib import ExitStack
from datetime import UTC, datetime
from statistics import median

import numpy as np

from bns.engine.philox import Key
from bns.engine.rprop import Rprop
from bns.engine.snn import initial_weights
from bns.spec import RunSpec
from bns.store.record import RunRecord
from bns.sweep.jobs.executor import Job
from bns.sweep.jobs.job import run_job, warm
from bns.sweep.jobs.workers import LokyExecutor

JOBS = 2
PATTERNS, ITERATIONS = 400, 20_000


def plain(_spec: RunSpec) -> RunRecord:
    """A job that does nothing but compute, within the first-level cache: as much as two cores can ever give."""
    warm()
    rng = np.random.default_rng(0)
    X, y = rng.uniform(-1, 1, (5, PATTERNS)).astype(np.float32), rng.uniform(-1, 1, (1, PATTERNS)).astype(np.float32)
    rule = Rprop.start(initial_weights(Key(0, 0), 1, 20), "rprop+")
    began, at = time.perf_counter(), datetime.now(UTC)
    rule.train(X, y, PATTERNS, ITERATIONS)
    wall_s = time.perf_counter() - began
    return RunRecord(_spec, {"status": "ok", "started_at": at, "wall_s": wall_s, "cpu_s": wall_s, "attempts": 1})


class Pair:
    """Two workers of a sweep that are told what to do by turns; `slower` has one figure a round."""

    def __init__(self, job: Job, stack: ExitStack) -> None:
        self._executor = stack.enter_context(LokyExecutor(JOBS, job))
        self.slower: list[float] = []

    def round(self, spec: RunSpec, alone_first: bool) -> None:
        """This run alone, and beside itself; in either order, so that a machine that tires favours neither."""
        walls = {count: self._walls(spec, count) for count in ((1, JOBS) if alone_first else (JOBS, 1))}
        self.slower.append(float(np.mean(walls[JOBS]) / walls[1][0]))

    def warm_up(self, spec: RunSpec) -> None:
        """Start both workers and load their kernels."""
        self._walls(spec, JOBS)

    def _walls(self, spec: RunSpec, count: int) -> list[float]:
        for _ in range(count):
            self._executor.submit(spec)
        return [record.run["wall_s"] for record in self._finished()]

    def _finished(self) -> Iterator[RunRecord]:
        while self._executor.in_flight:
            record = self._executor.next(1.0)
            if record is not None:
                if record.run["status"] != "ok":
                    raise RuntimeError(f"a run of the bench failed, so its times say nothing: {record.run['error']}")
                yield record


def slowdowns(evaluations: int, rounds: int) -> tuple[float, float]:
    """Median over rounds of how many times longer a run, and plain computing, take beside another of its kind."""
    with ExitStack() as stack:
        runs, bare = Pair(run_job, stack), Pair(plain, stack)
        for pair in (runs, bare):
            pair.warm_up(RunSpec(evaluations=2))
        for number in range(rounds):
            for pair in (runs, bare):
                pair.round(RunSpec(evaluations=evaluations, seed=number), number % 2 == 0)
        return median(runs.slower), median(bare.slower)
