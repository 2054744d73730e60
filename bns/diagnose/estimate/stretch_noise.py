"""How stretches of a robot on joints scatter: tracking noise, chance as simulated for each stretch, and a drift of its own.

A stretch's errors y in all frames have the covariance D + U U': D of the tracking alone, the columns of U from `Luck`, from the
noise of the pose at its begin, and from a drift that grows from begin to end. All that is asked for works on the few columns:
with A = D^(-1/2) U and A'A = V L V', the whitened errors are z - A V ((1 - (1 + L)^(-1/2)) / L) V' A' z, z = D^(-1/2) y.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import minimize

from bns.diagnose.data.robust import robust_sd
from bns.diagnose.data.tracks import Array, Tracks
from bns.diagnose.estimate.noise import HUBER
from bns.diagnose.predict.base import Predictor, Steps
from bns.diagnose.predict.luck import Luck, since_begin, wrapped
from bns.diagnose.settings import DEFAULTS

_LEAST_APART_M = DEFAULTS.predict.marker_least_m
_GUESS = np.array(DEFAULTS.estimate.stretch_guess)
_LOW = np.array(DEFAULTS.estimate.stretch_low)
_HIGH = np.array(DEFAULTS.estimate.stretch_high)
_LUCK_FACTOR = DEFAULTS.estimate.stretch_luck_factor
_LUCK_RANGE = DEFAULTS.estimate.stretch_luck_range
_ENOUGH = DEFAULTS.estimate.stretch_noise_of


@dataclass(frozen=True)
class StretchFilter:
    """Whitens the errors of stretches as a `Filter` does those of tracks.

    ``noise``: position (m) and heading (rad) of a tracked pose, drift in position (m) and heading (rad) over a stretch, then how
    strong each kind of luck is, as a multiple of what is usual. ``scale`` (3 + k,): D's roots; ``columns``: A (frames, 3 + k, m);
    ``shrink`` (stretches, m, m): what stands between A and A' above.
    """

    noise: Array
    luck: Luck
    scale: Array
    columns: Array
    shrink: Array

    def whitened(self, tracks: Tracks, steps: Steps) -> Array:
        """Whitened errors (frames, 3 + k) of what a model predicts."""
        z = errors_since_begin(self.luck, tracks.pose, steps) / self.scale
        along = np.add.reduceat(np.einsum("fcm,fc->fm", self.columns, z), self.luck.begins, axis=0)
        foreseen = np.einsum("smn,sn->sm", self.shrink, along)[self.luck.stretch]
        out: Array = z - np.einsum("fcm,fm->fc", self.columns, foreseen)
        return out


def stretch_filter(predictor: Predictor, steps: Steps, noise: Array) -> StretchFilter:
    """The filter for a noise; distances scatter as they do under these steps, by their medians."""
    luck = predictor.luck
    assert luck is not None
    pose = predictor.tracks.pose
    scale = np.concatenate([noise[[0, 0, 1]], _apart_scatter(steps)])
    columns = _all_columns(luck, pose) * _strengths(luck, noise) / scale[:, None]
    gram = np.add.reduceat(np.einsum("fcm,fcn->fmn", columns, columns), luck.begins, axis=0)
    sizes, ways = np.linalg.eigh(gram)
    sizes = np.maximum(sizes, 0.0)
    share = np.where(sizes > 1e-9, (1 - 1 / np.sqrt(1 + sizes)) / np.maximum(sizes, 1e-9), 0.5)
    shrink = np.einsum("smi,si,sni->smn", ways, share, ways)
    return StretchFilter(noise, luck, scale, columns, shrink)


def estimate_stretch_noise(predictor: Predictor, steps: Steps, start: Array | None = None) -> Array:
    """Most likely noise, as `StretchFilter` has it; luck is expected to be about as strong as usual.

    Tracking noise is no larger than what the tracks tell: model errors are in that, too.
    """
    luck = predictor.luck
    assert luck is not None
    sums = _Sums.of(luck, predictor.tracks.pose, steps, _apart_scatter(steps))
    low = np.log(np.concatenate([_LOW, np.full(luck.kinds, _LUCK_RANGE[0])]))
    high = np.log(np.concatenate([_HIGH, np.full(luck.kinds, _LUCK_RANGE[1])]))
    if predictor.tracking is not None:
        high[:2] = np.log(predictor.tracking)

    def surprise(logs: Array) -> float:
        inside = np.clip(logs, low, high)
        usual = ((inside[len(_GUESS) :] / np.log(_LUCK_FACTOR)) ** 2).sum() / 2
        return sums.surprise(luck, np.exp(inside)) + float(usual) + 1e3 * float(((logs - inside) ** 2).sum())

    first = np.log(np.concatenate([_GUESS, np.ones(luck.kinds)]) if start is None else start)
    first = np.clip(first, low, high)
    simplex = np.vstack([first, first + 0.7 * np.eye(len(first))])
    options = {"initial_simplex": simplex, "xatol": 0.05, "fatol": 0.5, "maxfev": 400}
    return np.exp(np.clip(minimize(surprise, first, method="Nelder-Mead", options=options).x, low, high))


@dataclass(frozen=True)
class _Sums:
    """What the likelihood of a noise needs, summed over the frames of each stretch: channel by channel.

    ``squares`` (3, stretches), ``along`` (3, stretches, m), ``gram`` (3, stretches, m, m): of position, of heading, of the
    distances in their own scatter; ``entries`` (2, stretches): how many errors of position and of heading there are.
    """

    squares: Array
    along: Array
    gram: Array
    entries: Array

    @classmethod
    def of(cls, luck: Luck, pose: Array, steps: Steps, apart_m: Array) -> _Sums:
        chosen = np.unique(np.linspace(0, len(luck.begins) - 1, min(len(luck.begins), _ENOUGH)).round().astype(int))
        frames = np.flatnonzero(np.isin(luck.stretch, chosen))
        begins = np.searchsorted(luck.stretch[frames], chosen)
        errors, columns = errors_since_begin(luck, pose, steps)[frames], _all_columns(luck, pose)[frames]
        errors[:, 3:], columns[:, 3:] = errors[:, 3:] / apart_m, columns[:, 3:] / apart_m[:, None]
        parts = [(errors[:, c], columns[:, c]) for c in (slice(0, 2), slice(2, 3), slice(3, None))]

        def total(values: list[Array]) -> Array:
            return np.array([np.add.reduceat(v, begins, axis=0) for v in values])

        seen = total([np.ones(len(frames))])[0] - 1.0
        return cls(
            total([(e * e).sum(axis=1) for e, _ in parts]),
            total([np.einsum("fc,fcm->fm", e, u) for e, u in parts]),
            total([np.einsum("fcm,fcn->fmn", u, u) for _, u in parts]),
            np.array([2 * seen, seen]),
        )

    def surprise(self, luck: Luck, noise: Array) -> float:
        """Minus the log-likelihood of a noise; errors far longer than usual count linearly."""
        weight = np.array([noise[0] ** -2, noise[1] ** -2, 1.0])
        strength = _strengths(luck, noise)
        inner = np.einsum("c,csmn->smn", weight, self.gram) * np.outer(strength, strength) + np.eye(len(strength))
        along = np.einsum("c,csm->sm", weight, self.along) * strength
        explained = (along * np.linalg.solve(inner, along[..., None])[..., 0]).sum(axis=1)
        length = np.sqrt(np.maximum(weight @ self.squares - explained, 0.0))
        # `HUBER` is for three numbers; the usual length of more grows with the root of their count
        far = np.sqrt(self.entries.sum(axis=0)) + HUBER - np.sqrt(3.0)
        loss = np.where(length <= far, length * length / 2, far * length - far * far / 2)
        logdet = np.log(noise[:2]) @ self.entries + np.linalg.slogdet(inner)[1] / 2
        total = float((loss + logdet).sum())
        return total if np.isfinite(total) else 1e300


def errors_since_begin(luck: Luck, pose: Array, steps: Steps) -> Array:
    """Measured minus predicted in every frame: pose since the stretch's begin, and distances, (frames, 3 + k)."""
    measured = since_begin(pose, luck.begins, luck.stretch)
    predicted = predicted_since_begin(luck, pose, steps)
    off = measured - predicted
    off[:, 2] = wrapped(off[:, 2])
    return off if steps.apart_m is None else np.column_stack([off, steps.apart_m])


