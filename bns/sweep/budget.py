"""A limit on wall time that several sweeps can share."""

from __future__ import annotations

import time
from collections import deque
from collections.abc import Callable
from statistics import median

_REMEMBERED = 101


class Budget:
    """``seconds`` of wall time from now on; None is no limit.

    A run is only begun if one of median duration would still end within the budget; before any has ended,
    runs are begun as long as there is time at all.
    """

    def __init__(self, seconds: float | None = None, clock: Callable[[], float] = time.monotonic) -> None:
        self._seconds, self._clock, self._begin = seconds, clock, clock()
        self._durations: deque[float] = deque(maxlen=_REMEMBERED)

    def add(self, wall_s: float) -> None:
        """Remember how long a run took."""
        self._durations.append(wall_s)

    @property
    def left_s(self) -> float:
        """Seconds left; infinite without a limit."""
        return float("inf") if self._seconds is None else self._seconds - (self._clock() - self._begin)

    def allows_another(self) -> bool:
        """Whether a run begun now is expected to end in time."""
        expected = median(self._durations) if self._durations else 0.0
        return self.left_s > expected
