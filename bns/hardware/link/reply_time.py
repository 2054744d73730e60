"""How long an answer is waited for: as TCP times its retransmissions (RFC 6298), from the round trips measured on this link.

A smoothed round trip and its mean deviation follow the link; what is asked again is waited for twice as long each time
(section 5.5), and a round trip counts only if nothing was asked twice (Karn's rule, section 3). RFC 6298 waits at least a second,
for the sake of other people's traffic; on a line of one's own that is `least_s`.
"""

from __future__ import annotations

from collections import deque
from dataclasses import dataclass

_ALPHA, _BETA, _K = 1 / 8, 1 / 4, 4
"""Section 2.3 of RFC 6298."""
_REMEMBERED = 50
GRANULARITY_S = 0.01
"""A port is looked at so often."""


@dataclass(frozen=True)
class ReplyLimits:
    """Seconds: until the first answer ever, the shortest time-out, the longest that a question may take with its repeats."""

    first_s: float = 1.0
    least_s: float = 0.03
    most_s: float = 0.8


class ReplyTime:
    """The time-out of a link. `smoothed_s` and `deviation_s` are SRTT and RTTVAR."""

    def __init__(self, limits: ReplyLimits | None = None) -> None:
        self.limits = limits or ReplyLimits()
        self.smoothed_s: float | None = None
        self.deviation_s = 0.0
        self._last: deque[float] = deque(maxlen=_REMEMBERED)

    def measured(self, trip_s: float) -> None:
        """Take in a round trip (equations 2.2 and 2.3)."""
        self._last.append(trip_s)
        if self.smoothed_s is None:
            self.smoothed_s, self.deviation_s = trip_s, trip_s / 2.0
            return
        self.deviation_s += _BETA * (abs(self.smoothed_s - trip_s) - self.deviation_s)
        self.smoothed_s += _ALPHA * (trip_s - self.smoothed_s)

    @property
    def quickest_s(self) -> float:
        """The shortest of the last trips; 0 before the first."""
        return min(self._last, default=0.0)

    @property
    def timeout_s(self) -> float:
        """How long to wait for an answer to a question that is asked for the first time."""
        if self.smoothed_s is None:
            return self.limits.first_s
        wait_s = self.smoothed_s + max(GRANULARITY_S, _K * self.deviation_s)
        return min(max(wait_s, self.limits.least_s), self.limits.most_s)

    @property
    def patience_s(self) -> float:
        """How long one question may take with all its repeats."""
        return self.limits.most_s if self.smoothed_s is not None else max(4.0 * self.limits.first_s, self.limits.most_s)
