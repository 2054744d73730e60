"""Work that takes long, beside the page: what it is doing, its share, the time left, and a way to stop it."""

from __future__ import annotations

import threading
import time
from collections.abc import Callable
from typing import Generic, TypeVar

from bns.errors import BnsError

T = TypeVar("T")
Tell = Callable[[float | None, str], None]
"""Told the share that is done (None: unknown) and what is being done."""
_FIRST_SHARE = 0.02
"""Below it the time left is a guess of little worth, and is not shown."""


class _StoppedError(Exception):
    """Raised where the work tells what it is doing, when the user has asked it to stop."""


class Background(Generic[T]):
    """``result`` once it is there; ``why`` it failed ("" if it did not)."""

    def __init__(self, result: T | None = None) -> None:
        self.result, self.why = result, ""
        self._what, self._doing, self._began = "", "", 0.0
        self._share: float | None = None
        self._asked_to_stop = threading.Event()
        self._thread: threading.Thread | None = None

    @property
    def at_work(self) -> bool:
        """Is it still going on?"""
        return self._thread is not None and self._thread.is_alive()

    @property
    def progress(self) -> str:
        """What is being done, in words, with the share and the time left where they are known."""
        if not self.at_work:
            return ""
        taken = time.monotonic() - self._began
        text = f"{self._what} for {taken:.0f} s: {self._doing or 'begins'}"
        if self._share is None:
            return text
        left = taken / self._share * (1 - self._share) if self._share >= _FIRST_SHARE else None
        return f"{text}; {self._share:.0%} done" + (f", about {left:.0f} s left" if left is not None else "")

    def start(self, what: str, work: Callable[[Tell], T]) -> None:
        """Begin ``work``, which is called ``what``; nothing where it is at work already."""
        if self.at_work:
            return
        self.result, self.why, self._doing, self._share = None, "", "", None
        self._what, self._began = what, time.monotonic()
        self._asked_to_stop.clear()
        self._thread = threading.Thread(target=self._work, args=(work,), name=f"bns-{what}", daemon=True)
        self._thread.start()

    def stop(self) -> None:
        """Ask it to end; it does the next time it tells how far it is."""
        self._asked_to_stop.set()

    def wait(self, timeout_s: float) -> None:
        """Until it has ended."""
        if self._thread is not None:
            self._thread.join(timeout_s)

    def _work(self, work: Callable[[Tell], T]) -> None:
        try:
            self.result = work(self._tell)
        except _StoppedError:
            self.why = "stopped"
        except BnsError as fault:
            self.why = str(fault)
        except Exception as fault:
            self.why = f"Internal error: {type(fault).__name__}: {fault}"
            raise

    def _tell(self, share: float | None, text: str) -> None:
        if self._asked_to_stop.is_set():
            raise _StoppedError
        self._share, self._doing = share, text
