"""Where a robot may drive and what it may be told, from the measurements, the robot's own bounds and the user."""

from __future__ import annotations

from typing import cast

import numpy as np

from bns.diagnose.data.tracks import Array, Tracks
from bns.diagnose.data.units import FASTEST_M_S
from bns.diagnose.design.sequences import MARGIN_M, Arena, Bounds
from bns.diagnose.settings import DEFAULTS
from bns.errors import DataError, in_both
from bns.physics.model import Model
from bns.robots import load_robot, robot_names
from bns.robots.base import TwoWheeled

_TOGETHER_M = DEFAULTS.design.together_m
_TRIAL_S = DEFAULTS.design.trial_s
_HEADING_RAD = DEFAULTS.design.heading_rad
_LARGEST_M = DEFAULTS.design.largest_m
_ARENA = in_both("--arena 1.8x1.3, in metres", "arena=(1.8, 1.3)")
START = in_both("--start X,Y,DEGREES, such as --start 0,0,90", "start=(x_m, y_m, heading_rad)")
_SPEEDS = in_both("--speeds=LOW,HIGH, such as --speeds=-0.2,0.2", "speeds=(-0.2, 0.2)")


def arena_of(
    tracks: Tracks, size: tuple[float, ...] | None = None, start: tuple[float, float, float] | None = None
) -> Arena:
    """The arena and the start of every trial.

    The arena is where the robot was seen; or ``size``: (width, height) in m around the start, or (lowest x, highest x, lowest y,
    highest y) in m.

    The start is ``start`` (x_m, y_m, heading_rad), else where the trials seen so far started if that was one place, which the
    arena then includes, else the arena's middle, facing north. DataError for what is no arena or start.
    """
    begins = tracks.pose[tracks.first[:-1]]
    middle = np.median(begins[:, :2], axis=0)
    together = float(np.median(np.hypot(*(begins[:, :2] - middle).T))) < _TOGETHER_M
    low, high = np.quantile(tracks.pose[:, :2], [0.005, 0.995], axis=0)
    begin = None if start is None else _checked_start(start)
    if begin is None and together:
        turn = np.angle(np.exp(1j * begins[:, 2]).mean())
        begin = (float(middle[0]), float(middle[1]), float(turn))
    if isinstance(size, list | tuple) and len(size) == 4:
        low, high = _checked_sides(size)
    elif size is not None:
        centre = np.array(begin[:2]) if begin is not None else (low + high) / 2
        half = _checked_size(size) / 2
        low, high = centre - half, centre + half
    elif begin is not None and start is None:  # nobody chose either: the robot may stand where it always started
        around_m = MARGIN_M + 1e-9  # it holds the place whatever is rounded
        low, high = np.minimum(low, np.array(begin[:2]) - around_m), np.maximum(high, np.array(begin[:2]) + around_m)
    centre = (low + high) / 2
    begin = begin or (float(centre[0]), float(centre[1]), _HEADING_RAD)
    arena = Arena(float(low[0]), float(high[0]), float(low[1]), float(high[1]), begin)
    if not bool(arena.holds(np.array(begin[0]), np.array(begin[1]))):
        raise DataError(
            f"The start x = {begin[0]:.2f}, y = {begin[1]:.2f} m lies outside of the arena, x {low[0]:.2f} to {high[0]:.2f} m, "
            f"y {low[1]:.2f} to {high[1]:.2f} m less {100 * MARGIN_M:.0f} cm. Give {_ARENA} around the start."
        )
    return arena


