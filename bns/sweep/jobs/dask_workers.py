"""Runs as futures of a Dask cluster. Workers, and even the scheduler, may die without harm."""

from __future__ import annotations

import time
import uuid
import warnings
from collections.abc import Callable
from dataclasses import dataclass, field
from datetime import UTC, datetime
from queue import Empty, SimpleQueue
from typing import Self

from bns.errors import ClusterError
from bns.extras import extra
from bns.spec import RunSpec
from bns.store.record import RunRecord
from bns.sweep.jobs.dask_job import carry_out
from bns.sweep.jobs.dask_link import PATIENCE_S, DaskLink
from bns.sweep.jobs.executor import Job, attempted, without_result
from bns.sweep.jobs.job import run_job

with extra("cluster"):
    from distributed import Future, KilledWorker

_FETCH_S = 30.0
_PAUSE_S = 0.2


class DaskWarning(UserWarning):
    """A cluster works, but not as well as it could."""


@dataclass
class _Flight:
    """A run that was submitted and not given back."""

    spec: RunSpec
    future: Future | None = None
    keys: list[str] = field(default_factory=list)
    started_at: datetime = field(default_factory=lambda: datetime.now(UTC))
    started_s: float = field(default_factory=time.perf_counter)


class DaskExecutor:
    """The workers of the scheduler at ``scheduler``, or ``workers`` processes of this machine's own.

    The scheduler itself begins a run anew whose worker died; after its number of ``allowed-failures`` the run is
    given back with status ``quarantined``. When the scheduler goes away the runs in flight are submitted anew as
    soon as it is back. A record comes from the worker with that machine's provenance.
    """

    def __init__(
        self, scheduler: str | None = None, workers: int = 1, job: Job = run_job, patience_s: float = PATIENCE_S
    ) -> None:
        self._job, self._link = job, DaskLink(scheduler, workers, patience_s)
        self._flights: dict[str, _Flight] = {}
        self._ended: SimpleQueue[str] = SimpleQueue()
        self._cancelled = False

    def __enter__(self) -> Self:
        try:
            self._link.open()
            _advise(self._link.threads_by_worker())
        except BaseException:
            self._link.close([])
            raise
        return self

    def __exit__(self, *exc: object) -> None:
        self._link.close([flight.future for flight in self._flights.values() if flight.future is not None])
        self._flights = {}

    @property
    def free(self) -> int:
        """Idle threads of all workers. While there is no worker at all one run may wait for the first."""
        return 0 if self._cancelled else max(0, self._link.slots - len(self._flights))

    @property
    def in_flight(self) -> int:
        """Runs submitted and not given back."""
        return 0 if self._cancelled else len(self._flights)

    def submit(self, spec: RunSpec) -> None:
        """Hand the run to the scheduler."""
        self._flights[spec.run_id] = _Flight(spec)
        if self._link.is_up():
            self._begin(self._flights[spec.run_id])

    def next(self, timeout_s: float) -> RunRecord | None:
        """A finished, failed or quarantined run; None after ``timeout_s`` or when something must be begun anew.

        Raises:
            ClusterError: the scheduler stays away, or the workers do not have this bns.
        """
        if self._cancelled or not self._link.is_up():
            time.sleep(min(timeout_s, _PAUSE_S))
            return None
        for flight in self._flights.values():
            if flight.future is None or flight.future.status == "cancelled":
                self._begin(flight)
        try:
            flight = self._flights[self._ended.get(timeout=timeout_s)]
        except (Empty, KeyError):  # the latter: a run of which the end was noted twice
            return None
        return self._landed(flight)

    def cancel(self) -> None:
        """Give up what is in flight. A worker elsewhere still ends the run that it is at; nobody waits for it."""
        self._cancelled = True  # no more: a signal handler must not touch locks that this thread may hold

    def _begin(self, flight: _Flight) -> None:
        # One prefix for all: from it the scheduler knows how long a run takes, and gives queued ones to idle workers.
        key = f"bns_run-{uuid.uuid4().hex}"
        flight.keys.append(key)
        run_id = flight.spec.run_id
        flight.future = self._link.submit(carry_out, self._job, flight.spec, run_id, key=key)
        flight.future.add_done_callback(self._noting(run_id))

    def _noting(self, run_id: str) -> Callable[[Future], None]:
        return lambda _future: self._ended.put(run_id)

    def _landed(self, flight: _Flight) -> RunRecord | None:
        assert flight.future is not None  # only futures are noted
        if flight.future.status in {"cancelled", "pending"}:  # the note was of an earlier future
            return None
        try:
            record = flight.future.result(timeout=_FETCH_S)
            deaths = sum(self._link.deaths[key] for key in flight.keys)  # also of workers that died while it was fetched
        except KilledWorker as fault:
            deaths, record = fault.allowed_failures, self._quarantined(flight, fault)
        except TimeoutError:  # its worker died with the result: the scheduler does the run again
            flight.future.add_done_callback(self._noting(flight.spec.run_id))
            return None
        except Exception as fault:
            if not self._link.is_up() or flight.future.status == "cancelled":
                return None
            raise _unfit(self._link.address, fault) from fault
        del self._flights[flight.spec.run_id]
        return attempted(record, 1 + deaths)

    def _quarantined(self, flight: _Flight, fault: KilledWorker) -> RunRecord:
        error = (
            f"the worker process died in each of {fault.allowed_failures + 1} attempts, the last time that at "
            f"{fault.last_worker.address}. If its log says nothing it was killed from outside, most often for want of "
            "memory: use fewer workers a machine."
        )
        wall_s = time.perf_counter() - flight.started_s
        return without_result(flight.spec, "quarantined", error, flight.started_at, wall_s)


def _advise(threads: dict[str, int]) -> None:
    several = [worker for worker, count in threads.items() if count > 1]
    if several:
        warnings.warn(
            f"{len(several)} Dask workers have more than one thread ({several[0]} has {threads[several[0]]}): runs in "
            "one process slow each other down, and their processor times are mixed. Start them with --nthreads 1.",
            DaskWarning,
            stacklevel=3,
        )


def _unfit(address: str | None, fault: Exception) -> ClusterError:
    what = " ".join(str(fault).split()) or type(fault).__name__
    return ClusterError(
        f"a worker of the Dask scheduler at {address} could not carry out a run: {what}. The same bns, with the same "
        "engine version, must be installed on this machine, the scheduler's and the workers'. What was finished is "
        "stored; the same command continues from here."
    )
