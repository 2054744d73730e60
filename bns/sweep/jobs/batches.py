"""Runs carried out in batches on a GPU, behind the interface of any other executor."""

from __future__ import annotations

import json
import time
import warnings
from collections import deque
from collections.abc import Callable, Sequence
from datetime import UTC, datetime
from typing import Any, Protocol, Self

import numpy as np

from bns.cuda.batch import Batch
from bns.cuda.device import OutOfDeviceMemoryError, device_name
from bns.robots import load_robot
from bns.spec import RunSpec
from bns.store.provenance import provenance, version
from bns.store.record import RunRecord
from bns.sweep.jobs import memory
from bns.sweep.jobs.executor import without_result
from bns.sweep.jobs.job import describe
from bns.worlds import build_world

FIRST, LARGEST = 256, 4096
"""Runs of the first batch, which shows how fast the GPU is, and of any."""
BATCH_S = 60.0
"""What a batch should take: so much is lost at most when the sweep is killed."""
_GROWTH = 4


class DeviceWarning(UserWarning):
    """A sweep goes on, but not as the GPU could do it."""


class Steps(Protocol):
    """What is asked of a batch (`bns.cuda.batch.Batch`)."""

    @property
    def done(self) -> bool: ...  # noqa: D102

    def step(self) -> None: ...  # noqa: D102

    def evals(self) -> list[dict[str, np.ndarray] | ArithmeticError]: ...  # noqa: D102


class BatchExecutor:
    """Takes runs until a batch is full, carries all of them out side by side in this process, gives them back in order.

    The first batch is small; later ones are as large as fits into `BATCH_S`, and into ``left_s()``, the time that is left. Where
    the memory is full a batch is begun anew with half of its runs. A run whose numbers are not finite fails alone.
    """

    def __init__(
        self,
        left_s: Callable[[], float] = lambda: float("inf"),
        make: Callable[[Sequence[RunSpec]], Steps] = Batch,
        first: int = FIRST,
        largest: int = LARGEST,
    ) -> None:
        self._left_s, self._make, self._size, self._largest = left_s, make, min(first, largest), largest
        self._waiting: deque[RunSpec] = deque()
        self._ended: deque[RunRecord] = deque()
        self._specs: list[RunSpec] = []
        self._batch: Steps | None = None
        self._cancelled = False

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *exc: object) -> None:
        self._batch = None  # and with it its memory

    @property
    def free(self) -> int:
        """Runs that the next batch still takes; none while one is under way."""
        return 0 if self._cancelled or self._specs else max(0, self._size - len(self._waiting))

    @property
    def in_flight(self) -> int:
        """Runs that wait, are under way or are not given back yet."""
        return 0 if self._cancelled else len(self._waiting) + len(self._specs) + len(self._ended)

    def submit(self, spec: RunSpec) -> None:
        """Keep the run for the next batch."""
        self._waiting.append(spec)

    def next(self, timeout_s: float) -> RunRecord | None:
        """A run of the batch that is done; None while one is under way, after ``timeout_s`` and the evaluation then begun."""
        if self._ended:
            return self._ended.popleft()
        until = time.monotonic() + timeout_s
        try:
            if not self._specs:
                self._begin()
            while self._batch is not None and not self._cancelled:
                if self._batch.done:
                    self._land(self._batch)
                    return self._ended.popleft()
                self._batch.step()
                if time.monotonic() > until:
                    break
        except OutOfDeviceMemoryError as error:
            self._halve(error)
        return None

    def cancel(self) -> None:
        """Give up what is in flight; the evaluation that the GPU is at ends first."""
        self._cancelled = True

    def _begin(self) -> None:
        self._specs = [self._waiting.popleft() for _ in range(min(self._size, len(self._waiting)))]
        self._started_at, self._began, self._began_cpu = datetime.now(UTC), time.perf_counter(), time.process_time()
        memory.reset_peak()
        if self._specs:
            self._batch = self._make(self._specs)

    def _land(self, batch: Steps) -> None:
        evals = batch.evals()
        wall_s, cpu_s = time.perf_counter() - self._began, time.process_time() - self._began_cpu
        row = {
            "status": "ok",
            "error": None,
            "started_at": self._started_at,
            "wall_s": wall_s,
            "cpu_s": cpu_s / len(self._specs),
            "peak_memory_mib": memory.peak_mib(),
            "attempts": 1,
            "world_digest": build_world(self._specs[0].world, load_robot(self._specs[0].robot)).digest,
        } | gpu_columns()
        for spec, columns in zip(self._specs, evals, strict=True):
            if isinstance(columns, ArithmeticError):
                self._ended.append(without_result(spec, "failed", describe(columns), self._started_at, wall_s))
            else:
                self._ended.append(RunRecord(spec, row, {"evals": columns}))
        self._resize(len(self._specs), wall_s)
        self._batch, self._specs = None, []

    def _resize(self, runs: int, wall_s: float) -> None:
        fitting = int(runs * min(BATCH_S, max(0.0, self._left_s())) / max(wall_s, 1e-9))
        if runs == self._size or fitting < self._size:  # a batch that was not full says little about larger ones
            self._size = max(1, min(fitting, _GROWTH * runs, self._largest))

    def _halve(self, error: OutOfDeviceMemoryError) -> None:
        self._batch, runs = None, len(self._specs)
        if runs > 1:
            self._size = self._largest = runs // 2
            self._waiting.extendleft(reversed(self._specs))
            warnings.warn(
                f"{runs} runs side by side do not fit into the GPU's memory ({error}); going on with {self._size}",
                DeviceWarning,
                stacklevel=3,
            )
        else:
            text = f"not even this run alone fits into the GPU's memory ({error}); do it on the CPU"
            wall_s = time.perf_counter() - self._began
            self._ended.extend(without_result(spec, "failed", text, self._started_at, wall_s) for spec in self._specs)
        self._specs = []


def gpu_columns() -> dict[str, Any]:
    """Provenance of a run that this machine's GPU carried out: as any other's, with the GPU among the versions."""
    columns = provenance().columns()
    versions = json.loads(columns["versions"]) | {"device": device_name(), "numba-cuda": version("numba-cuda")}
    return columns | {"versions": json.dumps(versions, sort_keys=True)}
