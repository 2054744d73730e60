"""Rows of parallel joints on the floor: when a wheel crosses one, and where rows seem to be in what was tracked."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from bns.physics.signals import Array, Wheels
from bns.physics.wheels.scans import crossings

_OVER_M = 0.01
"""Over which way a wheel loses what it loses at a joint, where a fit begins."""
_PIECE_S = 0.1
"""Ways are compared over pieces at least so long: shorter ones are the tracker's noise, longer ones blur where a joint is."""
_CELLS = 256
"""The floor is a map of so many cells a side, of which the power spectrum is taken."""
_RINGS = 24
_CERTAIN = 14.0
"""Power of a peak, in mean powers at that wavelength. Of some 30,000 independent powers one is beyond 14 by chance in 3 of 100
logs. A false one costs a fit, since what is found here only begins one."""
_PEAKS, _HARMONICS, _FINER = 6, 4, 4
_FEWEST, _MOST = 200, 20_000
_ROWS = 3
_ASIDE_RAD = 0.05
_FEWEST_JOINTS, _OFTEN, _AS_MUCH, _MISSING = 3, 0.1, 0.4, 0.25
"""At least so many joints, of those crossed a tenth as often as the most crossed one, lose this share of what all lose, and
no more than a quarter of them do not. A single line is no row, whatever spacing fits it."""


@dataclass(frozen=True)
class Joints:
    """Lines where x·cos ``across_rad`` + y·sin ``across_rad`` is ``at_m`` plus a multiple of ``spacing_m``, ``over_m`` wide."""

    across_rad: float
    spacing_m: float
    at_m: float
    over_m: float = _OVER_M

    def passed(self, along_m: Array) -> Array:
        """How many joints lie behind places along the direction across, counted from one of them; in between while on one."""
        along = (along_m - self.at_m) / self.spacing_m
        nearest = np.round(along)
        out: Array = nearest + np.clip((along - nearest) * max(self.spacing_m / self.over_m, 1.0), -0.5, 0.5)
        return out


def crossed(place: Array, step_s: Array, aside_m: float, speed_m_s: Array, joints: Joints) -> Array:
    """How many joints a point ``aside_m`` to the left of the robot crosses in each step, (batch, steps), the way it drives.

    ``place``: in the middle of each step. Where one step ends the next begins, so that no joint is passed twice or not at all.
    """
    turned = place[..., 2] - joints.across_rad
    along = place[..., 0] * np.cos(joints.across_rad) + place[..., 1] * np.sin(joints.across_rad) - aside_m * np.sin(turned)
    ahead = np.sign(speed_m_s) * np.sign(np.cos(turned))
    out: Array = crossings(along - joints.at_m, step_s, ahead, joints.spacing_m, joints.over_m)
    return out


@dataclass(frozen=True)
class _Ways:
    """Of single wheels in pieces of `_PIECE_S`: where (m), how the robot heads, the way told and what was lost of it (m)."""

    x: Array
    y: Array
    heading: Array
    told: Array
    lost: Array

    def thinned(self) -> _Ways:
        """At most `_MOST` pieces, evenly chosen: enough to see where a peak of all of them is."""
        every = len(self.told) // _MOST + 1
        return _Ways(self.x[::every], self.y[::every], self.heading[::every], self.told[::every], self.lost[::every])


def rows_of_joints(wheels: Wheels) -> list[tuple[Joints, float]]:
    """Rows at which tracked wheels seem to lose way, the surest first, each with the way lost (m); none where nothing stands out.

    What wheels lost, laid out on a map of the floor: a row is a peak of its power spectrum, with its harmonics.
    """
    ways = _ways(wheels)
    if len(ways.told) < _FEWEST:
        return []
    found, few = [], ways.thinned()
    for east, north in _peaks(ways):
        score, row = _closest(few, east, north)
        found.append((score, row))
    rows: list[tuple[Joints, float]] = []
    for _, row in sorted(found, key=lambda one: -one[0]):
        loss = _loss(ways, row)
        if loss != 0.0 and all(_apart(row, other) > _ASIDE_RAD for other, _ in rows):  # else its own harmonic
            rows.append((row, loss))
    return rows[:_ROWS]


