"""Ctrl-C and SIGTERM while a sweep runs: finish what is in flight, or at the second signal give it up."""

from __future__ import annotations

import signal
import threading
import time
from collections.abc import Callable
from types import FrameType
from typing import Any, Self

GRACE_S = 20.0
_NAMES = {signal.SIGINT: "interrupt", signal.SIGTERM: "terminated"}


class Interrupts:
    """Takes SIGINT and SIGTERM over while it is open and puts the former handlers back.

    Until ``arm`` is called a signal raises KeyboardInterrupt, because nothing in flight could be lost.
    Once armed, the first signal is only noted (``stopped_by``), the second calls what ``arm`` was given.
    In a thread other than the main one no signal arrives, and nothing is taken over.
    """

    def __init__(self, grace_s: float = GRACE_S) -> None:
        self.stopped_by: str | None = None
        self._grace_s, self._since = grace_s, 0.0
        self._former: dict[signal.Signals, Any] = {}
        self._cancel: Callable[[], None] | None = None

    def __enter__(self) -> Self:
        if threading.current_thread() is threading.main_thread():
            self._former = {number: signal.signal(number, self._handle) for number in _NAMES}
        return self

    def __exit__(self, *exc: object) -> None:
        for number, handler in self._former.items():
            signal.signal(number, handler)

    def arm(self, cancel: Callable[[], None]) -> None:
        """From now on runs are in flight; ``cancel`` gives them up."""
        self._cancel = cancel

    @property
    def grace_is_over(self) -> bool:
        """Whether runs in flight have had their time to finish after the first signal."""
        return self.stopped_by is not None and time.monotonic() - self._since > self._grace_s

    def _handle(self, number: int, _frame: FrameType | None) -> None:
        first = self.stopped_by is None
        if first:
            self.stopped_by, self._since = _NAMES[signal.Signals(number)], time.monotonic()
        if self._cancel is None:
            raise KeyboardInterrupt
        if not first:
            self._cancel()
