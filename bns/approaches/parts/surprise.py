"""When did the robot change? When the networks' prediction errors suddenly rise."""

from __future__ import annotations

import numpy as np

IN_A_ROW = 2
"""So many surprises one after the other are a change: a single one may be a drive through commands that nobody had tried."""
LATEST = 10
"""Errors of so many drives are what is usual."""
FEWEST = 5
"""Before there are so many nothing is usual, and nothing surprises."""


class Surprise:
    """Compares the error of each drive with what is usual."""

    def __init__(self, factor: float) -> None:
        """A drive is a surprise if its error is above ``factor`` times the median of the latest that were none."""
        self._factor, self._usual, self._row = factor, list[float](), 0

    def changed(self, error: float) -> bool:
        """Was this error the last of `IN_A_ROW` surprises? Then what was usual is forgotten."""
        usual = self._usual[-LATEST:]
        if len(usual) < FEWEST or not error > self._factor * float(np.median(usual)):
            self._usual.append(error)
            self._row = 0
            return False
        self._row += 1
        if self._row < IN_A_ROW:
            return False
        self._usual, self._row = [], 0
        return True