def _apart(one: Joints, other: Joints) -> float:
    away = abs(one.across_rad - other.across_rad) % np.pi
    return float(min(away, np.pi - away))


def _ways(wheels: Wheels) -> _Ways:
    seen, steps = wheels.conditions.seen, wheels.step_s
    if seen is None or not (steps > 0).any():
        return _Ways(*(np.zeros(0) for _ in range(5)))
    k = max(round(_PIECE_S / float(np.median(steps[steps > 0]))), 1)
    half, pose = wheels.wheelbase_m / 2.0, seen[:, ::k]
    moved, middle = np.diff(pose, axis=1), (pose[:, 1:] + pose[:, :-1]) / 2.0
    ahead = moved[..., 0] * np.cos(middle[..., 2]) + moved[..., 1] * np.sin(middle[..., 2])
    columns = []
    for side, speed in ((1.0, wheels.left_m_s), (-1.0, wheels.right_m_s)):
        driven = np.cumsum(speed * steps, axis=1) - speed * steps / 2.0
        told = np.diff(driven[:, ::k], axis=1)
        got = ahead - side * half * moved[..., 2]
        x, y = middle[..., 0] - side * half * np.sin(middle[..., 2]), middle[..., 1] + side * half * np.cos(middle[..., 2])
        steady = np.isfinite(got) & (np.abs(told) > 0.1 * np.quantile(np.abs(told), 0.9))
        way, came = np.abs(told[steady]), np.sign(told[steady]) * got[steady]
        lost = way * float(way @ came) / max(float(way @ way), 1e-12) - came
        spread = float(np.quantile(np.abs(lost), 0.68)) if len(lost) else 0.0
        lost = np.clip(lost, -5.0 * spread, 5.0 * spread)
        columns.append((x[steady], y[steady], middle[..., 2][steady], way, lost))
    return _Ways(*(np.concatenate(pair) for pair in zip(*columns, strict=True)))


def _peaks(ways: _Ways) -> list[tuple[float, float]]:
    """The wave vectors (cycles/m, east and north) whose power stands out from that of others as long."""
    extent = max(float(np.ptp(ways.x)), float(np.ptp(ways.y)), 1e-6)
    cell = extent / _CELLS
    at = [np.floor((v - v.min()) / cell).astype(np.int64).clip(0, _CELLS - 1) for v in (ways.x, ways.y)]
    chart = np.zeros((2 * _CELLS, 2 * _CELLS))
    np.add.at(chart, tuple(at), ways.lost)
    power = np.abs(np.fft.rfft2(chart)) ** 2
    east, north = np.fft.fftfreq(2 * _CELLS, cell)[:, None], np.fft.rfftfreq(2 * _CELLS, cell)[None, :]
    waves = np.hypot(east, north) * np.ones_like(power)
    shortest = 2.0 * max(float(np.median(ways.told)), cell)
    looked = (waves > 1.5 / extent) & (waves < 1.0 / shortest)
    if not looked.any():
        return []
    edges = np.quantile(waves[looked], np.linspace(0.0, 1.0, _RINGS + 1))
    relative = np.zeros_like(power)
    for low, high in pairwise(edges):
        ring = looked & (waves >= low) & (waves <= high)
        relative[ring] = power[ring] * np.log(2.0) / max(float(np.median(power[ring])), 1e-300)
    found: list[tuple[float, float]] = []
    for _ in range(_PEAKS):
        i, j = np.unravel_index(int(relative.argmax()), relative.shape)
        if relative[i, j] < _CERTAIN:
            break
        found.append((float(east[i, 0]), float(north[0, j])))
        relative[np.hypot(east - east[i], north - north[0, j]) < 2.0 / extent] = 0.0
        relative[np.hypot(east + east[i], north + north[0, j]) < 2.0 / extent] = 0.0
    return found


