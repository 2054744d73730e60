"""Do the poses' time stamps say when the poses were taken? Where they are given on arrival over a network, they scatter.

A tracker takes its poses evenly. If their stamps scatter, the intervals vary, but how far the robot gets from one pose to the
next does not follow them. Of poses that were really taken at uneven times, or some of which were lost, it does. So of each
interval's deviation from the mean of those around it, the way driven tells which part was real; no model has a say in it.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from bns.diagnose.data.robust import robust_sd
from bns.diagnose.data.tracks import Array, Tracks
from bns.diagnose.settings import DEFAULTS

AROUND = DEFAULTS.data.stamp_around
GAP = DEFAULTS.data.stamp_gap
BLOCK = DEFAULTS.data.stamp_block
FEWEST = DEFAULTS.data.stamp_fewest
CERTAIN_Z = DEFAULTS.data.stamp_z
REAL = DEFAULTS.data.stamp_real
CLOCK = DEFAULTS.data.stamp_clock
RATES, STEP = DEFAULTS.data.stamp_rates
PIECE, PIECES = DEFAULTS.data.stamp_pieces
STEPS, CLUSTERED, OFF = DEFAULTS.data.stamp_steps


@dataclass(frozen=True)
class StampScatter:
    """How the stamps scatter, while poses are taken evenly, every ``period_s``.

    ``sd_s``: standard deviation, from the way driven between poses, and ``se_s`` its standard error; ``intervals_s`` between
    poses (5, 50, 95 %); ``off_s`` (median, 95 %): distance from the nearest even grid, at most half a period by its nature;
    ``follows``: the part of the intervals' variance that the way driven follows (1: all of it is real); ``fast_m_s``: speed that
    5 % of the poses exceed; ``noise_m``: noise of a position across the path, which stamps do not touch.
    """

    period_s: float
    sd_s: float
    se_s: float
    intervals_s: tuple[float, float, float]
    off_s: tuple[float, float]
    follows: float
    fast_m_s: float
    noise_m: float

    @property
    def in_words(self) -> str:
        """What is odd, what it costs, what it looks like, and what to do."""
        low, middle, high = (f"{1e3 * v:.3g}" for v in self.intervals_s)
        near, far = (f"{1e3 * v:.2g}" for v in self.off_s)
        return (
            f"the poses' time stamps scatter: intervals between poses are {low} to {high} ms (5 to 95 %; median {middle} ms), "
            f"but the way driven between poses hardly follows them ({self.follows:.2f} of their variance is real). The tracker "
            f"takes a pose every {1e3 * self.period_s:.3g} ms; the stamps lie {near} ms (median) and {far} ms (95 %) from an "
            f"even grid, and by the way driven they scatter by {1e3 * self.sd_s:.2g} ms (standard deviation; standard error "
            f"{1e3 * self.se_s:.1g} ms). At {self.fast_m_s:.2g} m/s that is {1e3 * self.sd_s * self.fast_m_s:.2g} mm, beside "
            f"{1e3 * self.noise_m:.2g} mm of the tracker's own noise. Stamps that are given on arrival do this; their mean delay "
            "looks like a late command or a clock offset, their scatter like noise. Stamp poses when the picture is taken; or, "
            "if the tracker numbers its pictures, take t_s from the number (`scale`: the period, `offset`: the time of picture 0)"
        )


@dataclass(frozen=True)
class _Steps:
    """From pose to pose: by how much the interval, at the speed there, is too long (m), and by how much the way is (m);
    speed (m/s); way across the path (m); number of the block of neighbours."""

    interval_m: Array
    way_m: Array
    speed_m_s: Array
    across_m: Array
    block: Array


def stamp_scatter(tracks: Tracks) -> StampScatter | None:
    """The scatter of the stamps, where it is certain and costs more than the tracker's noise; else None."""
    tracked = list(_fresh(tracks))
    if sum(len(t_s) for t_s, _ in tracked) < FEWEST:
        return None
    intervals = np.concatenate([np.diff(t_s) for t_s, _ in tracked])
    steps = _steps(tracked, GAP * float(np.median(intervals)))
    if len(steps.way_m) < FEWEST or not steps.interval_m.any():
        return None
    x, y, weight = steps.interval_m, steps.way_m, float(steps.speed_m_s @ steps.speed_m_s)
    unreal = x * (x - y)  # expected: speed squared times twice the variance of a stamp's error
    variance = float(unreal.sum()) / weight / 2
    blocks = np.bincount(steps.block.astype(int), unreal - 2 * variance * steps.speed_m_s**2)
    variance_se = float(np.sqrt(blocks @ blocks)) / weight / 2
    follows = float(np.clip((x @ y) / (x @ x), 0.0, 1.0))
    if variance <= CERTAIN_Z * variance_se or follows > REAL:
        return None
    sd_s, fast = float(np.sqrt(variance)), float(np.quantile(steps.speed_m_s, 0.95))
    noise = float(robust_sd(steps.across_m) / np.sqrt(2))
    if sd_s * fast < noise or sd_s < _resolution(intervals) / 2:
        return None
    clock = _clock([t_s for t_s, _ in tracked], float(np.median(intervals)))
    if clock is None or np.sqrt(np.mean(clock[1] ** 2)) * fast < noise:  # only the grid itself: poses were lost
        return None
    period_s, off_s = clock
    low, middle, high = (float(v) for v in np.quantile(intervals, [0.05, 0.5, 0.95]))
    near, far = (float(v) for v in np.quantile(np.abs(off_s), [0.5, 0.95]))
    se_s = variance_se / (2 * sd_s)
    return StampScatter(period_s, sd_s, se_s, (low, middle, high), (near, far), follows, fast, noise)


