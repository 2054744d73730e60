"""What a sweep needs of the thing that carries out its runs, and the simplest such thing: this process."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from datetime import datetime
from typing import Protocol, Self

from bns.spec import RunSpec
from bns.store.record import RunRecord
from bns.sweep.jobs.job import run_job

Job = Callable[[RunSpec], RunRecord]

ATTEMPTS = 3
"""How often a run is tried whose worker dies, before it is quarantined."""


class Executor(Protocol):
    """Takes runs and gives back records, in any order. Workers live as long as its context is open."""

    def __enter__(self) -> Self:
        """Get ready."""

    def __exit__(self, *exc: object) -> None:
        """End the workers; what is still in flight is lost."""

    @property
    def free(self) -> int:
        """How many runs can be submitted now."""

    @property
    def in_flight(self) -> int:
        """How many runs are submitted and not given back."""

    def submit(self, spec: RunSpec) -> None:
        """Begin a run; there must be a free slot."""

    def next(self, timeout_s: float) -> RunRecord | None:
        """A finished run, or None if none finishes within the time."""

    def cancel(self) -> None:
        """Give up what is in flight; called from signal handlers. Afterwards nothing is in flight."""


class _Cancelled(BaseException):
    """Leaves a run in this process from within a signal handler; no job may catch it."""


class SerialExecutor:
    """One run at a time in this process, for debugging: a breakpoint works, a crash takes the sweep along."""

    def __init__(self, job: Job = run_job) -> None:
        self._job, self._running = job, False
        self._spec: RunSpec | None = None

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *exc: object) -> None:
        self._spec = None

    @property
    def free(self) -> int:
        """1 or 0."""
        return int(self._spec is None)

    @property
    def in_flight(self) -> int:
        """1 or 0."""
        return int(self._spec is not None)

    def submit(self, spec: RunSpec) -> None:
        """Keep the run for ``next``."""
        self._spec = spec

    def next(self, timeout_s: float) -> RunRecord | None:
        """Carry the run out; it takes what it takes, whatever the timeout."""
        if self._spec is None:
            return None
        self._running = True
        try:
            return attempted(self._job(self._spec), 1)
        except _Cancelled:
            return None
        finally:
            self._running, self._spec = False, None

    def cancel(self) -> None:
        """Leave the run at the next Python instruction."""
        if self._running:
            raise _Cancelled
        self._spec = None


def without_result(spec: RunSpec, status: str, error: str, started_at: datetime, wall_s: float) -> RunRecord:
    """The record of a run whose worker gave none. The processor time went with the worker."""
    return RunRecord(
        spec,
        {
            "status": status,
            "error": error,
            "started_at": started_at,
            "wall_s": wall_s,
            "cpu_s": float("nan"),
            "attempts": 1,
        },
    )


def attempted(record: RunRecord, attempts: int) -> RunRecord:
    """The record with the number of times the run was begun."""
    return replace(record, run={**record.run, "attempts": attempts})
