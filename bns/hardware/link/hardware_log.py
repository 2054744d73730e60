"""The hardware log: everything sent, received and observed in a trial, one JSON line each, with time stamps.

A trial is resumed from it, or replayed. Its file is `journal.jsonl` in the folder of the trial. Each line has a number and a
checksum (`bns.hardware.link.sealed_lines`).

`t_s` is the trial's clock, `wall_s` the computer's (seconds since 1970). A line that a kill cut in two is dropped when the
file is opened again; evaluations are synced to the disk before the next one begins.

A log that was deleted meanwhile is written again from what the open file holds, and counts as a fault: else a trial would go on
and keep nothing.

A log that cannot be written does not raise where something is noted: a driver that is stopping its robot notes things too,
and must not take a full disk for a lost link. The fault is kept, nothing more is written (what stands is whole but for its last
line), and `check` and `sync` raise it.
"""

from __future__ import annotations

import errno
import json
import os
import time
from collections.abc import Callable, Iterator, Mapping
from contextlib import suppress
from pathlib import Path
from typing import Any, Self

from bns.errors import HardwareError, TrialFileError
from bns.hardware.clock import Clock
from bns.hardware.link.sealed_lines import Seals, checked_lines

_HELD, _HELD_S = 1 << 13, 0.1
"""Bytes that are kept back before they are written, and for how long at most: whether the disk takes them is known only then."""
_HANGS_S = 0.5
"""A disk that takes so long hangs: a network folder whose server is away, a stick that is full or failing."""


class HardwareLog:
    """An open log of one trial; events are appended. Without a path nothing is kept."""

    def __init__(self, path: Path | None, clock: Clock) -> None:
        self._clock, self._path = clock, path
        self._descriptor: int | None = None
        self._held, self._written_s = bytearray(), 0.0
        self._fault: OSError | None = None
        self.held_up_s = 0.0
        """How long the disk has held up whoever notes something, in all: a robot that is stopped meanwhile is not to blame."""
        self.listeners: list[Callable[[str, Mapping[str, Any]], None]] = []
        """Told the kind and content of every event."""
        if path is not None:
            path.parent.mkdir(parents=True, exist_ok=True)
            self._seals = Seals(_drop_torn_line(path))
            self._descriptor = os.open(path, os.O_RDWR | os.O_CREAT | os.O_APPEND, 0o666)

    def note(self, kind: str, **what: Any) -> None:
        """Append one event; never raises because of the file."""
        for listener in self.listeners:
            listener(kind, what)
        if self._descriptor is not None and self._fault is None:
            event = {"t_s": round(self._clock.now_s(), 6), "wall_s": round(time.time(), 6), "kind": kind, **what}
            self._held += self._seals.line(json.dumps(event, separators=(",", ":"), allow_nan=False)).encode()
            if len(self._held) > _HELD or event["t_s"] - self._written_s > _HELD_S:
                self._written_s = event["t_s"]
                self._write()

    def check(self) -> None:
        """TrialFileError if something that was noted could not be written."""
        if self._fault is not None:
            raise TrialFileError.of(str(self._path), self._fault) from self._fault

    def sync(self) -> None:
        """What was noted so far survives a loss of power; TrialFileError."""
        if self._descriptor is not None and self._fault is None:
            self._write(durably=True)
        self.check()

    def close(self) -> None:
        """Sync and close; TrialFileError, once it is closed."""
        if self._descriptor is None:
            return
        try:
            self.sync()
        finally:
            os.close(self._descriptor)
            self._descriptor = None

    def _write(self, durably: bool = False) -> None:
        """Write what is held back; a fault is kept."""
        assert self._descriptor is not None
        began_s = time.monotonic()
        try:
            rest = memoryview(bytes(self._held))
            while rest:
                rest = rest[os.write(self._descriptor, rest) :]
            if durably:
                os.fsync(self._descriptor)
                if os.fstat(self._descriptor).st_nlink == 0:
                    self._put_back(self._descriptor)
        except OSError as error:
            self._fault = error
        self._held.clear()
        took_s = time.monotonic() - began_s
        self.held_up_s += took_s if took_s > _HANGS_S else 0.0

    def _put_back(self, lost: int) -> None:
        """Write a log again that was deleted while it is open; raises an OSError that says so in any case."""
        assert self._path is not None
        data = os.pread(lost, os.fstat(lost).st_size, 0)
        self._path.parent.mkdir(parents=True, exist_ok=True)
        with self._path.open("xb") as again:
            again.write(data)
            again.flush()
            os.fsync(again.fileno())
        raise OSError(errno.ENOENT, "it was deleted while the trial ran, and was written again with all that it held")

    def __enter__(self) -> Self:
        return self

    def __exit__(self, kind: type[BaseException] | None, *_error: object) -> None:
        if kind is None:
            self.close()
            return
        with suppress(TrialFileError):  # what is under way says more than that the log has failed, too
            self.close()


def events(path: Path, *kinds: str) -> Iterator[dict[str, Any]]:
    """Events of a journal, all or of some kinds, in order; HardwareError if it is none, or not as it was written.

    A last line without an end is passed over: it was being written when the computer stopped.
    """
    try:
        data = path.read_bytes()
    except OSError as error:
        raise HardwareError(f"cannot read the journal {path}: {error}. Name the journal.jsonl of a trial.") from error
    for number, line in enumerate(checked_lines(path, data), 1):
        event = _parsed(path, number, line)
        if not kinds or event["kind"] in kinds:
            yield event


def _parsed(path: Path, number: int, line: str) -> dict[str, Any]:
    try:
        event = json.loads(line)
        event["kind"], event["t_s"]
    except (ValueError, KeyError, TypeError) as error:
        raise HardwareError(
            f"line {number} of {path} is no event of a trial: {line[:60]!r}. Name the journal.jsonl of a trial, unedited."
        ) from error
    return dict(event)


def _drop_torn_line(path: Path) -> bytes:
    """Cut off a line that has no end; what is left."""
    if not path.exists():
        return b""
    data = path.read_bytes()
    end = data.rfind(b"\n") + 1
    if end < len(data):
        os.truncate(path, end)
    return data[:end]