def _fresh(tracks: Tracks) -> Iterator[tuple[Array, Array]]:
    """Times (n,) and positions (n, 2) of each stretch without a jump, without poses that repeat the one before."""
    begins = np.flatnonzero(tracks.is_first)
    for a, b in pairwise([*begins, len(tracks.t_s)]):
        new = np.append(True, (np.diff(tracks.pose[a:b], axis=0) != 0).any(axis=1))
        if new.sum() > 2 * AROUND + 1:
            yield tracks.t_s[a:b][new], tracks.pose[a:b, :2][new]


def _steps(tracked: list[tuple[Array, Array]], gap_s: float) -> _Steps:
    """All steps that have `AROUND` more before and after them, none of which lasts longer than ``gap_s``."""
    found: list[tuple[Array, ...]] = []
    width, blocks = 2 * AROUND + 1, 0
    for t_s, position in tracked:
        lasted = np.diff(t_s)
        whole = np.convolve(lasted > gap_s, np.ones(width), "valid") == 0
        first = np.flatnonzero(whole)
        if not len(first):
            continue
        chord, span_s = position[first + width] - position[first], t_s[first + width] - t_s[first]
        length = np.hypot(*chord.T)
        along = chord / np.maximum(length, np.finfo(float).tiny)[:, None]
        moved = np.diff(position, axis=0)[first + AROUND]
        speed = length / span_s
        interval_m = speed * (lasted[first + AROUND] - span_s / width)
        way_m = (moved * along).sum(axis=1) - length / width
        block = np.asarray(blocks + np.arange(len(first)) // BLOCK, dtype=float)
        across_m = moved[:, 1] * along[:, 0] - moved[:, 0] * along[:, 1]
        found.append((interval_m, way_m, speed, across_m, block))
        blocks = int(block[-1]) + 1
    if not found:
        return _Steps(*np.zeros((5, 0)))
    return _Steps(*(np.concatenate(part) for part in zip(*found, strict=True)))


def _resolution(intervals: Array) -> float:
    """The step of rounded stamps, or of a logger that keeps a pose until its next row, s: intervals are multiples of it."""
    usual = float(np.median(intervals))
    for parts in range(2, STEPS + 1):
        times = intervals * (parts / usual)
        whole = np.round(times)
        if np.sqrt(np.mean((times - whole) ** 2)) < CLUSTERED and np.mean(whole % parts != 0) > OFF:
            return usual / parts
    return 0.0


def _clock(stretches: list[Array], usual_s: float) -> tuple[float, Array] | None:
    """Period (s) of the tracker's clock and how far every stamp lies off its grid (s); None where no clock is seen.

    Of all rates, that of a clock stands out; poses taken at uneven times, or whenever the robot has got so far, have none.
    """
    pieces = [p for t_s in stretches for p in np.array_split(t_s, -(-len(t_s) // PIECE))]
    pieces = pieces[:: -(-len(pieces) // PIECES)]
    longest_s = max(float(np.ptp(p)) for p in pieces)
    rates = np.arange((1 - RATES) / usual_s, (1 + RATES) / usual_s, STEP / longest_s)
    together = sum(np.abs(_phasors(p, rates).sum(axis=1)) for p in pieces)
    best = int(np.argmax(together))
    if together[best] < CLOCK * np.median(together):
        return None
    phasors = [_phasors(p, rates[best : best + 1])[0] for p in pieces]
    off = np.concatenate([np.angle(z * np.conj(z.sum())) for z in phasors]) / (2 * np.pi * rates[best])
    return float(1 / rates[best]), off


def _phasors(t_s: Array, rates: Array) -> Array:
    """Where in the rounds of clocks of these rates (Hz) the times lie, as complex numbers, (rates, times)."""
    out: Array = np.exp(2j * np.pi * rates[:, None] * (t_s - t_s[0]))
    return out
