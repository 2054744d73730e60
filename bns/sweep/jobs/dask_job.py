"""What a Dask worker does with a run."""

from __future__ import annotations

import signal
from dataclasses import replace
from datetime import UTC, datetime
from time import perf_counter

from bns.errors import ClusterError
from bns.extras import extra
from bns.spec import RunSpec
from bns.store.provenance import provenance
from bns.store.record import RunRecord
from bns.sweep.jobs.executor import Job, without_result
from bns.sweep.jobs.heard import listening
from bns.sweep.jobs.job import describe
from bns.sweep.jobs.workers import LEFT_TO_PARENT

with extra("cluster"):
    from distributed import Worker, WorkerPlugin


def carry_out(job: Job, spec: RunSpec, run_id: str) -> RunRecord:
    """The run's record with this machine's provenance.

    Raises:
        ClusterError: this machine's bns would give another run than the one that was asked for.
    """
    if spec.run_id != run_id:
        raise ClusterError(f"run {run_id} is {spec.run_id} here")
    record = _whatever_happens(job, spec)
    return replace(record, run={**record.run, **provenance().columns()})


def _whatever_happens(job: Job, spec: RunSpec) -> RunRecord:
    started_at, began = datetime.now(UTC), perf_counter()
    try:
        return listening(job, spec)
    except BaseException as fault:  # SystemExit too, which would end the worker
        return without_result(spec, "failed", describe(fault), started_at, perf_counter() - began)


class LeavesSignals(WorkerPlugin):
    """Makes a worker of this machine's own cluster ignore Ctrl-C and its like: the process that sweeps decides."""

    name = "bns-leaves-signals"

    def setup(self, worker: Worker) -> None:
        """Called in every worker that begins."""
        for number in LEFT_TO_PARENT:
            signal.signal(number, signal.SIG_IGN)
