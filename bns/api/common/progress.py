"""How far a piece of work of unknown length has come: a share from 0 to 1 that never falls, and what is being done."""

from __future__ import annotations

import threading
from collections.abc import Callable, Mapping

Progress = Callable[[float | None, str], None]
"""Called as work goes on: the share that is done (0 to 1; None where nobody can know), and what is being done."""


def silent(_share: float | None, _text: str) -> None:
    """Progress that nobody wants to see."""


def part(progress: Progress | None, begins: float, ends: float) -> Progress:
    """The progress of one part of some work, which lasts from one share of it to another."""
    told = progress or silent
    return lambda share, text: told(None if share is None else begins + (ends - begins) * share, text)


class Meter:
    """Makes shares of texts alone.

    A text among ``phases`` says that the work has come so far. Any other is one of about ``pace`` small steps of the phase under
    way: each takes the same fraction of what is left of the phase, so a search that lasts longer than most slows down and never
    goes back. May be called from several threads.
    """

    def __init__(self, progress: Progress | None, phases: Mapping[str, float], pace: float) -> None:
        self._told, self._phases, self._pace = progress or silent, dict(phases), max(pace, 1.0)
        self._share, self._lock = 0.0, threading.Lock()

    def __call__(self, text: str) -> None:
        """One step."""
        with self._lock:
            if text in self._phases:
                self._share = max(self._share, self._phases[text])
            else:
                ends = min((at for at in self._phases.values() if at > self._share), default=1.0)
                self._share += (ends - self._share) / self._pace
            self._told(self._share, text)

    def done(self, text: str = "done") -> None:
        """All of it."""
        with self._lock:
            self._share = 1.0
            self._told(1.0, text)