def predicted_since_begin(luck: Luck, pose: Array, steps: Steps) -> Array:
    """Displacements from frame to frame, end to end from each stretch's begin, (frames, 3)."""
    heading = _since(luck, steps.body[:, 2])
    before = heading - steps.body[:, 2]
    cos, sin = np.cos(before), np.sin(before)
    east, north = steps.drift_m.T
    c, s = np.cos(pose[luck.begins, 2])[luck.stretch], np.sin(pose[luck.begins, 2])[luck.stretch]
    forward = cos * steps.body[:, 0] - sin * steps.body[:, 1] + c * east + s * north
    left = sin * steps.body[:, 0] + cos * steps.body[:, 1] + c * north - s * east
    return np.column_stack([_since(luck, forward), _since(luck, left), heading])


def _since(luck: Luck, values: Array) -> Array:
    """Sums of values (frames,) within each stretch, without those at its begin."""
    total = np.cumsum(values)
    return total - total[luck.begins][luck.stretch]


def _all_columns(luck: Luck, pose: Array) -> Array:
    """Columns (frames, 3 + k, m + 6): luck, the pose at the begin, the drift; all in their own units."""
    forward, left = since_begin(pose, luck.begins, luck.stretch)[:, :2].T
    inner = np.ones(len(pose))
    inner[luck.begins] = 0.0
    added = np.zeros((len(pose), luck.columns.shape[1], 6))
    added[:, 0, 0] = added[:, 1, 1] = added[:, 2, 2] = inner
    added[:, 0, 2], added[:, 1, 2] = -left, forward
    frames = np.bincount(luck.stretch)
    share = (np.arange(len(pose)) - luck.begins[luck.stretch]) / np.maximum(frames - 1, 1)[luck.stretch]
    added[:, 0, 3] = added[:, 1, 4] = added[:, 2, 5] = share
    return np.concatenate([luck.columns, added], axis=2)


def _strengths(luck: Luck, noise: Array) -> Array:
    """By what each column is multiplied, (m + 6,)."""
    of_luck: NDArray[np.float64] = noise[4:][luck.kind]
    return np.concatenate([of_luck, noise[[0, 0, 1, 2, 2, 3]]])


def _apart_scatter(steps: Steps) -> Array:
    """Standard deviations (k,) of the distances, by their medians."""
    if steps.apart_m is None:
        return np.zeros(0)
    return np.maximum(robust_sd(steps.apart_m, axis=0), _LEAST_APART_M)
