"""Finds the guard process that holds a serial port, for error messages: a guard may run for hours after its trial."""

from __future__ import annotations

import os
from collections.abc import Iterator, Sequence
from contextlib import suppress
from pathlib import Path

CODE = "import sys; sys.path.append(sys.argv[1]); from guard.process import main; main()"
"""What a guard's process runs: this folder as a package by itself, found after the standard library. It is known by this."""


def holder_text(port: str, processes: Path = Path("/proc")) -> str:
    """Which guard holds the port, whose trial it is or was, and what to do; "" if none is found (or there is no /proc)."""
    guards = dict(_guards(processes))
    for folder, trial in guards.items():
        with suppress(OSError, ValueError):  # it has ended, or is somebody else's
            if _has_open(folder, os.path.realpath(port)):
                return _in_words(port, folder, trial, [other.name for other, of in guards.items() if of == trial])
    return ""


def _guards(processes: Path) -> Iterator[tuple[Path, str]]:
    """Folders of all guards' processes, those that stand by too, each with the process of its trial."""
    for folder in processes.glob("[0-9]*"):
        with suppress(OSError, ValueError):
            words = (folder / "cmdline").read_bytes().decode(errors="replace").split("\0")
            if CODE in words:
                yield folder, words[words.index(CODE) + 2]


def _has_open(folder: Path, port: str) -> bool:
    return any(os.path.realpath(file) == port for file in (folder / "fd").iterdir())


def _in_words(port: str, folder: Path, trial: str, guards: Sequence[str]) -> str:
    """A guard whose trial is gone has another parent. All ``guards`` of it have to be ended: one would take over from another."""
    status = (folder / "status").read_text(encoding="utf-8", errors="replace")
    parent = next(line.split()[1] for line in status.splitlines() if line.startswith("PPid:"))
    if parent == trial:
        return f"{port} is in use by another trial (process {trial}; its guard is process {folder.name}). End that trial first."
    return (
        f"{port} is in use by the guard (process {folder.name}) of a trial that has ended without a confirmed stop: it goes on "
        f"trying to stop the robot. Cut its power; then end the guard: kill -9 {' '.join(sorted(guards, key=int))} "
        "(docs/trials.md, After exit 4)."
    )
