"""Lines across the floor at which wheels lose way, or gain it: joints of tiles and planks, edges of mats, cables.

A curve along a coordinate is far too wide for them, and where they are nobody knows. But a wheel that crosses one is off by about
as much as the next wheel that crosses it, in whichever trial, with whichever command. So the floor is cut into narrow strips in
every direction, and what single wheels moved beyond the model in one strip is compared between parts of the log. Only what was
driven with unlike commands counts: what depends on commands is alike in one place, too, where robots always do the same there.

The mean of wider strips is taken off first: what changes slowly over the floor is no line.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, fields

import numpy as np
from numpy.typing import NDArray

from bns.diagnose.data.robust import robust_sd
from bns.diagnose.data.tracks import Array, Tracks, command_of_frames
from bns.diagnose.estimate.fit import Fit
from bns.diagnose.estimate.fitting import Problem
from bns.diagnose.predict.wheels import WheelPredictor
from bns.diagnose.residuals.unforeseen import unforeseen
from bns.diagnose.settings import DEFAULTS
from bns.physics.figures import mm

LEAST_Z = DEFAULTS.residuals.line_z
STEP_DEG = DEFAULTS.residuals.line_step_deg
NARROWEST_M = DEFAULTS.residuals.line_strip_m
WIDER = DEFAULTS.residuals.line_wider
GROUPS = DEFAULTS.residuals.line_groups
FRAMES = DEFAULTS.residuals.line_frames
STRIP_FRAMES = DEFAULTS.residuals.line_strip_frames
LEVELS = DEFAULTS.residuals.line_levels
_APART_RAD = math.radians(DEFAULTS.residuals.line_apart_deg)
MOST = DEFAULTS.residuals.line_most
SEEN_Z = DEFAULTS.residuals.line_seen_z
EVEN = DEFAULTS.residuals.line_even
FINER = DEFAULTS.residuals.line_finer
_CLIP = DEFAULTS.residuals.clip
_SHOWN = DEFAULTS.residuals.line_shown
_STRAIGHT_DEG = DEFAULTS.residuals.line_straight_deg


@dataclass(frozen=True)
class FloorLines:
    """Parallel lines: the direction across them (rad, from the x axis to the left), and where they are along it.

    ``at_m``: distances from the origin; ``spacing_m``: between neighbours where they are evenly spaced, else None. ``loss_m``:
    the way that a wheel loses at one (below 0: gains), the median of all; ``z``: standard errors of what trials have in common.
    """

    across_rad: float
    at_m: tuple[float, ...]
    spacing_m: float | None
    loss_m: float
    z: float

    @property
    def in_words(self) -> str:
        """What happens where, as a clause."""
        what = f"loses about {mm(self.loss_m)}" if self.loss_m >= 0 else f"gains about {mm(-self.loss_m)}"
        even = f", {self.spacing_m:.3g} m apart" if self.spacing_m is not None else ""
        return f"a wheel {what} of its way where it crosses a line on the floor, at {self._where}{even}"

    @property
    def _where(self) -> str:
        degrees = math.degrees(self.across_rad)
        places = ", ".join(f"{at:.2f}" for at in self.at_m[:_SHOWN])
        more = f" m and {len(self.at_m) - _SHOWN} more" if len(self.at_m) > _SHOWN else " m"
        for axis, direction in (("x", 0.0), ("y", 90.0)):
            if abs(degrees - direction) <= _STRAIGHT_DEG:
                return f"{axis} = {places}{more}"
        return f"{places}{more} from the origin in the direction of {degrees:.0f}°"



@dataclass(frozen=True)
class _Passes:
    """What single wheels moved beyond the model from frame to frame (m; ``moved``: in usual errors), where, and which way."""

    group: NDArray[np.int64]
    x: Array
    y: Array
    heading: Array
    off_m: Array
    moved: Array
    way_m: Array
    command: NDArray[np.int64]

    def but_at(self, lines: FloorLines, width_m: float) -> _Passes:
        """All but those within ``width_m`` of a line."""
        along = self.along(lines.across_rad)
        kept = (np.abs(along[:, None] - np.array(lines.at_m)) > width_m).all(axis=1)
        return _Passes(*(getattr(self, one.name)[kept] for one in fields(self)))

    def along(self, across_rad: float) -> Array:
        """Coordinate (m) in that direction."""
        return self.x * np.cos(across_rad) + self.y * np.sin(across_rad)


def what_to_look_for(lines: Sequence[FloorLines]) -> str:
    """A note on lines of one direction or two: how certain they are, and what they may be."""
    sure = min(one.z for one in lines)
    return (
        f"Parts of the log with unlike commands have errors in common at lines on the floor ({sure:.0f} standard errors). Look "
        "there for joints of tiles or planks, edges of mats, cables. Evenly spaced joints are the effects `floor-joints` and "
        "`floor-tiles`; no listed effect has other lines: drive elsewhere, or lay one sheet over them."
    )


def floor_lines(problem: Problem, fit: Fit) -> tuple[FloorLines, ...]:
    """The lines of each direction that has some, the surest first; none where nothing is certain.

    What moves there is left out before the next direction is looked for, so that no line is seen aslant.
    """
    tracks = problem.predictor.tracks
    if not isinstance(problem.predictor, WheelPredictor) or tracks.relative or len(tracks.t_s) < GROUPS * FRAMES:
        return ()
    passes = _passes(problem, fit)
    if not len(passes.x):
        return ()
    extent = max(float(np.ptp(passes.x)), float(np.ptp(passes.y)))
    step = math.radians(STEP_DEG)
    width = max(NARROWEST_M, extent * step, float(np.median(passes.way_m)))
    found: list[FloorLines] = []
    while len(found) < MOST:
        angles = [a for a in np.arange(0.0, math.pi, step) if all(_between(a, one.across_rad) > _APART_RAD for one in found)]
        z, angle = max((_alike(passes, angle, width), angle) for angle in angles)
        lines = _lines(passes, z, _closer(passes, angle, width, step), width / 2.0) if z >= LEAST_Z else None
        if lines is None:
            break
        found.append(lines)
        passes = passes.but_at(lines, width)
        if not len(passes.x):
            break
    return tuple(found)


def _passes(problem: Problem, fit: Fit) -> _Passes:
    tracks, off = problem.predictor.tracks, unforeseen(problem, fit)
    before = np.roll(tracks.pose, 1, axis=0)
    middle = (tracks.pose[:, :2] + before[:, :2]) / 2.0
    heading = before[:, 2] + np.angle(np.exp(1j * (tracks.pose[:, 2] - before[:, 2]))) / 2.0
    left, right, forced_s = _commanded(tracks)
    top = max(float(np.abs(tracks.left_m_s).max()), float(np.abs(tracks.right_m_s).max()), 1e-9)
    slower, faster = np.sort(np.round(np.abs([left, right]) / top * LEVELS), axis=0)  # mirrored and reversed is alike
    command = (slower * (LEVELS + 1) + faster) * 2 + (left * right < 0)
    group = np.arange(len(tracks.t_s)) * GROUPS // len(tracks.t_s)
    parts = []
    half_m = fit.model.wheelbase_m / 2.0
    for side, speed in ((1.0, left), (-1.0, right)):
        x, y = middle[:, 0] - side * half_m * np.sin(heading), middle[:, 1] + side * half_m * np.cos(heading)
        beyond = (off[:, 0] - side * half_m * off[:, 2]) * np.sign(speed)
        which = ~tracks.is_first & (speed != 0.0)
        usual = max(float(robust_sd(beyond[which])), 1e-12) if which.any() else 1.0
        moved = np.clip(beyond / usual, -_CLIP, _CLIP)
        columns = (group, x, y, heading, beyond, moved, np.abs(speed) * forced_s, command.astype(np.int64))
        parts.append([column[which] for column in columns])
    return _Passes(*(np.concatenate(columns) for columns in zip(*parts, strict=True)))


def _commanded(tracks: Tracks) -> tuple[Array, Array, Array]:
    """The wheels' commanded speeds (m/s) at each frame, and the time (s) from the frame before."""
    left, right = np.zeros(len(tracks.t_s)), np.zeros(len(tracks.t_s))
    for trial in range(len(tracks)):
        frames = slice(tracks.first[trial], tracks.first[trial + 1])
        at = np.minimum(command_of_frames(tracks, trial), tracks.duration_s.shape[1] - 1)
        left[frames], right[frames] = tracks.left_m_s[trial, at], tracks.right_m_s[trial, at]
    return left, right, np.diff(tracks.t_s, prepend=tracks.t_s[:1])


