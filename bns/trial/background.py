"""Training and evolution while the robot drives."""

from __future__ import annotations

import threading
import time
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from typing import Self


class Rounds:
    """Repeats one round of work in a thread until it is told that it is enough; whole rounds only, so that they can be repeated.

    `waited_s` adds up how long the robot stood waiting for the last round, by the computer's clock.
    """

    def __init__(self, work: Callable[[], None], most: int) -> None:
        self._work, self._most = work, most
        self._pool = ThreadPoolExecutor(1, "training")
        self._enough = threading.Event()
        self.waited_s = 0.0

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_error: object) -> None:
        self._enough.set()
        self._pool.shutdown()

    def while_driving(self, drive: Callable[[], None]) -> int:
        """Call `drive` here and go on with rounds there; how many were done, one at least. A fault there is raised after it."""
        self._enough.clear()
        rounds = self._pool.submit(self._repeat)
        try:
            drive()
        finally:
            self._enough.set()
        began = time.perf_counter()
        count = rounds.result()
        self.waited_s += time.perf_counter() - began
        return count

    def repeat(self, times: int) -> None:
        """As many rounds, now."""
        for _ in range(times):
            self._work()

    def _repeat(self) -> int:
        count = 0
        while count == 0 or (count < self._most and not self._enough.is_set()):
            self._work()
            count += 1
        return count
