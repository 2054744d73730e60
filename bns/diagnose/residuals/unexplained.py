"""What a fitted model leaves unexplained, seen in three ways: along variables, along time, and in moments that stand out.

Each sees faults that the others miss, and each has a least size, since honest robots are not alike from trial to trial either.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from bns.diagnose.estimate.fit import Fit, Problem
from bns.diagnose.residuals.along_variables import Pattern, remaining
from bns.diagnose.residuals.autocorrelation import Rhythm, rhythms
from bns.diagnose.residuals.outliers import Outbreak, outbreaks


@dataclass(frozen=True)
class Unexplained:
    """Patterns and outbreaks that cannot be luck, best and worst first; the loudest rhythm, None if all are soft."""

    patterns: tuple[Pattern, ...]
    rhythm: Rhythm | None
    outbreaks: tuple[Outbreak, ...]

    @property
    def any(self) -> bool:
        """Something is."""
        return bool(self.patterns or self.rhythm or self.outbreaks)


def unexplained(problem: Problem, fit: Fit, seen: Sequence[Pattern]) -> Unexplained:
    """Of the patterns ``seen`` in a fitted model, and of its innovations, what is too large and too certain to be luck."""
    loudest = rhythms(problem, fit)[0]
    return Unexplained(tuple(remaining(list(seen))), loudest if loudest.loud else None, tuple(outbreaks(problem, fit)))
