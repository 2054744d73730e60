"""How much a frame scatters and how much the drive does: estimated from the tracks themselves, under a given model."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol

import numpy as np
from scipy.optimize import minimize

from bns.diagnose.data.robust import robust_sd
from bns.diagnose.data.tracks import Array, Tracks
from bns.diagnose.predict.base import Predictor, Steps
from bns.diagnose.settings import DEFAULTS
from bns.engine.pose_filter import filter_gains, innovations

HUBER = DEFAULTS.estimate.huber

_LEAST_APART_M = DEFAULTS.predict.marker_least_m
_ENOUGH = DEFAULTS.estimate.noise_trials
_GUESS = np.array(DEFAULTS.estimate.noise_guess)
_LOW = np.array(DEFAULTS.estimate.noise_low)
_HIGH = np.array(DEFAULTS.estimate.noise_high)
_FARTHEST = DEFAULTS.estimate.stretch_farthest


def huber(whitened: Array) -> Array:
    """Loss of every frame: half the squared length, linear beyond `HUBER`; (frames,)."""
    far = length(whitened)
    return np.where(far <= HUBER, far * far / 2, HUBER * far - HUBER * HUBER / 2)


def weights(whitened: Array) -> Array:
    """What a frame counts in a step of least squares under `huber`; (frames,), at most 1."""
    return HUBER / np.maximum(length(whitened), HUBER)


def gathered(whitened: Array) -> Array:
    """The same, none much longer than the others: how far one is beyond that says nothing, since something else happened there.

    Others: half of the frames, or noise alone where that is longer.
    """
    far = length(whitened)
    of_others = float(np.median(far[far > 0])) if (far > 0).any() else 0.0
    farthest = _FARTHEST * max(np.sqrt(whitened.shape[1]), of_others)
    return np.asarray(whitened * (farthest / np.maximum(far, farthest))[:, None])


def length(whitened: Array) -> Array:
    """Of the innovations of every frame, (frames,)."""
    return np.sqrt(np.asarray(np.einsum("kc,kc->k", whitened, whitened), dtype=np.float64))


class Whitening(Protocol):
    """Makes errors of predictions independent, each with a standard deviation of 1."""

    @property
    def noise(self) -> Array:
        """The numbers that it was made with."""

    def whitened(self, tracks: Tracks, steps: Steps) -> Array:
        """Whitened errors under some steps, (frames, 3 + k)."""


@dataclass(frozen=True)
class Filter:
    """The filter for tracks with a given noise; its gains belong to one model's steps and serve all that are like it."""

    noise: Array
    gain: Array
    whiten: Array
    logdet: Array
    apart_m: Array | None = None
    """Scatter of each distance between tracked points, (k,)."""

    def whitened(self, tracks: Tracks, steps: Steps) -> Array:
        """Whitened innovations under other steps, (frames, 3); of robots with several tracked points also their distances."""
        seen = innovations(steps.body, steps.drift_m, tracks.pose, tracks.is_first, self.gain, self.whiten)
        if steps.apart_m is None or self.apart_m is None:
            return seen
        return np.concatenate([seen, steps.apart_m / self.apart_m], axis=1)


def filter_for(predictor: Predictor, steps: Steps, noise: Array) -> Filter:
    """The filter with the gains that these steps and this noise ask for."""
    gain, whiten, logdet = filter_gains(steps.body, predictor.tracks.is_first, predictor.way_m, noise)
    return Filter(noise, gain, whiten, logdet, _scatter(steps.apart_m))


def _scatter(apart_m: Array | None) -> Array | None:
    """Standard deviations (k,) of distances that are off by apart_m (frames, k), by their medians."""
    if apart_m is None:
        return None
    return np.maximum(robust_sd(apart_m, axis=0), _LEAST_APART_M)


def estimate_noise(predictor: Predictor, steps: Steps, start: Array | None = None) -> Array:
    """Most likely noise, as `filter_gains` takes it: position m, heading rad, and the drive's scatter three ways.

    From at most `_ENOUGH` trials that count, evenly chosen: five numbers need no more.
    """
    tracks, counted = predictor.tracks, predictor.counted
    usable = np.arange(len(tracks)) if counted is None else np.unique(tracks.trial[counted > 0])
    chosen = usable[np.unique(np.linspace(0, len(usable) - 1, min(len(usable), _ENOUGH)).round().astype(int))]
    frames = np.concatenate([np.arange(tracks.first[i], tracks.first[i + 1]) for i in chosen])
    body, drift, pose = steps.body[frames], steps.drift_m[frames], tracks.pose[frames]
    is_first, way_m = tracks.is_first[frames], predictor.way_m[frames]
    low, high = np.log(_LOW), np.log(_HIGH)
    if predictor.tracking is not None:
        low[:2] = high[:2] = np.log(predictor.tracking)

    def surprise(logs: Array) -> float:
        inside = np.clip(logs, low, high)
        gain, whiten, logdet = filter_gains(body, is_first, way_m, np.exp(inside))
        whitened = innovations(body, drift, pose, is_first, gain, whiten)
        total = float(logdet.sum() + huber(whitened).sum())
        return (total if np.isfinite(total) else 1e300) + 1e3 * float(((logs - inside) ** 2).sum())

    first = np.log(_GUESS if start is None else start)
    simplex = np.vstack([first, first + 0.7 * np.eye(len(first))])
    options = {"initial_simplex": simplex, "xatol": 0.05, "fatol": 0.5, "maxfev": 300}
    return np.exp(np.clip(minimize(surprise, first, method="Nelder-Mead", options=options).x, low, high))
