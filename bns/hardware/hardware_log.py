"""The hardware log: everything sent, received and observed in a trial, one JSON line each, with time stamps.

A trial is resumed from it, or replayed. Its file is `journal.jsonl` in the folder of the trial. Each line has a number and a
checksum (`bns.hardware.sealed_lines`).

`t_s` is the trial's clock, `wall_s` the computer's (seconds since 1970). A line that a kill cut in two is dropped when the
file is opened again; evaluations are synced to the disk before the next one begins.
"""

from __future__ import annotations

import json
import os
import time
from collections.abc import Callable, Iterator, Mapping
from pathlib import Path
from typing import Any, Self, TextIO

from bns.errors import HardwareError
from bns.hardware.clock import Clock
from bns.hardware.sealed_lines import Seals, checked_lines


class HardwareLog:
    """An open log of one trial; events are appended. Without a path nothing is kept."""

    def __init__(self, path: Path | None, clock: Clock) -> None:
        self._clock = clock
        self._file: TextIO | None = None
        self.listeners: list[Callable[[str, Mapping[str, Any]], None]] = []
        """Told the kind and content of every event."""
        if path is not None:
            path.parent.mkdir(parents=True, exist_ok=True)
            self._seals = Seals(_drop_torn_line(path))
            self._file = path.open("a", encoding="utf-8")

    def note(self, kind: str, **what: Any) -> None:
        """Append one event."""
        for listener in self.listeners:
            listener(kind, what)
        if self._file is not None:
            event = {"t_s": round(self._clock.now_s(), 6), "wall_s": round(time.time(), 6), "kind": kind, **what}
            self._file.write(self._seals.line(json.dumps(event, separators=(",", ":"), allow_nan=False)))

    def sync(self) -> None:
        """What was noted so far survives a loss of power."""
        if self._file is not None:
            self._file.flush()
            os.fsync(self._file.fileno())

    def close(self) -> None:
        """Sync and close."""
        self.sync()
        if self._file is not None:
            self._file.close()
            self._file = None

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_error: object) -> None:
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
