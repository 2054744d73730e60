"""The one error that is shown: all models of a table, a verdict or a page, judged on the same windows.

Windows are left out by the data's own evidence alone (a jump of the tracker, `tracker_faults`), before any model is asked, and
counted. The change from one model to the next is paired by trial: a bootstrap draws whole trials, the same for both.
"""

from __future__ import annotations

import threading
from collections import OrderedDict
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import lru_cache
from itertools import pairwise
from typing import Any

import numpy as np
from numpy.typing import NDArray

from bns.diagnose.data.tracker_faults import spans_jump
from bns.diagnose.data.tracking_noise import TrackingNoise, tracking_noise
from bns.diagnose.data.tracks import Array
from bns.diagnose.predict.base import Predictor, Steps
from bns.diagnose.predict.horizons import Errors, errors_of
from bns.diagnose.settings import DEFAULTS

DRAWS = DEFAULTS.predict.interval_draws
LEAST_FALL = DEFAULTS.select.least_fall
FEWEST_TRIALS = DEFAULTS.predict.interval_fewest_trials
_SEED = DEFAULTS.predict.interval_seed
_LATELY = 12
"""Models whose errors are remembered, per horizon."""


@dataclass(frozen=True)
class ModelError:
    """Errors of one model over the windows of a horizon.

    Root mean square of the position with its 95 % interval, its median (m), and the root mean square of the heading (rad).
    """

    name: str
    rms_m: float
    low_m: float
    high_m: float
    median_m: float
    heading_rad: float


@dataclass(frozen=True)
class Change:
    """Root mean square error of a model minus that of the one before it (m), with its 95 % interval; NaN where unknown."""

    change_m: float
    low_m: float
    high_m: float
    median_rose: bool = False
    """Is the median error higher, whatever the luck of the trials, by `least_fall` or more?

    What is there lowers the error wherever it acts. What stands for rare large errors of another kind lowers these, and with
    them the root mean square, at the cost of most windows.
    """

    @property
    def certainty(self) -> float:
        """Size of the change in widths of its interval; 0 where there is no interval."""
        width = self.high_m - self.low_m
        return abs(self.change_m) / width if width > 0 else 0.0

    @property
    def fell(self) -> bool:
        """The error is lower, whatever the luck of the trials."""
        return self.change_m < 0 and not self.high_m >= 0

    @property
    def rose(self) -> bool:
        """The error is higher, whatever the luck of the trials."""
        return self.change_m > 0 and not self.low_m <= 0


_UNKNOWN = Change(float("nan"), float("nan"), float("nan"))


def _rises(change: Change, before_m: float) -> bool:
    """Is the error, or its median, certainly higher, by as much as an effect must lower it (`least_fall`)?"""
    return change.median_rose or (change.rose and change.change_m >= LEAST_FALL * before_m)


def _falls(changes: Sequence[tuple[Change, float]]) -> bool:
    """By changes and the errors (m) before them. Bad trials widen every interval, so a fall need not be certain."""
    known = [(change, before_m) for change, before_m in changes if np.isfinite(change.change_m)]
    surest = max((change for change, _ in known), key=lambda change: change.certainty, default=_UNKNOWN)
    return surest.change_m < 0 and not any(_rises(*one) for one in known)


@dataclass(frozen=True)
class HorizonErrors:
    """All models at one horizon. ``windows`` were judged, ``left_out`` span a jump of the tracker.

    ``changes[i]`` leads from model i to model i + 1; ``total`` from the first to the last.
    """

    horizon: str
    windows: int
    left_out: int
    models: tuple[ModelError, ...]
    changes: tuple[Change, ...]
    total: Change | None
    noise_floor_m: float

    def rms_of(self, name: str) -> float:
        """Root mean square error of a model, m."""
        return next(m.rms_m for m in self.models if m.name == name)

    def change_between(self, before: str, after: str) -> Change:
        """Of two models next to each other; ValueError for others, whose change is not worked out."""
        names = [m.name for m in self.models]
        if names.index(after) != names.index(before) + 1:
            raise ValueError(f"{after!r} does not follow {before!r} in {names}.")
        return self.changes[names.index(before)]


