"""One writer a sweep: a file lock that the system takes back when its holder dies."""

from __future__ import annotations

import json
import os
import platform
from datetime import UTC, datetime
from pathlib import Path
from types import TracebackType

import filelock

from bns.errors import StoreError
from bns.store.files import JOURNAL, checked_name, explained, gone, is_same, make_folder


class SweepLockedError(StoreError):
    """Another process is writing the sweep."""


class SweepLock:
    """The right to write one sweep of ``results``; a context manager.

    ``journal/<sweep>.lock`` is what is locked; ``<sweep>.lock.json`` says who holds it (pid, host, since).
    """

    def __init__(self, results: Path, sweep: str) -> None:
        self._sweep = checked_name("sweep", sweep)
        self._path = results / JOURNAL / f"{sweep}.lock"
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
            raise gone(self._path, "What was stored before went with it.")

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
        try:
            holder = json.loads(self._holder.read_text())
            who = f"process {holder['pid']} on {holder['host']} since {holder['since']}"
        except (OSError, ValueError, KeyError, TypeError):
            who = "a process that has not said yet which it is"
        return (
            f"sweep {self._sweep!r} is being written by {who} (lock {self._path}). Wait until it is "
            "done or stop it; other sweeps can be written at the same time."
        )


def _myself() -> dict[str, str | int]:
    return {"pid": os.getpid(), "host": platform.node(), "since": datetime.now(UTC).isoformat(timespec="seconds")}
