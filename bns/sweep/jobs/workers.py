"""Worker processes that may die without harm.

Each slot is a pool of its own with one worker. A worker that is killed (segmentation fault, out of memory)
breaks its whole pool, and this way its pool is nothing but its own run.
"""

from __future__ import annotations

import ctypes
import os
import re
import signal
import sys
import threading
import time
from concurrent.futures import FIRST_COMPLETED, BrokenExecutor, Future, wait
from dataclasses import dataclass, field
from datetime import UTC, datetime
from functools import partial
from typing import Self

from joblib.externals.loky import ProcessPoolExecutor

from bns.spec import RunSpec
from bns.store.record import RunRecord
from bns.sweep.jobs.executor import ATTEMPTS, Job, attempted, without_result
from bns.sweep.jobs.heard import listening
from bns.sweep.jobs.job import describe, run_job
from bns.sweep.jobs.trackers import without_complaints

_ONE_THREAD = dict.fromkeys(
    (
        "OMP_NUM_THREADS",
        "MKL_NUM_THREADS",
        "OPENBLAS_NUM_THREADS",
        "BLIS_NUM_THREADS",
        "VECLIB_MAXIMUM_THREADS",
        "NUMEXPR_NUM_THREADS",
        "NUMBA_NUM_THREADS",
    ),
    "1",
)
_NAMES = ("SIGINT", "SIGTERM", "SIGUSR1", "SIGUSR2")  # the last two are not there on Windows
LEFT_TO_PARENT = tuple(getattr(signal, name) for name in _NAMES if hasattr(signal, name))
"""Terminals send the first to all of a process group, batch systems the others to all processes of a job."""

_PARENT_CHECK_S = 1.0
_BEGIN_S = 2.0


@dataclass
class _Slot:
    """One worker process and the run it has."""

    pool: ProcessPoolExecutor | None = None
    spec: RunSpec | None = None
    future: Future[RunRecord] | None = None
    attempt: int = 0
    started_at: datetime = field(default_factory=lambda: datetime.now(UTC))
    started_s: float = 0.0

    @property
    def wall_s(self) -> float:
        """Time since the run was first begun."""
        return time.perf_counter() - self.started_s


class LokyExecutor:
    """``jobs`` worker processes with one thread each. They ignore Ctrl-C and SIGTERM (the parent decides).

    A run whose worker dies is tried again in a new worker, at most ``ATTEMPTS`` times, and then given back
    with status ``quarantined``. Workers end with their parent, even if it is killed.
    """

    def __init__(self, jobs: int, job: Job = run_job) -> None:
        if jobs < 1:
            raise ValueError(f"jobs is {jobs}; it must be at least 1.")
        self._job, self._slots, self._cancelled = job, [_Slot() for _ in range(jobs)], False

    def __enter__(self) -> Self:
        without_complaints()
        return self

    def __exit__(self, *exc: object) -> None:
        for slot in self._slots:
            if slot.pool is not None:
                _await_begin(slot.future)
                slot.pool.shutdown(wait=True, kill_workers=True)
        self._slots = [_Slot() for _ in self._slots]

    @property
    def free(self) -> int:
        """Idle workers."""
        return 0 if self._cancelled else sum(slot.spec is None for slot in self._slots)

    @property
    def in_flight(self) -> int:
        """Busy workers."""
        return 0 if self._cancelled else sum(slot.spec is not None for slot in self._slots)

    def submit(self, spec: RunSpec) -> None:
        """Hand the run to an idle worker; the first run of a slot starts its process."""
        slot = next(slot for slot in self._slots if slot.spec is None)
        slot.spec, slot.attempt, slot.started_at = spec, 0, datetime.now(UTC)
        slot.started_s = time.perf_counter()
        self._begin(slot, spec)

    def next(self, timeout_s: float) -> RunRecord | None:
        """A finished, failed or quarantined run; None after ``timeout_s`` or when a run is tried again."""
        if self._cancelled:
            return None
        busy = {slot.future: slot for slot in self._slots if slot.future is not None}
        done, _ = wait(busy, timeout_s, FIRST_COMPLETED)
        for future in done:
            record = self._outcome(busy[future], future)
            if record is not None:
                return record
        return None

    def cancel(self) -> None:
        """Give up what is in flight; the workers are killed on leaving the context."""
        self._cancelled = True  # no more: a signal handler must not touch locks that this thread may hold

    def _begin(self, slot: _Slot, spec: RunSpec) -> None:
        slot.attempt += 1
        job = partial(listening, self._job) if slot.attempt == 1 else self._job
        try:
            slot.future = self._pool(slot).submit(job, spec)
        except BrokenExecutor:  # the worker died while it was idle: no run is to blame
            slot.pool = None
            slot.future = self._pool(slot).submit(job, spec)

    def _pool(self, slot: _Slot) -> ProcessPoolExecutor:
        if slot.pool is None:
            slot.pool = ProcessPoolExecutor(
                max_workers=1, initializer=start_worker, initargs=(os.getpid(),), env=_ONE_THREAD
            )
        return slot.pool

    def _outcome(self, slot: _Slot, future: Future[RunRecord]) -> RunRecord | None:
        spec, fault = slot.spec, future.exception()
        assert spec is not None  # a slot with a future has a run
        if isinstance(fault, BrokenExecutor):
            slot.pool = None
            if slot.attempt < ATTEMPTS:
                self._begin(slot, spec)
                return None
            record = without_result(spec, "quarantined", _death(fault), slot.started_at, slot.wall_s)
        elif fault is not None:
            record = without_result(spec, "failed", describe(fault), slot.started_at, slot.wall_s)
        else:
            record = future.result()
        record = attempted(record, slot.attempt)
        slot.spec, slot.future = None, None
        return record


def _await_begin(future: Future[RunRecord] | None) -> None:
    """Until loky has taken the run from its queue: a shutdown before that is a KeyError in its own thread."""
    patience = time.monotonic() + _BEGIN_S
    while future is not None and not (future.running() or future.done()) and time.monotonic() < patience:
        time.sleep(0.001)


def _death(fault: BaseException) -> str:
    codes = re.search(r"exit codes of the workers are \{(.*?)\}", str(fault))
    how = codes.group(1) if codes else " ".join(str(fault).split())
    hint = " Killed from outside, most often for want of memory: use fewer jobs." if "SIGKILL" in how else ""
    return f"the worker process died in each of {ATTEMPTS} attempts: {how}.{hint}"


def start_worker(parent: int) -> None:
    """First thing in a worker: leave signals to the parent, and end when the parent does."""
    for number in LEFT_TO_PARENT:
        signal.signal(number, signal.SIG_IGN)
    if sys.platform == "linux":
        ctypes.CDLL(None, use_errno=True).prctl(1, signal.SIGKILL)  # PR_SET_PDEATHSIG
    threading.Thread(target=_end_with, args=(parent,), daemon=True).start()


def _end_with(parent: int) -> None:
    """Covers other systems, and a parent that died before ``prctl`` was called."""
    while os.getppid() == parent:
        time.sleep(_PARENT_CHECK_S)
    os._exit(1)