@dataclass(frozen=True)
class PairedErrors:
    """`HorizonErrors` at every horizon, the noise that the tracks show (None: they cannot tell), the number of trials."""

    horizons: Mapping[str, HorizonErrors]
    noise: TrackingNoise | None
    trials: int

    def of(self, name: str) -> dict[str, ModelError]:
        """One model's errors at every horizon."""
        return {h: next(m for m in e.models if m.name == name) for h, e in self.horizons.items()}

    @property
    def falls(self) -> bool:
        """Does the error fall from the first model to the last? As `between`."""
        return _falls([(e.total, e.models[0].rms_m) for e in self.horizons.values() if e.total is not None])

    @property
    def falls_in_the_end(self) -> bool:
        """Does the error fall from the last model but one to the last? As `between`."""
        return _falls([(e.changes[-1], e.models[-2].rms_m) for e in self.horizons.values() if e.changes])

    @property
    def fell_in_the_end(self) -> tuple[str, ...]:
        """Horizons at which the error certainly falls from the last model but one to the last."""
        return tuple(h for h, e in self.horizons.items() if e.changes and e.changes[-1].fell)

    @property
    def rose_in_the_end(self) -> tuple[str, ...]:
        """Horizons at which it, or its median, certainly rises there, by `least_fall` or more."""
        return tuple(h for h, e in self.horizons.items() if e.changes and _rises(e.changes[-1], e.models[-2].rms_m))

    @property
    def median_rose_in_the_end(self) -> tuple[str, ...]:
        """Horizons at which the median certainly rises there, and the root mean square does not."""
        at = {h: e.changes[-1] for h, e in self.horizons.items() if e.changes}
        return tuple(h for h, change in at.items() if change.median_rose and not change.rose)

    def between(self, before: str, after: str) -> bool:
        """Does the error fall from one model to the one that follows it?

        The horizon at which the change is surest decides; at none may it rise for certain, by `least_fall` or more, nor the
        median.
        """
        return _falls([(e.change_between(before, after), e.rms_of(before)) for e in self.horizons.values()])

    def as_json(self) -> dict[str, Any]:
        """Plain values; metres and radians."""
        return {h: _horizon_json(e) for h, e in self.horizons.items()}


class PairedWindows:
    """The windows of some tracks on which models are judged, and what does not depend on the models: worked out once.

    ``predictor`` holds all poses of the tracks; each model's steps are of its frames.
    """

    def __init__(self, predictor: Predictor) -> None:
        self._predictor, self._noise = predictor, _noise_of(predictor)
        self._horizons = {h: _Windows.of(predictor, h, self._noise) for h in predictor.horizons}
        self._lately: OrderedDict[tuple[str, int], tuple[Steps, _Judged]] = OrderedDict()
        self._lock = threading.Lock()

    def errors(self, models: Sequence[tuple[str, Steps]]) -> PairedErrors:
        """Judge what several models predict, in their order."""
        horizons = {
            h: windows.errors([(name, self._judged(h, steps)) for name, steps in models])
            for h, windows in self._horizons.items()
        }
        return PairedErrors(horizons, self._noise, len(self._predictor.tracks))

    def _judged(self, horizon: str, steps: Steps) -> _Judged:
        """The same steps are asked for again and again: those of the models before the last one."""
        key = horizon, id(steps)
        with self._lock:
            known = self._lately.get(key)
        if known is not None:
            return known[1]
        judged = self._horizons[horizon].judged(steps)
        with self._lock:
            self._lately[key] = steps, judged  # the steps are kept, and so their id is theirs alone
            while len(self._lately) > _LATELY * len(self._horizons):
                self._lately.popitem(last=False)
        return judged


def paired_errors(predictor: Predictor, models: Sequence[tuple[str, Steps]]) -> PairedErrors:
    """Judge what several models predict, in their order, on the same windows: as `PairedWindows`."""
    return PairedWindows(predictor).errors(models)


def judged_windows(predictor: Predictor, steps: Steps, horizon: str) -> Errors:
    """One model's errors over the windows that are judged, one row each."""
    errors = errors_of(predictor, steps, horizon)
    return errors.only(~spans_jump(predictor.tracks, errors.start, errors.end))


def noise_json(errors: PairedErrors) -> dict[str, float | str] | None:
    """What the tracks themselves say of their noise; None where they cannot."""
    return None if errors.noise is None else dict(vars(errors.noise))


def _noise_of(predictor: Predictor) -> TrackingNoise | None:
    if predictor.tracking is not None:
        return TrackingNoise(*predictor.tracking, "distances between tracked points")
    return tracking_noise(predictor.tracks)


@dataclass(frozen=True)
class _Judged:
    """One model over the windows of a horizon: its errors (windows,), sums of squares by trial (trials,), the root mean square of
    every bootstrap sample (draws,), and its numbers under no name."""

    position_m: Array
    squares: Array
    drawn: Array
    summary: ModelError