def bounds_of(tracks: Tracks, model: Model, speeds: tuple[float, float] | None = None) -> Bounds:
    """Speeds and durations that the robot takes, together with those seen; ``speeds`` (lowest, highest in m/s) replaces the
    former. DataError for what is no range."""
    lasting = tracks.duration_s > 0
    if not lasting.any():
        raise DataError("No command in these measurements has a duration; log poses before and after commands.")
    commanded = np.concatenate([tracks.left_m_s[lasting], tracks.right_m_s[lasting]])
    low, high = float(commanded.min()), float(commanded.max())
    short, long = (float(v) for v in np.quantile(tracks.duration_s[lasting], [0.02, 0.98]))
    name = str(model.provenance.get("begun_from", model.name)).removesuffix("-world")
    robot = load_robot(name) if name in robot_names() else None
    takes = (np.inf, -np.inf)
    if robot is not None and robot.two_wheeled:
        left, _, lasts = cast(TwoWheeled, robot).wheel_speeds_m_s(
            np.stack([robot.bounds.low, robot.bounds.high]).astype(float)
        )
        takes = float(left[0]), float(left[1])
        low, high = min(low, takes[0]), max(high, takes[1])
        short, long = min(short, float(lasts[0])), max(long, float(lasts[1]))
    if speeds is not None:
        low, high = _checked_speeds(speeds)
    per_trial = float(np.median(tracks.duration_s.sum(axis=1)))
    grid_s = 0.04
    short = max(round(short / grid_s), 1) * grid_s
    drives = name if takes[0] <= low and high <= takes[1] else ""
    return Bounds(low, high, short, max(long, short), float(np.clip(per_trial, *_TRIAL_S)), grid_s, drives)


def _checked_size(size: tuple[float, ...]) -> Array:
    sides = _numbers(size, 2)
    if sides is None or not (sides > 2 * MARGIN_M).all() or not (sides < _LARGEST_M).all():
        raise DataError(
            f"The arena's size is {size!r}; it must be width and height in metres, each above {2 * MARGIN_M:g} and below "
            f"{_LARGEST_M:g}: {_ARENA}."
        )
    return sides


def _checked_sides(sides: tuple[float, ...]) -> tuple[Array, Array]:
    """Lowest and highest x and y of an arena that is given by its sides."""
    ends = _numbers(sides, 4)
    if ends is None or not ends[0] < ends[1] or not ends[2] < ends[3]:
        raise DataError(
            f"The arena's sides are {sides!r}; they must be lowest x, highest x, lowest y, highest y in metres: "
            f"{in_both('--arena=-0.5,1.2,0,0.9', 'arena=(-0.5, 1.2, 0.0, 0.9)')}."
        )
    _checked_size((float(ends[1] - ends[0]), float(ends[3] - ends[2])))
    return ends[[0, 2]], ends[[1, 3]]


def _checked_start(start: tuple[float, float, float]) -> tuple[float, float, float]:
    pose = _numbers(start, 3)
    if pose is None:
        raise DataError(
            f"The start is {start!r}; it must be three numbers: {START}."
        )
    if abs(pose[2]) > 2 * np.pi + 1e-9:
        raise DataError(
            f"The start's heading is {pose[2]:g} rad, more than a whole round. In Python it is in radians "
            f"({np.radians(pose[2]):.4g} for {pose[2]:g} degrees), on the command line in degrees."
        )
    return float(pose[0]), float(pose[1]), float(pose[2])


def _checked_speeds(speeds: tuple[float, float]) -> tuple[float, float]:
    pair = _numbers(speeds, 2)
    if pair is None or not pair[0] < pair[1]:
        raise DataError(
            f"The wheels' speeds are {speeds!r}; they must be the lowest and the highest in m/s: {_SPEEDS}."
        )
    if np.abs(pair).max() > FASTEST_M_S:
        raise DataError(
            f"The wheels' speeds are {speeds!r}; speeds above {FASTEST_M_S:g} m/s look like mm/s or a device's units; give "
            f"m/s: {_SPEEDS}."
        )
    return float(pair[0]), float(pair[1])


def _numbers(given: object, count: int) -> Array | None:
    """So many finite numbers, or None."""
    try:
        values = np.asarray(given, dtype=np.float64)
    except (TypeError, ValueError):
        return None
    return values if values.shape == (count,) and np.isfinite(values).all() else None
