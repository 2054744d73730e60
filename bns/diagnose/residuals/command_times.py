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
FARTHEST_S, SHIFTS = DEFAULTS.residuals.command_shifts
FEWEST = DEFAULTS.residuals.command_fewest
TIMES_USUAL = DEFAULTS.residuals.command_times_usual
SMALLER, ALIKE = DEFAULTS.residuals.command_sizes_alike
WELL_KNOWN = DEFAULTS.residuals.command_well_known


@dataclass(frozen=True)
class CommandTimes:
    """How early (-) or late (+) single ``commands`` are, relative to the others, s: standard deviation, 5 and 95 %."""

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
    clear = _scattered(problem, fit, predictor, changes)
    if clear is None:
        return None
    late_s = _delays(problem, fit, predictor, clear)
    late_s = late_s - np.median(late_s)
    low_s, high_s = (float(v) for v in np.quantile(late_s, [0.05, 0.95]))
    seen = [(c.trial, c.command, c.after.start) for c in clear]
    rule = delay_rule(tracks, fit.model.wheelbase_m, Changes(*np.array(seen).T), late_s)
    return CommandTimes(float(late_s.std()), low_s, high_s, len(clear), rule)


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
            yield _Change(trial, int(k), number, _kind(speeds, float(since_s)), slice(first + a, first + b), later)


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
) -> list[_Change] | None:
    """The changes whose times are known best, where they scatter; None where they do not."""
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
    return [c for c, good in zip(changes, clear, strict=True) if good]


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


def _delays(problem: Problem, fit: Fit, predictor: WheelPredictor, changes: Sequence[_Change]) -> Array:
    """By how much each change is late, s: where, of many shifts, the loss of the poses after it is least; a parabola between."""
    shifts = np.linspace(-FARTHEST_S, FARTHEST_S, SHIFTS)
    loss = np.empty((len(changes), SHIFTS))
    for j, shift_s in enumerate(shifts):
        halves = [huber(_later(problem, fit, predictor, changes, half, float(shift_s))) for half in (0, 1)]
        loss[:, j] = [float(halves[c.number % 2][c.after].sum()) for c in changes]
    best = loss.argmin(axis=1).clip(1, SHIFTS - 2)
    rows = np.arange(len(changes))
    below, least, above = loss[rows, best - 1], loss[rows, best], loss[rows, best + 1]
    bend = below - 2 * least + above
    off = np.where(bend > 0.0, (below - above) / np.where(bend > 0.0, 2 * bend, 1.0), 0.0).clip(-1.0, 1.0)
    out: Array = shifts[best] + off * (shifts[1] - shifts[0])
    return out


def _later(
    problem: Problem, fit: Fit, predictor: WheelPredictor, changes: Sequence[_Change], half: int, shift_s: float
) -> Array:
    """Whitened innovations (frames, 3) where every other change of command is later by so much, or earlier; where it can be."""
    tracks, duration_s = predictor.tracks, predictor.tracks.duration_s.copy()
    for change in changes:
        before, after = duration_s[change.trial, change.command : change.command + 2]
        if change.number % 2 == half and before + shift_s > 0.0 and after - shift_s > 0.0:
            duration_s[change.trial, change.command] += shift_s
            duration_s[change.trial, change.command + 1] -= shift_s
    moved = predictor.driving(replace(tracks, duration_s=duration_s))
    whitened: Array = problem.pose_filter.whitened(moved.tracks, moved.steps(fit.model))
    return whitened