@dataclass(frozen=True)
class _Windows:
    """What is judged at a horizon: the windows that are ``kept``, the trial of each, how trials are drawn, the noise's share."""

    predictor: Predictor
    horizon: str
    kept: NDArray[np.bool_]
    of_trial: NDArray[np.int64]
    draws: _Draws
    floor_m: float

    @classmethod
    def of(cls, predictor: Predictor, horizon: str, noise: TrackingNoise | None) -> _Windows:
        tracks = predictor.tracks
        start, end = predictor.windows(horizon)
        kept = ~spans_jump(tracks, start, end)
        of_trial = tracks.trial[start[kept]]
        draws = _Draws.over(np.bincount(of_trial, minlength=len(tracks)))
        distance = np.hypot(*(tracks.pose[end[kept], :2] - tracks.pose[start[kept], :2]).T)
        floor = noise.error_m(distance) if noise is not None else float("nan")
        return cls(predictor, horizon, kept, of_trial, draws, floor)

    def judged(self, steps: Steps) -> _Judged:
        """What a model predicts."""
        e = errors_of(self.predictor, steps, self.horizon)
        position_m, trials = e.position_m[self.kept], len(self.predictor.tracks)
        squares = np.bincount(self.of_trial, position_m**2, minlength=trials).astype(np.float64)
        drawn = self.draws.rms(squares)
        low, high = self.draws.interval(drawn)
        heading_rad = rms_of_all(e.heading_rad[self.kept])
        summary = ModelError("", rms_of_all(position_m), low, high, median_of_all(position_m), heading_rad)
        return _Judged(position_m, squares, drawn, summary)

    def errors(self, models: Sequence[tuple[str, _Judged]]) -> HorizonErrors:
        """Several models and the changes between them."""
        summaries = tuple(replace(one.summary, name=name) for name, one in models)
        judged = [one for _, one in models]
        changes = tuple(self._change(a, b) for a, b in pairwise(judged))
        total = self._change(judged[0], judged[-1]) if len(judged) > 1 else None
        kept = int(self.kept.sum())
        return HorizonErrors(self.horizon, kept, len(self.kept) - kept, summaries, changes, total, self.floor_m)

    def _change(self, before: _Judged, after: _Judged) -> Change:
        windows = self.draws.windows.sum()
        if not windows:
            return _UNKNOWN
        change = float(np.sqrt(after.squares.sum() / windows) - np.sqrt(before.squares.sum() / windows))
        return Change(change, *self.draws.interval(after.drawn - before.drawn), self._median_rose(before, after))

    def _median_rose(self, before: _Judged, after: _Judged) -> bool:
        """As `Change.median_rose`; the medians of the samples are asked for only where the median of all windows is higher."""
        if not after.summary.median_m >= (1.0 + LEAST_FALL) * before.summary.median_m:
            return False
        risen = self.draws.medians(after.position_m, self.of_trial) - self.draws.medians(before.position_m, self.of_trial)
        return self.draws.interval(risen)[0] > 0.0


@lru_cache(maxsize=4)
def _drawn(trials: int) -> Array:
    """How often each of so many trials was drawn, (draws, trials): the same at every horizon that all of them have windows of."""
    return np.random.default_rng(_SEED).multinomial(trials, np.full(trials, 1 / trials), size=DRAWS).astype(np.float64)


@dataclass(frozen=True)
class _Draws:
    """Bootstrap samples of the trials that have windows: how often each was drawn (draws, trials), and of how many windows."""

    used: NDArray[np.bool_]
    windows: Array
    drawn: Array | None

    @classmethod
    def over(cls, counts: NDArray[np.int64]) -> _Draws:
        used = counts > 0
        n = int(used.sum())
        enough = n >= FEWEST_TRIALS
        return cls(used, counts[used].astype(float), _drawn(n) if enough else None)

    def rms(self, squares: Array) -> Array:
        """Root mean square of every sample, (draws,); ``squares`` (trials,): sums of squares. Empty where trials are few."""
        if self.drawn is None:
            return np.zeros(0)
        out: Array = np.sqrt(self.drawn @ squares[self.used] / (self.drawn @ self.windows))
        return out

    def medians(self, values: Array, of_trial: NDArray[np.int64]) -> Array:
        """Median over the windows of every sample, (draws,); ``values``, ``of_trial`` (windows,). Empty where trials are few."""
        if self.drawn is None:
            return np.zeros(0)
        order, place = np.argsort(values), np.cumsum(self.used) - 1
        of_ordered = place[of_trial[order]]
        often = (drawn[of_ordered].cumsum() for drawn in self.drawn)  # all at once: as many numbers as draws times windows
        return np.asarray(values[order][[int(np.searchsorted(n, n[-1] / 2)) for n in often]])

    @staticmethod
    def interval(values: Array) -> tuple[float, float]:
        """The middle 95 %; NaN of nothing."""
        low, high = np.quantile(values, [0.025, 0.975]) if len(values) else (np.nan, np.nan)
        return float(low), float(high)


def rms_of_all(values: Array) -> float:
    """Root mean square; NaN of nothing."""
    return float(np.sqrt((values * values).mean())) if len(values) else float("nan")


def median_of_all(values: Array) -> float:
    """Median; NaN of nothing."""
    return float(np.median(values)) if len(values) else float("nan")


def _horizon_json(e: HorizonErrors) -> dict[str, Any]:
    return {
        "windows": e.windows,
        "windows_left_out": e.left_out,
        "noise_floor_m": plain(e.noise_floor_m),
        "models": [
            {
                "name": m.name,
                "position_rms_m": plain(m.rms_m),
                "position_rms_low_m": plain(m.low_m),
                "position_rms_high_m": plain(m.high_m),
                "position_median_m": plain(m.median_m),
                "heading_rms_rad": plain(m.heading_rad),
            }
            for m in e.models
        ],
        "changes": [_change_json(c) for c in e.changes],
        "total_change": None if e.total is None else _change_json(e.total),
    }


def _change_json(c: Change) -> dict[str, Any]:
    return {"change_m": plain(c.change_m), "low_m": plain(c.low_m), "high_m": plain(c.high_m)}


def plain(value: float) -> float | None:
    """A float that JSON knows."""
    return float(value) if np.isfinite(value) else None
