"""A bar on stderr while a sweep runs; nothing where stderr is a file."""

from __future__ import annotations

import sys
import time
from typing import Self, TextIO

from rich.console import Console
from rich.progress import BarColumn, MofNCompleteColumn, Progress, TaskID, TextColumn

from bns.sweep.runner import Summary


class SweepProgress:
    """Shows the summaries it is called with: bar, done/total, runs a minute, time to go, failures."""

    def __init__(self, stream: TextIO | None = None) -> None:
        stream = stream or sys.stderr
        self._bar = Progress(
            TextColumn("{task.description}"),
            BarColumn(),
            MofNCompleteColumn(),
            TextColumn("{task.fields[rate]}"),
            console=Console(file=stream),
            transient=False,
            disable=not stream.isatty(),
        )
        self._tasks: dict[str, tuple[TaskID, float]] = {}

    def __enter__(self) -> Self:
        self._bar.start()
        return self

    def __exit__(self, *exc: object) -> None:
        self._bar.stop()

    def __call__(self, summary: Summary) -> None:
        """Show where the sweep stands; several sweeps have a bar each."""
        if summary.sweep not in self._tasks:
            number = self._bar.add_task(summary.sweep, total=summary.total, rate="")
            self._tasks[summary.sweep] = number, time.monotonic()
        number, begin = self._tasks[summary.sweep]
        self._bar.update(
            number, completed=summary.total - summary.remaining, rate=describe_rate(summary, time.monotonic() - begin)
        )


def describe_rate(summary: Summary, elapsed_s: float) -> str:
    """``31.2/min, 0:42:10 to go, 2 failed``: rate of this call, time for what remains, runs that failed."""
    lost = summary.failed + summary.quarantined
    parts = [f"{lost} failed"] if lost else []
    if summary.new and elapsed_s > 0:
        parts = [
            f"{60 * summary.new / elapsed_s:.1f}/min",
            f"{in_words(summary.remaining * elapsed_s / summary.new)} to go",
            *parts,
        ]
    return ", ".join(parts)


def in_words(seconds: float) -> str:
    """Hours, minutes and seconds as h:mm:ss."""
    minutes, rest = divmod(round(seconds), 60)
    hours, minutes = divmod(minutes, 60)
    return f"{hours}:{minutes:02d}:{rest:02d}"