def _alike(passes: _Passes, across_rad: float, width_m: float) -> float:
    """Standard errors of what parts of the log have in common in the same strips, with unlike commands.

    Under chance parts are independent, so the products of each two are a sample of mean 0.
    """
    along = passes.along(across_rad)
    strip = np.floor((along - along.min()) / width_m).astype(np.int64)
    wide = strip // WIDER
    mean = np.bincount(wide, passes.moved) / np.maximum(np.bincount(wide), 1)
    moved = passes.moved - mean[wide]
    shared = _products(passes.group, strip, moved)
    like = _products(passes.group, strip * 2 * (LEVELS + 1) ** 2 + passes.command, moved)
    products = (shared - like)[np.triu_indices(GROUPS, 1)]
    size = float(np.sqrt((products**2).sum()))
    return float(products.sum()) / size if size > 0 else 0.0


def _products(group: NDArray[np.int64], cell: NDArray[np.int64], values: Array) -> Array:
    """For each two groups, the sum over cells of the products of their sums there, (groups, groups)."""
    from scipy.sparse import coo_array  # noqa: PLC0415  # slow to load

    _, of = np.unique(cell, return_inverse=True)
    sums = coo_array((values, (group, of)), shape=(GROUPS, int(of.max()) + 1)).tocsr()
    return np.asarray((sums @ sums.T).toarray())


