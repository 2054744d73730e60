"""What has a rhythm along time, though no variable shows it: a wheel out of round, a heading that wanders.

Foreseen well, frames are independent. Honest motors are a little faster or slower from one command to the next, and from
trial to trial; that is taken out first, so that it does not look like an autocorrelation: inside commands each command's mean,
between commands each trial's. Where most commands last a few frames alone, as those of a joystick, pieces of a trial
take their place.

Errors of a tracker that share something with those of the frames before are no motion, and correlate as well where a filter
takes them for independent. They add up to nothing: what they add to the way in some frames, they take away later. So a
correlation counts only if the track alone shows it as well: what it moved in frames or longer ways is alike, or is opposed by
more than stationary errors can make it.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from functools import cache
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from bns.diagnose.data.robust import robust_sd
from bns.diagnose.data.tracks import Array, Tracks, command_of_frames
from bns.diagnose.estimate.fit import Fit
from bns.diagnose.estimate.fitting import Problem
from bns.diagnose.residuals.unforeseen import unforeseen
from bns.diagnose.settings import DEFAULTS

LAGS = DEFAULTS.residuals.lags
LEAST_ALIKE = DEFAULTS.residuals.least_alike
LEAST_OPPOSED = DEFAULTS.residuals.least_opposed
LEAST_BETWEEN = DEFAULTS.residuals.least_between
LEAST_Z = DEFAULTS.residuals.correlation_z
APART = DEFAULTS.residuals.ways_apart
MOVES_Z = DEFAULTS.residuals.moves_z
MEMORY = DEFAULTS.residuals.tracker_memory
FEWEST = DEFAULTS.residuals.correlated_frames
_CLIP = DEFAULTS.residuals.clip
LONGEST = DEFAULTS.residuals.longest_period_frames
_DIRECTIONS = ("forward", "left", "heading")
_WORDS = {"forward": "forwards", "left": "sideways", "heading": "in heading"}


@dataclass(frozen=True)
class Autocorrelation:
    """Correlation of the unforeseen with itself ``lag`` frames (``within`` commands) or commands (``between`` them) before.

    ``period_s``: of an oscillation, where the correlations at all lags show one; else None.
    """

    direction: str
    scale: str
    lag: int
    correlation: float
    z: float
    period_s: float | None = None

    @property
    def in_words(self) -> str:
        """What it says of the motion, in a sentence. What is opposed a while later swings back; it does not repeat itself."""
        motion = f"The unexplained motion {_WORDS.get(self.direction, self.direction)}"
        after = f"{self.lag} frames later" if self.scale == "within" else "in the next command"
        seen = f"correlation {self.correlation:+.2f}"
        if self.period_s is not None:
            cause = "something oscillates that no logged variable shows, such as a load or a marker that sways"
            return f"{motion} {self._swings} ({seen} {after}): {cause}."
        if self.correlation < 0:
            return f"{motion} is opposite {after} ({seen}): something swings back that no logged variable shows."
        return f"{motion} is alike {after} ({seen}): what causes it lasts or comes again, and no logged variable shows it."

    @property
    def clause(self) -> str:
        """That it swings, and how fast; "" of what has no period."""
        return f"the motion {_WORDS.get(self.direction, self.direction)} {self._swings}" if self.period_s is not None else ""

    @property
    def _swings(self) -> str:
        assert self.period_s is not None
        return f"swings to and fro with a period of about {self.period_s:.2g} s, {1 / self.period_s:.2g} Hz"

    @property
    def significant(self) -> bool:
        """Too large and too certain to be luck."""
        least = LEAST_BETWEEN
        if self.scale == "within":
            least = LEAST_ALIKE if self.correlation > 0 else LEAST_OPPOSED
        return abs(self.correlation) > least and abs(self.z) > LEAST_Z


def autocorrelations(problem: Problem, fit: Fit) -> list[Autocorrelation]:
    """Every direction and time scale, the largest in proportion to its threshold first.

    Where commands are short no command's mean can be taken off: what is alike there may be a drive that wanders, as one from
    command to command, and counts only with a period.
    """
    found, moved = [], cache(lambda: _unforeseen_ways(problem, fit))
    for index, direction in enumerate(_DIRECTIONS):
        trials = list(_by_command(problem, fit, index))
        within = [_pooled(direction, "within", lag, [_within(commands, lag) for commands in trials]) for lag in LAGS]
        found += [r for r in within if not r.significant or _moves(moved(), index, r)]
        found.append(_pooled(direction, "between", 1, [_between(commands) for commands in trials]))
    short, period_s = _short(problem.predictor.tracks), cache(lambda direction: _period_s(problem, fit, direction))
    ranked = sorted(found, key=lambda r: (not r.significant, -abs(r.z)))
    while ranked[0].significant and ranked[0].scale == "within":
        largest = replace(ranked[0], period_s=period_s(ranked[0].direction))
        if largest.period_s is not None or largest.correlation < 0 or not short:
            return [largest, *ranked[1:]]
        del ranked[0]
    return ranked


def _period_s(problem: Problem, fit: Fit, direction: str) -> float | None:
    """Of an oscillation in that direction; None where there is none."""
    tracks, trials = problem.predictor.tracks, list(_by_command(problem, fit, _DIRECTIONS.index(direction)))
    frames = _period([_pooled("", "", lag, [_within(commands, lag) for commands in trials]) for lag in range(1, LONGEST + 1)])
    return None if frames is None else frames * float(np.median(np.diff(tracks.t_s)[~tracks.is_first[1:]]))


def _period(correlogram: list[Autocorrelation]) -> float | None:
    """Frames of an oscillation's period, from the correlations at the lags 1, 2, …: half of it later what moves is opposed, and
    after the whole it is alike again, both beyond chance. None where that is not so."""
    r, z = (np.array([getattr(one, name) for one in correlogram]) for name in ("correlation", "z"))
    if not (z < -LEAST_Z).any():
        return None
    first = int((z < -LEAST_Z).argmax())
    ends = np.append(np.flatnonzero(r[first:] >= 0) + first, len(r))[0]
    half = first + int(r[first:ends].argmin()) + 1
    lags = np.arange(half + (half + 1) // 2, min(half * 5 // 2, len(r)) + 1)
    if not len(lags):
        return None
    whole = int(lags[r[lags - 1].argmax()])
    inside = lags[0] < whole < lags[-1]
    return _summit(r, whole) if inside and z[whole - 1] > LEAST_Z else None


def _summit(values: Array, lag: int) -> float:
    """Where the parabola through three correlations is highest, in lags; ``values`` begin at the lag 1."""
    before, at, after = values[lag - 2 : lag + 1]
    bend = before - 2 * at + after
    return lag + 0.5 * float((before - after) / bend) if bend < 0 else float(lag)


def _unforeseen_ways(problem: Problem, fit: Fit) -> list[Array]:
    """For each trial what the track moved beyond the model in each frame, (frames, 3), each command's mean taken off."""
    tracks, off = problem.predictor.tracks, unforeseen(problem, fit)
    usual = np.maximum(robust_sd(off, axis=0), 1e-12)
    out = []
    for trial, (a, b) in enumerate(pairwise(tracks.first)):
        ways = np.clip(off[a + 1 : b] / usual, -_CLIP, _CLIP)
        _, of, count = np.unique(_command(tracks, trial), return_inverse=True, return_counts=True)
        means = np.stack([np.bincount(of, ways[:, i]) / count for i in range(3)], axis=1) if len(ways) else ways
        out.append(ways - means[of])
    return out


