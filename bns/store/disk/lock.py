"""One writer a sweep, or one a shard of it: file locks that the system takes back when their holder dies."""

from __future__ import annotations

import json
import os
import platform
from datetime import UTC, datetime
from pathlib import Path
from types import TracebackType

import filelock

from bns.errors import StoreError
from bns.store.disk.files import JOURNAL, checked_name, explained, gone, is_same, make_folder
from bns.store.disk.shared import SharedLock


class SweepLockedError(StoreError):
    """Another process is writing the sweep."""


class SweepLock:
    """The right to write one sweep of ``results``, or one ``shard`` of it; a context manager.

    ``journal/<sweep>.lock`` (``<sweep>.shard-<shard>.lock``) is what is locked; ``….lock.json`` says who holds it
    (pid, host, since).
    """

    def __init__(self, results: Path, sweep: str, shard: str = "") -> None:
        self._sweep, self._shard = checked_name("sweep", sweep), shard
        name = f"{sweep}.shard-{shard}.lock" if shard else f"{sweep}.lock"
        self._path = results / JOURNAL / name
        self._holder = self._path.with_name(f"{self._path.name}.json")
        # Not bound to a thread: a sweep may append from another one than it began in.
        self._taken_file: os.stat_result | None = None
        self._lock = filelock.FileLock(self._path, timeout=0, thread_local=False)

    def acquire(self) -> None:
        """Take the lock at once; SweepLockedError naming the process that has it otherwise."""
        make_folder(self._path.parent)
        with explained("lock", self._path):
            try:
                self._lock.acquire()
            except filelock.Timeout as error:
                raise SweepLockedError(self._taken()) from error
            except NotImplementedError as error:
                raise StoreError(
                    f"cannot lock {self._path}: this file system has no file locks. "
                    "Choose a folder on a local disk with --results DIR."
                ) from error
        try:
            with explained("write", self._holder):
                self._holder.write_text(json.dumps(_myself()))
                self._taken_file = self._path.stat()
        except StoreError:
            self._lock.release()
            raise

    def check(self) -> None:
        """StoreError if the lock was taken and its file is gone: then the results are gone too, or elsewhere."""
        if self._taken_file is not None and not is_same(self._path, self._taken_file):
            raise gone(self._path, "The results stored before are gone with it.")

    def release(self) -> None:
        """Give the lock back; without effect if it is not held."""
        self._taken_file = None
        self._lock.release()

    def __enter__(self) -> SweepLock:
        self.acquire()
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.release()

    def _taken(self) -> str:
        what = f"shard {self._shard} of sweep {self._sweep!r}" if self._shard else f"sweep {self._sweep!r}"
        return (
            f"{what} is being written by {self._who()} (lock {self._path}). Wait until it is "
            "done or stop it; other sweeps can be written at the same time."
        )

    def _who(self) -> str:
        if not self._shard and SharedLock(self._path).is_free:
            return f"shards of it: see {self._path.with_name(f'{self._sweep}.shard-*.lock.json')}"
        try:
            holder = json.loads(self._holder.read_text())
            return f"process {holder['pid']} on {holder['host']} since {holder['since']}"
        except (OSError, ValueError, KeyError, TypeError):
            return "a process that has not said yet which it is"


class ShardLock:
    """The right to write one shard while others write theirs, and nobody writes or compacts the whole sweep.

    Where the file system has no locks, as some of clusters, it warns and goes on: a shard touches no file but
    those that it made itself, so that locks only save work that would be done twice.
    """

    def __init__(self, results: Path, sweep: str, shard: str) -> None:
        self._shared = SharedLock(results / JOURNAL / f"{checked_name('sweep', sweep)}.lock")
        self._whole, self._own = SweepLock(results, sweep), SweepLock(results, sweep, shard)

    def acquire(self) -> None:
        """Take both locks at once; SweepLockedError naming the process that is in the way otherwise."""
        if not self._shared.acquire():
            raise SweepLockedError(self._whole._taken())
        try:
            if self._shared.is_supported:
                self._own.acquire()
        except BaseException:
            self._shared.release()
            raise

    def check(self) -> None:
        """StoreError if the results were taken away since."""
        self._own.check()

    def release(self) -> None:
        """Give both back; without effect if they are not held."""
        self._own.release()
        self._shared.release()


def _myself() -> dict[str, str | int]:
    return {"pid": os.getpid(), "host": platform.node(), "since": datetime.now(UTC).isoformat(timespec="seconds")}
