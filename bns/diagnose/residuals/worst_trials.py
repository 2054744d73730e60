"""Trials that are unlike the rest as a whole: somebody pushed the robot, a wheel was loose, the tracker held something else.

A robust loss bounds what one frame does, not what a whole trial does; a few bad trials widen the noise that is estimated and
hide what all others show. They stand out by their mean loss a frame, compared with how that varies among trials.
The worst of them can hide the next: so they are looked for again without them. If they are then more than a few, the robot
does so at times, and they count.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from bns.diagnose.data.tracking_noise import robust_sd
from bns.diagnose.estimate.fit import Fit, Problem
from bns.diagnose.settings import DEFAULTS

SHARE = DEFAULTS.residuals.worst_share
FAR = DEFAULTS.residuals.worst_far


@dataclass(frozen=True)
class WithoutWorst:
    """The verdict and effects of two diagnoses: with these trials, and without them; and which of the two is presented."""

    trials: tuple[str, ...]
    with_them: tuple[str, tuple[str, ...]]
    without: tuple[str, tuple[str, ...]]

    @property
    def same(self) -> bool:
        """Do both say the same?"""
        return (self.with_them[0], set(self.with_them[1])) == (self.without[0], set(self.without[1]))


def most_left_out(trials: int) -> int:
    """So many trials are the worst `SHARE`, at least one."""
    return int(np.ceil(SHARE * trials))


def standing_out(problem: Problem, fit: Fit) -> NDArray[np.int64]:
    """Trials that are far worse predicted than the rest, the worst first; none where they are more than the worst `SHARE`."""
    wild = far_off(problem, fit)
    return wild if len(wild) <= most_left_out(len(fit.losses)) else wild[:0]


def far_off(problem: Problem, fit: Fit) -> NDArray[np.int64]:
    """All trials that are far worse predicted than the rest, the worst first; what does not count in the fit has no loss."""
    frames = np.diff(problem.predictor.tracks.first)
    usual = np.log(np.maximum(fit.held_out / np.maximum(frames, 1), 1e-12))
    off = usual - np.median(usual)
    spread = max(float(robust_sd(off)), 1.0 / np.sqrt(float(np.median(frames))))
    order = np.argsort(-off)
    return np.asarray(order[off[order] > FAR * spread])