def _closer(passes: _Passes, angle: float, width: float, step: float) -> float:
    """The direction in which narrower strips have the most in common, in ever smaller steps."""
    for _ in range(FINER):
        step, width = step / 2.0, max(width / 2.0, NARROWEST_M / 4.0)
        angle = max((angle + k * step for k in range(-3, 4)), key=lambda one: _alike(passes, one, width))
    return float(angle)


def _lines(passes: _Passes, z: float, across_rad: float, width: float) -> FloorLines | None:
    """Where the strips are in which wheels certainly move otherwise than in those around; None where none is certain alone."""
    turned = across_rad % math.pi
    turned -= math.pi if math.degrees(turned) > 90.0 + _STRAIGHT_DEG else 0.0
    along = passes.along(turned)
    first = float(along.min())
    strip = np.floor((along - first) / width).astype(np.int64)
    count, sums = np.bincount(strip), np.bincount(strip, passes.off_m)
    usual = float(np.median(passes.off_m))
    scatter = np.sqrt(np.bincount(strip, (passes.off_m - usual) ** 2) / np.maximum(count, 1))
    seen = np.where(count >= STRIP_FRAMES, (sums - usual * count) / np.maximum(scatter * np.sqrt(count), 1e-12), 0.0)
    crossed = np.bincount(strip, passes.way_m * np.abs(np.cos(passes.heading - turned))) / width  # how often, end to end
    lost = -(sums - usual * count) / np.maximum(crossed, 1e-12)
    sign = -1.0 if seen[np.abs(seen).argmax()] < 0 else 1.0
    at, losses = [], []
    for begin, end in _runs(sign * seen > SEEN_Z):
        weights = np.abs(seen[begin:end])
        at.append(first + width * float(weights @ (np.arange(begin, end) + 0.5)) / float(weights.sum()))
        losses.append(float(lost[max(begin - 1, 0) : end + 1].sum()))  # a wheel goes on losing beyond the line
    if not at:
        return None
    return FloorLines(turned, tuple(at), _spacing(at), float(np.median(losses)), z)


def _runs(where: NDArray[np.bool_]) -> Iterator[tuple[int, int]]:
    """Begin and end of each run of True, with gaps of one closed."""
    closed = where.copy()
    closed[1:-1] |= where[:-2] & where[2:]
    edges = np.flatnonzero(np.diff(np.concatenate([[False], closed, [False]]).astype(np.int64)))
    yield from zip(edges[::2].tolist(), edges[1::2].tolist(), strict=True)


def _spacing(at: list[float]) -> float | None:
    """The distance between neighbours, of which some may not have been seen; None where they are not evenly spaced, or few."""
    gaps = np.diff(np.sort(at))
    if len(gaps) < 2:
        return None
    base = float(np.median(gaps[gaps < 1.5 * gaps.min()]))
    times = np.round(gaps / base)
    base = float(gaps.sum() / max(times.sum(), 1.0))
    off = np.abs(gaps - np.round(gaps / base) * base)
    return base if float(off.max()) < EVEN * base else None


def _between(one: float, other: float) -> float:
    """Angle between two directions without sign, rad."""
    apart = abs(one - other) % math.pi
    return min(apart, math.pi - apart)
