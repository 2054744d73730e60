"""How much a tracked pose scatters, from the tracks alone: at rest, and at high frequency. No model has a say in it.

Poses of a robot that rests, after commands of zero, scatter by the tracker's noise alone, slow wander of the picture
included; those in which it still coasts are left out (`rests`). A robot that creeps instead, down a slope for example, leaves a
line, about which they scatter. While it drives under one command, a parabola through a few frames follows it and the rest is
noise, white noise at least: slow noise follows the parabola, so this is a lower bound where the robot never rests. Where few
poses at rest scatter as those while it drives, within what so few can tell, the many are taken: they are known better. Poses
that are rounded stay the same at rest, however far they are rounded: noise is at least that of rounding, the grid over the root
of twelve.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np

from bns.diagnose.data.rests import settled, told_to_stand
from bns.diagnose.data.robust import trimmed_sd
from bns.diagnose.data.tracks import Array, Tracks, command_of_frames
from bns.diagnose.settings import DEFAULTS

FEWEST_AT_REST = DEFAULTS.data.fewest_at_rest
DRIFTS = DEFAULTS.data.drift_at_rest
WIDTH = DEFAULTS.data.parabola_frames
ORDER = DEFAULTS.data.parabola_order
SLOWEST_HZ = DEFAULTS.data.parabola_slowest_hz
AGREES = DEFAULTS.data.rest_agrees
_FEWEST_STEPS = DEFAULTS.data.grid_fewest
_GRID_EXACT = DEFAULTS.data.grid_exact
_AT_REST, _DRIVING, _BOTH, _ROUNDED = "at rest", "high frequency", "at rest, high frequency", "rounding"
_SE = DEFAULTS.data.trimmed_sd_se


@dataclass(frozen=True)
class TrackingNoise:
    """Standard deviation of one tracked pose: each of x and y (m), and the heading (rad).

    ``basis``: at rest; high frequency; both, where they agree; rounding; or distances between tracked points.
    """

    position_m: float
    heading_rad: float
    basis: str

    @property
    def is_lower_bound(self) -> bool:
        """Errors that consecutive poses share are not seen while the robot drives."""
        return self.basis == _DRIVING

    def error_m(self, distance_m: Array) -> float:
        """Root mean square position error of a perfect model, from noise at both ends of windows.

        ``distance_m`` (windows,): how far the robot got; the heading's noise at the start turns the prediction.
        """
        square = 4 * self.position_m**2 + (self.heading_rad * distance_m) ** 2
        return float(np.sqrt(square.mean())) if len(distance_m) else float("nan")


def tracking_noise(tracks: Tracks) -> TrackingNoise | None:
    """The noise of these tracks; None where they cannot tell (poses at the ends of commands alone, say)."""
    if not (tracks.left_m_s.any() or tracks.right_m_s.any()):
        return None  # no wheels, or a robot that was never told to move
    resting, driving = noise_at_rest(tracks), _high_frequency(tracks)
    if resting is not None and driving is not None:
        noise, freedom = resting
        noise = replace(driving, basis=_BOTH) if _agree(noise, driving, freedom) else noise
    else:
        found = driving if resting is None else resting[0]
        if found is None:
            return None
        noise = found
    position_m, heading_rad = rounding(tracks.pose[:, :2]), rounding(tracks.pose[:, 2:])
    basis = _ROUNDED if position_m > noise.position_m else noise.basis
    return TrackingNoise(max(noise.position_m, position_m), max(noise.heading_rad, heading_rad), basis)


def rounding(values: Array) -> float:
    """The standard deviation of rounding, where all values of each column are multiples of a step; the columns' mean square."""
    return float(np.sqrt(np.mean([_grid(column) ** 2 for column in values.T]) / 12.0))


def _grid(values: Array) -> float:
    """The step of which all values are multiples, within a part of it; 0 where there is none."""
    each = np.unique(values)
    if len(each) < _FEWEST_STEPS:
        return 0.0
    apart = np.diff(each)
    wide = apart > apart.max() * 1e-9
    steps = np.round(apart / apart[wide].min())
    at = np.append(0.0, np.cumsum(steps))
    step, begin = np.polyfit(at, each, 1)
    return float(step) if np.abs(each - begin - step * at).max() < _GRID_EXACT * step else 0.0


