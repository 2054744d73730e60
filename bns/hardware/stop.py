"""What came of a stop."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class Stop:
    """Whether the robot itself confirmed that it stands still, after how many seconds, and if not, why.

    `acknowledged_s`: when it took the order (None: never).
    """

    confirmed: bool
    seconds: float
    acknowledged_s: float | None = None
    problem: str = ""