def _closest(ways: _Ways, east: float, north: float) -> tuple[float, Joints]:
    """The row near a wave vector, or half or a third of it, whose harmonics are strongest together, and their sum."""
    extent = max(float(np.ptp(ways.x)), float(np.ptp(ways.y)))
    best = (-1.0, east, north)
    for part in (1.0, 0.5, 1.0 / 3.0):
        if np.hypot(east, north) * part * extent < 1.5:
            continue
        here, step = np.array([east, north]) * part, 0.25 / extent
        power = _comb(ways, here)
        for _ in range(_FINER):
            while True:
                around = [here + step * np.array(d) for d in ((1, 0), (-1, 0), (0, 1), (0, -1))]
                powers = [_comb(ways, one) for one in around]
                if max(powers) <= power:
                    break
                here, power = around[int(np.argmax(powers))], max(powers)
            step /= 2.5
        if power > best[0]:
            best = (power, float(here[0]), float(here[1]))
    power, east, north = best
    across = float(np.arctan2(north, east))
    across += -np.pi if across > np.pi / 2.0 else np.pi if across <= -np.pi / 2.0 else 0.0
    row = Joints(across, float(1.0 / np.hypot(east, north)), 0.0)
    return power, Joints(across, row.spacing_m, _offset(ways, row))


def _waves(ways: _Ways, vector: Array) -> Array:
    """What was lost, as a sum over waves of this vector and its harmonics, complex (harmonics,)."""
    turns = np.exp(-2j * np.pi * (ways.x * vector[0] + ways.y * vector[1]))
    power, out = np.ones_like(turns), []
    for _ in range(_HARMONICS):
        power = power * turns
        out.append(ways.lost @ power)
    return np.array(out)


def _comb(ways: _Ways, vector: Array) -> float:
    return float((np.abs(_waves(ways, vector)) ** 2).sum())


def _offset(ways: _Ways, row: Joints) -> float:
    """Where in a period most is lost, or gained."""
    vector = np.array([np.cos(row.across_rad), np.sin(row.across_rad)]) / row.spacing_m
    waves, at = _waves(ways, vector), np.linspace(0.0, 1.0, 200, endpoint=False)
    series = (waves[:, None] * np.exp(2j * np.pi * np.arange(1, _HARMONICS + 1)[:, None] * at)).real.sum(axis=0)
    at_m = float(at[int(np.abs(series).argmax())]) * row.spacing_m
    return at_m - row.spacing_m if at_m > row.spacing_m / 2.0 else at_m


def _loss(ways: _Ways, row: Joints) -> float:
    """The way lost at each, by least squares beside what is lost everywhere; 0 where not several joints lose as much."""
    middle = ways.x * np.cos(row.across_rad) + ways.y * np.sin(row.across_rad)
    reach = ways.told * np.abs(np.cos(ways.heading - row.across_rad)) / 2.0
    times = (row.passed(middle + reach) - row.passed(middle - reach)).clip(0.0)
    own = times - ways.told * float(ways.told @ times) / max(float(ways.told @ ways.told), 1e-12)
    which = np.round((middle - row.at_m) / row.spacing_m).astype(np.int64)
    which -= which.min()
    often, lost = np.bincount(which, own**2), np.bincount(which, own * ways.lost)
    loss = float(lost.sum() / max(float(often.sum()), 1e-12))
    known = often > _OFTEN * often.max()
    alike = known & (lost / np.maximum(often, 1e-12) * np.sign(loss) > _AS_MUCH * abs(loss))
    return loss if alike.sum() >= max(_FEWEST_JOINTS, (1.0 - _MISSING) * known.sum()) else 0.0
