"""A diagnosis at work in the background: what it is looking at, how long it has taken, and a way to stop it."""

from __future__ import annotations

import threading
import time

from bns.api.diagnose import DiagnoseResult, diagnose
from bns.api.measurements import Log
from bns.api.model import Given
from bns.errors import BnsError


class _StoppedError(Exception):
    """Raised where the diagnosis tells what it is doing, when nobody wants to know any more."""


class Background:
    """``result`` once it is there; ``why`` it failed ("" if it did not)."""

    def __init__(self, result: DiagnoseResult | None = None) -> None:
        self.result, self.why = result, ""
        self._doing, self._looked_at, self._began = "", 0, 0.0
        self._asked_to_stop = threading.Event()
        self._thread: threading.Thread | None = None

    @property
    def at_work(self) -> bool:
        """Is it still going on?"""
        return self._thread is not None and self._thread.is_alive()

    @property
    def progress(self) -> str:
        """What is being done, in words. How much is left nobody knows before the data have been seen."""
        if not self.at_work:
            return ""
        taken = time.monotonic() - self._began
        return f"diagnosing for {taken:.0f} s: {self._doing or 'begins'} (fit {self._looked_at})"

    def start(self, log: Log, model: Given) -> None:
        """Begin; nothing where it is at work already."""
        if self.at_work:
            return
        self.result, self.why, self._looked_at, self._began = None, "", 0, time.monotonic()
        self._asked_to_stop.clear()
        self._thread = threading.Thread(target=self._work, args=(log, model), name="bns-diagnosis", daemon=True)
        self._thread.start()

    def stop(self) -> None:
        """Ask it to end; it does at its next fit."""
        self._asked_to_stop.set()

    def wait(self, timeout_s: float) -> None:
        """Until it has ended."""
        if self._thread is not None:
            self._thread.join(timeout_s)

    def _work(self, log: Log, model: Given) -> None:
        try:
            self.result = diagnose(log, model, progress=self._tick)
        except _StoppedError:
            self.why = "stopped"
        except BnsError as fault:
            self.why = str(fault)

    def _tick(self, _share: float | None, text: str) -> None:
        if self._asked_to_stop.is_set():
            raise _StoppedError
        self._doing = text
        self._looked_at += 1
