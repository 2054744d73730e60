"""Where a robot may drive and what it may be told, from the measurements, the robot's own bounds and the user."""

from __future__ import annotations

import re

import numpy as np

from bns.diagnose.data.tracks import Tracks
from bns.diagnose.design.sequences import MARGIN_M, Arena, Bounds
from bns.errors import DataError
from bns.physics.model import Model
from bns.robots import load_robot, robot_names

_TOGETHER_M = 0.15
_TRIAL_S = (6.0, 25.0)
_HEADING_RAD = np.pi / 2


def arena_of(tracks: Tracks, size: str | None, start: str | None) -> Arena:
    """The arena: where the robot was seen, or WxH metres around it; and the start of every trial.

    The start is ``start`` (X,Y,DEGREES), else where the trials seen so far started if that was one place, else the arena's
    middle, facing north. DataError for what is no arena or start.
    """
    begins = tracks.pose[tracks.first[:-1]]
    middle = np.median(begins[:, :2], axis=0)
    together = float(np.median(np.hypot(*(begins[:, :2] - middle).T))) < _TOGETHER_M
    low, high = np.quantile(tracks.pose[:, :2], [0.005, 0.995], axis=0)
    begin = _start(start) if start else None
    if begin is None and together:
        turn = np.angle(np.exp(1j * begins[:, 2]).mean())
        begin = (float(middle[0]), float(middle[1]), float(turn))
    if size is not None:
        centre = np.array(begin[:2]) if begin is not None else (low + high) / 2
        half = _size(size) / 2
        low, high = centre - half, centre + half
    centre = (low + high) / 2
    begin = begin or (float(centre[0]), float(centre[1]), _HEADING_RAD)
    arena = Arena(float(low[0]), float(high[0]), float(low[1]), float(high[1]), begin)
    if not bool(arena.holds(np.array(begin[0]), np.array(begin[1]))):
        raise DataError(
            f"The start x = {begin[0]:.2f}, y = {begin[1]:.2f} m lies outside of the arena, x {low[0]:.2f} to {high[0]:.2f} m, "
            f"y {low[1]:.2f} to {high[1]:.2f} m less {100 * MARGIN_M:.0f} cm. Give --arena WxH (metres) around the start."
        )
    return arena


def bounds_of(tracks: Tracks, model: Model, speeds: str | None) -> Bounds:
    """Speeds and durations that the robot takes, together with those seen; ``speeds`` (LOW,HIGH in m/s) replaces the former."""
    lasting = tracks.duration_s > 0
    if not lasting.any():
        raise DataError("No command of these measurements lasts any time; log poses before and after commands.")
    commanded = np.concatenate([tracks.left_m_s[lasting], tracks.right_m_s[lasting]])
    low, high = float(commanded.min()), float(commanded.max())
    short, long = (float(v) for v in np.quantile(tracks.duration_s[lasting], [0.02, 0.98]))
    name = str(model.provenance.get("begun_from", model.name)).removesuffix("-world")
    robot = load_robot(name) if name in robot_names() else None
    if robot is not None and hasattr(robot, "wheel_speeds_m_s"):
        left, _, lasts = robot.wheel_speeds_m_s(np.stack([robot.bounds.low, robot.bounds.high]).astype(float))
        low, high = min(low, float(left[0])), max(high, float(left[1]))
        short, long = min(short, float(lasts[0])), max(long, float(lasts[1]))
    if speeds is not None:
        low, high = _pair(speeds, "--speeds", "LOW,HIGH in m/s, such as --speeds=-0.2,0.2")
    per_trial = float(np.median(tracks.duration_s.sum(axis=1)))
    grid_s = 0.04
    short = max(round(short / grid_s), 1) * grid_s
    return Bounds(low, high, short, max(long, short), float(np.clip(per_trial, *_TRIAL_S)), grid_s)


def _size(text: str) -> np.ndarray:
    match = re.fullmatch(r"\s*([0-9.]+)\s*[xX×]\s*([0-9.]+)\s*", text)
    try:
        size = np.array([float(v) for v in match.groups()]) if match else None
    except ValueError:
        size = None
    if size is None or not (size > 2 * MARGIN_M).all() or not (size < 1000).all():
        raise DataError(f"--arena {text!r} is no size; write width x height in metres, each above 0.1: --arena 1.8x1.3")
    return size


def _start(text: str) -> tuple[float, float, float]:
    try:
        x, y, degrees = (float(v) for v in text.split(","))
    except ValueError:
        x = y = degrees = np.nan
    if not np.isfinite([x, y, degrees]).all():
        raise DataError(
            f"--start {text!r} is no pose; write X,Y,DEGREES (metres; 0 faces east, 90 north): --start 0,0,90"
        )
    return x, y, float(np.radians(degrees))


def _pair(text: str, option: str, wanted: str) -> tuple[float, float]:
    try:
        low, high = (float(v) for v in text.split(","))
    except ValueError:
        low = high = np.nan
    if not (np.isfinite([low, high]).all() and low < high):
        raise DataError(f"{option} {text!r} is no range; write {wanted}.")
    return low, high