def _moves(moved: list[Array], direction: int, found: Autocorrelation) -> bool:
    """Does the track by itself move on, or back, so many frames later?"""
    lag = found.lag
    frames = _pooled("", "", lag, [_lagged(ways[:, direction], lag) for ways in moved if len(ways) > lag + FEWEST])
    if found.correlation < 0:
        # further than stationary errors reach, and that not by chance
        return frames.correlation < -MEMORY and frames.z * (1 + MEMORY / frames.correlation) < -MOVES_Z
    longer = [np.concatenate([[0.0], np.cumsum(ways[:, direction])]) for ways in moved]
    values = [way[lag:] - way[:-lag] for way in longer if len(way) > 2 * lag + APART + FEWEST]
    return frames.z > MOVES_Z or _pooled("", "", lag, [_lagged(v, lag + APART) for v in values]).z > MOVES_Z


def _lagged(values: Array, lag: int) -> tuple[float, float]:
    return float(values[lag:] @ values[:-lag]), float(values @ values)


def _by_command(problem: Problem, fit: Fit, direction: int) -> Iterator[list[Array]]:
    """For each trial the unforeseen of its commands, frame by frame."""
    tracks = problem.predictor.tracks
    for trial, (a, b) in enumerate(pairwise(tracks.first)):
        whitened = np.clip(fit.whitened[a + 1 : b, direction], -_CLIP, _CLIP)
        command = _command(tracks, trial)
        yield [whitened[command == c] for c in np.unique(command)]


def _command(tracks: Tracks, trial: int) -> NDArray[np.int64]:
    """Number of the command in force in each frame of a trial but its first; of pieces in their place where they are short."""
    if _short(tracks):
        return np.arange(tracks.first[trial + 1] - tracks.first[trial] - 1) // (2 * LONGEST)
    return command_of_frames(tracks, trial)[1:]


def _short(tracks: Tracks) -> bool:
    """Do most commands end before a correlation can be read in them? A driver who steers all the time gives one a frame."""
    lasts_s, steps_s = tracks.duration_s[tracks.duration_s > 0], np.diff(tracks.t_s)[~tracks.is_first[1:]]
    return bool(len(lasts_s) and len(steps_s)) and float(np.median(lasts_s)) < (min(LAGS) + FEWEST) * float(np.median(steps_s))


def _within(commands: list[Array], lag: int) -> tuple[float, float]:
    above = below = 0.0
    for values in commands:
        if len(values) >= lag + FEWEST:
            p, q = _products(values, lag)
            above, below = above + p, below + q
    return above, below


def _between(commands: list[Array]) -> tuple[float, float]:
    means = np.array([values.sum() / np.sqrt(len(values)) for values in commands if len(values) >= FEWEST])
    return _products(means, 1) if len(means) >= 4 else (0.0, 0.0)


def _products(values: Array, lag: int) -> tuple[float, float]:
    """Lagged and plain products about the mean; taking off the mean makes the former too small by a known share."""
    centred, n = values - values.mean(), len(values)
    square = float(centred @ centred)
    return float(centred[lag:] @ centred[:-lag]) + (n - lag) * square / ((n - 1) * n), square


def _pooled(direction: str, scale: str, lag: int, sums: list[tuple[float, float]]) -> Autocorrelation:
    pairs = np.array([s for s in sums if s[1] > 0])
    if len(pairs) < 4:
        return Autocorrelation(direction, scale, lag, 0.0, 0.0)
    r = float(pairs[:, 0].sum() / pairs[:, 1].sum())
    se = float(np.std(pairs[:, 0] - r * pairs[:, 1]) * np.sqrt(len(pairs)) / pairs[:, 1].sum())
    return Autocorrelation(direction, scale, lag, r, r / se if se > 0 else 0.0)
