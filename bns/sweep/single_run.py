"""One run outside a sweep's runner, kept in the store like any other."""

from __future__ import annotations

import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager
from datetime import datetime
from pathlib import Path

from bns.bootstrap.loop import RunResult
from bns.spec import RunSpec
from bns.store.disk.lock import SweepLockedError
from bns.store.read.reader import finished
from bns.store.record import RunRecord
from bns.store.write.writer import Writer
from bns.sweep.expand.digests import WorldDigests
from bns.sweep.jobs import memory

_PATIENCE_S = 60.0


def keep_run(
    spec: RunSpec,
    result: RunResult,
    results: Path,
    sweep: str,
    started: datetime,
    wall_s: float,
    cpu_s: float = float("nan"),
    device: str = "cpu",
) -> None:
    """Put a run that ended well into the store."""
    row = {
        "status": "ok",
        "error": None,
        "world_digest": result.world_digest,
        "started_at": started,
        "wall_s": wall_s,
        "cpu_s": cpu_s,
        "peak_memory_mib": memory.peak_mib(),
        "attempts": 1,
    }
    if device != "cpu":
        from bns.sweep.jobs.batches import gpu_columns  # noqa: PLC0415  # as below

        row |= gpu_columns()
    with patient_writer(results, sweep) as writer:
        writer.append(RunRecord(spec, row, result.tables))


def check_keepable(spec: RunSpec, results: Path, sweep: str, digest: str) -> None:
    """StoreError if a run in the world of this digest cannot be kept there: better found before the run than after it."""
    with patient_writer(results, sweep):
        if finished(results, sweep):
            digests = WorldDigests(results, sweep)
            digests.read()
            digests.compare(spec.task, spec.world, digest)


@contextmanager
def patient_writer(results: Path, sweep: str) -> Iterator[Writer]:
    """Runs by hand share one sweep's name; each holds its lock for an instant only."""
    deadline = time.monotonic() + _PATIENCE_S
    while True:
        writer = Writer(results, sweep)
        try:
            writer.__enter__()
            break
        except SweepLockedError:
            if time.monotonic() > deadline:
                raise
            time.sleep(0.1)
    try:
        yield writer
    finally:
        writer.__exit__(*sys.exc_info())
