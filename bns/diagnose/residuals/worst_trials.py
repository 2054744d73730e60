"""Trials that are unlike the rest as a whole: somebody pushed the robot, a wheel was loose, the tracker held something else.

A robust loss bounds what one frame does, not what a whole trial does; a few bad trials widen the noise that is estimated and
hide what all others show. They stand out by their mean loss a frame, compared with how that varies among trials.
The worst of them can hide the next: so they are looked for again without them. If they are then more than a few, the robot
does so at times, and they count.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from bns.diagnose.data.robust import robust_sd
from bns.diagnose.estimate.fit import Fit
from bns.diagnose.estimate.fitting import Problem
from bns.diagnose.estimate.noise import huber
from bns.diagnose.residuals.outliers import WIDTH, Outlier, moment_at
from bns.diagnose.settings import DEFAULTS

SHARE = DEFAULTS.residuals.worst_share
FAR = DEFAULTS.residuals.worst_far
ONCE = DEFAULTS.report.once_share


@dataclass(frozen=True)
class Apart:
    """How a trial is unlike the rest: how large its loss is, and whether it comes from one moment."""

    trial: str
    times: float
    """Its mean loss per pose, divided by that of the median trial."""
    share: float
    """The part of the excess that comes from the worst moment."""
    moment: Outlier | None
    """None in a trial that is too short for one."""
    jumped: bool
    """Was the tracker seen to jump there?"""

    @property
    def once(self) -> bool:
        """Is it one moment that makes the trial unlike the rest?"""
        return self.moment is not None and self.share >= ONCE

    @property
    def in_words(self) -> str:
        """All of it in a clause."""
        begun = f"{self.times:.2g} times the loss per pose of the median trial"
        if self.moment is None or not self.once:
            return f"{begun}, spread over the trial"
        jumps = ", where the tracker jumps" if self.jumped else ""
        return f"{begun}, {min(self.share, 1.0):.0%} of the excess from one moment{jumps}: {self.moment.when}"


@dataclass(frozen=True)
class WithoutWorst:
    """The verdict and effects of two diagnoses: with these trials, and without them; and which of the two is presented."""

    trials: tuple[str, ...]
    with_them: tuple[str, tuple[str, ...]]
    without: tuple[str, tuple[str, ...]]
    apart: tuple[Apart, ...] = ()
    """What is known of these trials."""

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


def apart(problem: Problem, fit: Fit, trials: Sequence[int]) -> Iterator[Apart]:
    """What a fit in which all trials count says of some of them."""
    tracks = problem.predictor.tracks
    loss, jumped = huber(fit.whitened).reshape(len(fit.whitened), -1).sum(axis=1), tracks.jumped
    mean = [float(loss[a:b].mean()) if b > a else 0.0 for a, b in zip(tracks.first[:-1], tracks.first[1:], strict=True)]
    usual = float(np.median(mean))
    for trial in trials:
        begin, end = (int(frame) for frame in tracks.first[trial : trial + 2])
        name, times = tracks.names[trial], mean[trial] / max(usual, 1e-12)
        excess = np.concatenate([[0.0], np.cumsum(loss[begin:end] - usual)])
        windows = excess[1 + WIDTH :] - excess[1:-WIDTH]
        if not len(windows) or excess[-1] <= 0.0:
            yield Apart(name, times, 0.0, None, False)
            continue
        start = begin + 1 + int(windows.argmax())
        moment = moment_at(problem, fit, start, float(windows.max()))
        jumps = jumped is not None and bool(jumped[start : start + WIDTH].any())
        yield Apart(name, times, float(windows.max() / excess[-1]), moment, jumps)