def noise_at_rest(tracks: Tracks) -> tuple[TrackingNoise, int] | None:
    """The noise of poses at rest alone, and how many independent poses tell of it; None where these are too few."""
    rests = settled(list(told_to_stand(tracks)))
    poses = sum(len(rest.t_s) for rest in rests)
    if poses < FEWEST_AT_REST:
        return None
    still, creeping = (_pooled([_about(rest.t_s, rest.pose, order) for rest in rests], _AT_REST) for order in (0, 1))
    return (creeping if creeping.position_m < DRIFTS * still.position_m else still), poses - len(rests)


def _agree(resting: TrackingNoise, driving: TrackingNoise, freedom: int) -> bool:
    """Whether so many independent poses at rest, of two positions and a heading each, may scatter as those while it drives."""
    pairs = (resting.position_m, driving.position_m, 2), (resting.heading_rad, driving.heading_rad, 1)
    return all(
        min(a, b) > 0 and abs(np.log(a / b)) < AGREES * _SE / np.sqrt(channels * freedom) for a, b, channels in pairs
    )


def _about(t_s: Array, pose: Array, order: int) -> Array:
    """Deviations from a polynomial in time, of the size that independent noise has."""
    powers = np.vander(t_s - t_s.mean(), order + 1)
    spare = np.sqrt(len(pose) / (len(pose) - 1 - order))
    out: Array = (pose - powers @ np.linalg.lstsq(powers, pose, rcond=None)[0]) * spare
    return out


def _pooled(parts: list[Array], basis: str) -> TrackingNoise:
    off = np.concatenate(parts)
    return TrackingNoise(trimmed_sd(off[:, :2]), trimmed_sd(off[:, 2]), basis)


def _high_frequency(tracks: Tracks) -> TrackingNoise | None:
    """From what is left of a parabola through `WIDTH` frames of one command."""
    parts = []
    for trial, (a, b) in enumerate(pairwise(tracks.first)):
        t_s = tracks.t_s[a:b]
        if b - a < WIDTH or np.median(np.diff(t_s)) > 1 / SLOWEST_HZ:
            continue
        command = command_of_frames(tracks, trial)
        values = np.column_stack([tracks.pose[a:b, :2], np.unwrap(tracks.pose[a:b, 2])])
        held = np.append(False, (np.diff(values, axis=0) == 0).all(axis=1))
        one = command[WIDTH - 1 :] == command[: len(command) - WIDTH + 1]
        chosen = one & ~(np.convolve(held, np.ones(WIDTH), "valid") > 0)
        view = np.lib.stride_tricks.sliding_window_view
        makers = _residual_makers(view(t_s, WIDTH)[chosen], ORDER)
        left = np.einsum("wck,wk->wc", view(values, WIDTH, axis=0)[chosen], makers)
        parts.append(left / np.sqrt(makers[:, WIDTH // 2])[:, None])
    if sum(map(len, parts)) < FEWEST_AT_REST:
        return None
    return _pooled(parts, _DRIVING)


def _residual_makers(t_s: Array, order: int) -> Array:
    """What is left of the middle one of values at times (windows, width) after the best polynomial: its weights, alike.

    By polynomials that are orthogonal at these times, for frames come at uneven times, too.
    """
    middle = t_s.shape[1] // 2
    times = t_s - t_s.mean(axis=1, keepdims=True)
    out = np.zeros_like(times)
    out[:, middle] = 1.0
    found: list[Array] = []
    for _ in range(order + 1):
        one = times * found[-1] if found else np.ones_like(times)
        for other in found:
            one = one - (one * other).sum(axis=1, keepdims=True) * other
        one = one / np.linalg.norm(one, axis=1, keepdims=True)
        found.append(one)
        out -= one[:, middle, None] * one
    return out
