"""Do commands take effect when the log says, each as late as the others? Lost packets and controllers that poll scatter them.

Each change of command is shifted a little, which shows along which direction the innovations after it answer; how far they lie
in that direction says how late this one command was. A delay, a lag, or a limit that the model lacks makes all of them late, by
times that depend on the change (how large it is, of which wheel, whether it is a turn, reverses or stops, how soon it follows):
that is taken out, and where mostly the large changes are late, their size is the cause and nothing scatters. What is left is
compared with the same direction later in the same command, where nothing changes: errors of a tracker and of the model are as
large there. Delays that follow something that is logged, such as the place, are a rule and no scatter (`delays_follow`).
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np

from bns.diagnose.data.tracks import Array, Tracks
from bns.diagnose.estimate.fit import Fit
from bns.diagnose.estimate.fitting import Problem
from bns.diagnose.estimate.noise import huber, weights
from bns.diagnose.predict.wheels import WheelPredictor
from bns.diagnose.residuals.delays_follow import Changes, DelayRule, delay_rule
from bns.diagnose.settings import DEFAULTS
from bns.physics.signals import CREEP_M_S

SHIFT_S = DEFAULTS.residuals.command_shift_s
WINDOW_S = DEFAULTS.residuals.command_window_s
FARTHEST_S, SHIFTS, HALVINGS = DEFAULTS.residuals.command_shifts
FEWEST = DEFAULTS.residuals.command_fewest
TIMES_USUAL = DEFAULTS.residuals.command_times_usual
SMALLER, ALIKE = DEFAULTS.residuals.command_sizes_alike
WELL_KNOWN = DEFAULTS.residuals.command_well_known


@dataclass(frozen=True)
class CommandTimes:
    """How early (-) or late (+) single ``commands`` are, relative to the others, s: standard deviation, 5 and 95 %.

    What errors of tracking add to the spread of what is measured is taken out.
    """

    sd_s: float
    low_s: float
    high_s: float
    commands: int
    rule: DelayRule | None = None
    """What the delays follow, where they do: then nothing is late by chance."""

    @property
    def in_words(self) -> str:
        """A clause."""
        if self.rule is not None:
            return self.rule.in_words
        return (
            f"commands take effect at times that scatter: nine of ten between {abs(1e3 * self.low_s):.0f} ms before and "
            f"{1e3 * self.high_s:.0f} ms after the usual delay (standard deviation {1e3 * self.sd_s:.0f} ms), as if packets were "
            "lost or late, or a controller read its commands only now and then"
        )

    @property
    def note(self) -> str:
        """What follows from it, in sentences."""
        mean = "A lag, a late command or a late clock that is named beside this may be the mean of such delays."
        if self.rule is None:
            return (
                f"No model predicts when a single command takes effect. {mean} Log when the robot carries out each command, or "
                "let its controller acknowledge them."
            )
        if self.rule.of_place:
            return (
                f"Motors do not know where the robot is, but a camera that reads its rows one after another takes poses in one "
                f"part of its picture later than in another, whatever their stamps say. {mean} Use a global shutter, or stamp "
                "each pose with the time at which its row was read."
            )
        return mean


@dataclass(frozen=True)
class _Change:
    """One change of command: its trial and number, the frames after it, and those later in the command (None: too few).

    ``around``: the frames that a shift can reach, from the earliest on: without those before, any early time fits as well.
    ``kind``: on what a fault that is the same in every change may depend: 1, its size (m/s), the left wheel's share of it, how
    alike both wheels change (1: ahead, -1: on the spot), which wheels reverse, which stop and the inverse of their speed (s/m;
    friction ends a slow motion sooner), and how soon it follows the one before.
    """

    trial: int
    command: int
    number: int
    kind: tuple[float, ...]
    after: slice
    later: slice | None
    around: slice


def command_times(problem: Problem, fit: Fit) -> CommandTimes | None:
    """The scatter of the times at which commands take effect, where it is certain; None where it is not, or cannot be seen."""
    predictor = problem.predictor
    if not isinstance(predictor, WheelPredictor) or predictor.tracks.relative:
        return None
    tracks, counted = predictor.tracks, predictor.counted
    ignored = set() if counted is None else set(tracks.trial[counted == 0.0].tolist())
    changes = [change for change in _changes(tracks) if change.trial not in ignored]
    if len(changes) < FEWEST:
        return None
    scattered = _scattered(problem, fit, predictor, changes)
    if scattered is None:
        return None
    clear, noise = scattered
    late_s, error_s = _delays(problem, fit, predictor, clear)
    found = np.isfinite(late_s)
    if found.sum() < FEWEST:
        return None
    late_s = late_s[found] - np.median(late_s[found])
    sd_s, low_s, high_s = _spread(late_s, np.sqrt(noise) * error_s[found])
    seen = [(c.trial, c.command, c.after.start) for c, good in zip(clear, found, strict=True) if good]
    rule = delay_rule(tracks, fit.model.wheelbase_m, Changes(*np.array(seen).T), late_s)
    return CommandTimes(sd_s, low_s, high_s, len(late_s), rule)


def _changes(tracks: Tracks) -> Iterator[_Change]:
    """Every change from one command to another that lasts long enough to be shifted and is seen in some frame."""
    differ = (np.diff(tracks.left_m_s, axis=1) != 0) | (np.diff(tracks.right_m_s, axis=1) != 0)
    differ &= tracks.duration_s[:, 1:] > 2 * SHIFT_S
    ends = np.cumsum(tracks.duration_s, axis=1)
    for trial in range(len(tracks)):
        first, t_s = int(tracks.first[trial]), tracks.t_s[tracks.first[trial] : tracks.first[trial + 1]]
        which = np.flatnonzero(differ[trial])
        for number, k in enumerate(which):
            begins = ends[trial, k]
            following = ends[trial, which[number + 1]] if number + 1 < len(which) else np.inf
            a, b = (int(i) for i in np.searchsorted(t_s, [begins - SHIFT_S, min(following, begins + WINDOW_S)]))
            if b <= a:
                continue
            inside = 2 * b - a <= len(t_s) and t_s[2 * b - a - 1] < following
            later = slice(first + b, first + 2 * b - a) if inside else None
            since_s = begins - (ends[trial, which[number - 1]] if number else 0.0)
            speeds = np.stack([tracks.left_m_s[trial, k : k + 2], tracks.right_m_s[trial, k : k + 2]])
            c = int(np.searchsorted(t_s, begins - min(FARTHEST_S, since_s)))
            kind = _kind(speeds, float(since_s))
            yield _Change(trial, int(k), number, kind, slice(first + a, first + b), later, slice(first + c, first + b))


def _kind(speeds: Array, since_s: float) -> tuple[float, ...]:
    """As `_Change.kind`; ``speeds`` (2, 2) of the left and the right wheel, before and after."""
    by = [float(v) for v in speeds[:, 1] - speeds[:, 0]]
    square = by[0] ** 2 + by[1] ** 2
    reverse = [float(v) for v in speeds[:, 0] * speeds[:, 1] < 0.0]
    stop = [float(was != 0.0 and now == 0.0) for was, now in speeds]
    ends = [one / max(abs(float(was)), CREEP_M_S) for one, (was, _) in zip(stop, speeds, strict=True)]
    soon = float(np.exp(-since_s / WINDOW_S))
    return 1.0, float(np.sqrt(square)), by[0] ** 2 / square, 2 * by[0] * by[1] / square, *reverse, *stop, *ends, soon


def _scattered(
    problem: Problem, fit: Fit, predictor: WheelPredictor, changes: Sequence[_Change]
) -> tuple[list[_Change], float] | None:
    """The changes whose times are known best, where they scatter, and the variance of what whitened innovations show without.

    None where they do not scatter.
    """
    root = np.sqrt(weights(fit.whitened))[:, None]
    left = fit.whitened * root
    shifted = [_later(problem, fit, predictor, changes, half, SHIFT_S) for half in (0, 1)]
    answers = [(whitened - fit.whitened) / SHIFT_S * root for whitened in shifted]
    along = [answers[c.number % 2][c.after] for c in changes]
    known = np.array([float((one**2).sum()) for one in along])
    clear = (known > 0.0) & (known >= np.quantile(known, 1.0 - WELL_KNOWN))
    seen = np.array([-float((one * left[c.after]).sum()) for one, c in zip(along, changes, strict=True)])
    usual = np.array(
        [np.nan if c.later is None else float((one * left[c.later]).sum()) for one, c in zip(along, changes, strict=True)]
    )[clear]
    if np.isfinite(usual).sum() < FEWEST:
        return None
    root_of = np.sqrt(known[clear])
    design = root_of[:, None] * np.array([c.kind for c in changes])[clear]
    standard = seen[clear] / root_of
    apart = standard - design @ np.linalg.lstsq(design, standard, rcond=None)[0]
    noise = float(np.nanmean((usual / root_of) ** 2))
    if float(np.mean(apart**2)) < TIMES_USUAL * max(noise, 1.0):
        return None
    if _of_large_steps(apart**2 - noise, known[clear], np.array([c.kind[1] for c in changes])[clear]):
        return None
    return [c for c, good in zip(changes, clear, strict=True) if good], noise


def _of_large_steps(excess: Array, known: Array, size: Array) -> bool:
    """Are the changes that are late or early mostly the large ones? A packet is lost whatever it says: all sizes scatter alike.

    ``excess`` (changes,): square of the deviation beyond noise; ``known`` (1/s2): what a square of a second makes of it;
    ``size`` of the change (m/s). Motors that are cut, or a controller that trips, do so beyond some size.
    """
    for share in SMALLER:
        large = size > np.quantile(size, share)
        if large.any():
            smaller, larger = (float(excess[some].sum() / known[some].sum()) for some in (~large, large))
            if smaller < ALIKE * larger:
                return True
    return False


def _delays(problem: Problem, fit: Fit, predictor: WheelPredictor, changes: Sequence[_Change]) -> tuple[Array, Array]:
    """By how much each change is late, and the standard error of that if noise is as the fit has it, s.

    Where the loss of the poses around it is least, of many shifts, then between them; NaN where that is the last shift that was
    tried or can be, or where the poses say nothing.
    """
    grid, each = np.linspace(-FARTHEST_S, FARTHEST_S, SHIFTS), np.arange(len(changes))
    loss = np.stack([_losses(problem, fit, predictor, changes, np.full(len(changes), shift_s)) for shift_s in grid])
    first = loss.argmin(axis=0)
    beside = loss[np.stack([first - 1, first + 1]).clip(0, SHIFTS - 1), each]
    inside = (first > 0) & (first < SHIFTS - 1) & np.isfinite(beside).all(axis=0)
    best_s, least, step_s = grid[first], loss.min(axis=0), float(grid[1] - grid[0])
    for _ in range(HALVINGS):
        step_s /= 2
        for tried_s in (best_s - step_s, best_s + step_s):
            there = _losses(problem, fit, predictor, changes, tried_s)
            best_s, least = np.where(there < least, tried_s, best_s), np.minimum(there, least)
    off, known = _last_step(problem, fit, predictor, changes, best_s, step_s)
    known[~inside | (known <= 0.0)] = np.nan
    return best_s + (off / known).clip(-step_s, step_s), 1.0 / np.sqrt(known)


def _last_step(
    problem: Problem, fit: Fit, predictor: WheelPredictor, changes: Sequence[_Change], at_s: Array, step_s: float
) -> tuple[Array, Array]:
    """From shifts ``at_s`` (changes,), of a step of least squares: its right side (1/s), how well the shift is known (1/s2)."""
    right, known = np.zeros(len(changes)), np.zeros(len(changes))
    for half in (0, 1):
        left, below, above = (_later(problem, fit, predictor, changes, half, at_s + by_s) for by_s in (0.0, -step_s, step_s))
        answer, count = (above - below) / (2 * step_s), weights(left)[:, None]
        for k, change in enumerate(changes):
            if change.number % 2 == half:
                one = answer[change.around] * count[change.around]
                right[k], known[k] = -float((one * left[change.around]).sum()), float((one * answer[change.around]).sum())
    return right, known


def _spread(late_s: Array, error_s: Array) -> tuple[float, float, float]:
    """Standard deviation, 5 and 95 % of delays (n,) that are known with these standard errors, without what errors add.

    Each counts as much as it tells of the variance of the delays, and is drawn in by as much as errors make it stand out.
    """
    variance = float(late_s.var())
    for _ in range(len(late_s)):
        counts = 1.0 / np.maximum(variance + error_s**2, 1e-300)
        mean = np.average(late_s, weights=counts)
        was, variance = variance, max(float(np.average((late_s - mean) ** 2 - error_s**2, weights=counts)), 0.0)
        if abs(variance - was) <= 1e-6 * was:
            break
    drawn_s = late_s * np.sqrt(variance * counts)
    order = np.argsort(drawn_s)
    share = (np.cumsum(counts[order]) - counts[order] / 2) / counts.sum()
    low_s, high_s = (float(v) for v in np.interp([0.05, 0.95], share, drawn_s[order]))
    return float(np.sqrt(variance)), low_s, high_s


def _losses(problem: Problem, fit: Fit, predictor: WheelPredictor, changes: Sequence[_Change], shift_s: Array) -> Array:
    """Of the poses around each change, where it is later by ``shift_s`` (changes,); infinite where it cannot be."""
    halves = [huber(_later(problem, fit, predictor, changes, half, shift_s)) for half in (0, 1)]
    loss = np.array([float(halves[c.number % 2][c.around].sum()) for c in changes])
    return np.where([_can_be(predictor.tracks, c, s) for c, s in zip(changes, shift_s, strict=True)], loss, np.inf)


def _can_be(tracks: Tracks, change: _Change, shift_s: float) -> bool:
    """Do both commands last as long?"""
    before_s, after_s = tracks.duration_s[change.trial, change.command : change.command + 2]
    return bool(before_s + shift_s > 0.0 and after_s - shift_s > 0.0)


def _later(
    problem: Problem, fit: Fit, predictor: WheelPredictor, changes: Sequence[_Change], half: int, shift_s: Array | float
) -> Array:
    """Whitened innovations (frames, 3) where every other change is later by so much (changes,), or earlier; where it can be."""
    tracks, duration_s = predictor.tracks, predictor.tracks.duration_s.copy()
    for change, by_s in zip(changes, np.broadcast_to(shift_s, len(changes)), strict=True):
        if change.number % 2 == half and _can_be(tracks, change, by_s):
            duration_s[change.trial, change.command] += by_s
            duration_s[change.trial, change.command + 1] -= by_s
    moved = predictor.driving(replace(tracks, duration_s=duration_s))
    whitened: Array = problem.pose_filter.whitened(moved.tracks, moved.steps(fit.model))
    return whitened
