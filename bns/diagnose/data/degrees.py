"""Headings in degrees where radians must be: told without the wheelbase, which makes 57 times as much of a turn of its own.

Two things tell. The robot drives where it points only if its headings are read as degrees; or it turns further than the smallest
robot can, and its headings are too large for radians.
"""

from __future__ import annotations

import math

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from bns.diagnose.settings import DEFAULTS

Array = NDArray[np.float64]
_AGREE, _DISAGREE = DEFAULTS.data.degrees_directions
_LEFT = DEFAULTS.data.degrees_left
_FAST, _FASTER = DEFAULTS.data.degrees_rates_rad_m
_BEYOND = DEFAULTS.data.degrees_beyond
_FEWEST = DEFAULTS.predict.robot_fewest
_ROUND = math.degrees(math.tau)


def look_like_degrees(table: pd.DataFrame, told: Array, moved: Array, ends: Array) -> bool:
    """``told`` (windows, 3): way in all, way forwards (m), turn (rad, on a wheelbase of 1 m), as commanded.

    ``moved`` (windows, 2): along x and y, m; ``ends`` (windows, 2): the headings at begin and end, as they were logged.
    """
    in_radians, in_degrees = (_agreement(told, moved, size * ends) for size in (1.0, np.pi / 180.0))
    unread, rate = _agreement(told, moved, 0.0 * ends), _rate(told[:, 2], np.diff(ends)[:, 0])
    clear = 1.0 - in_degrees <= _LEFT * (1.0 - unread) or rate > _FAST
    if in_degrees >= _AGREE and in_radians <= _DISAGREE and clear:
        return True
    large = float(table["heading_rad"].abs().max()) > _BEYOND
    return large and not in_radians >= _AGREE and rate > _FASTER


def _agreement(told: Array, moved: Array, ends: Array) -> float:
    """How well headings agree with the directions of motion, either way round and from any zero: 1 all, 0 none.

    Not a number where too few windows tell.
    """
    went = np.hypot(*moved.T)
    usual = float(np.median(went[went > 0])) if (went > 0).any() else np.inf
    good = (np.abs(told[:, 1]) > 0.9 * told[:, 0]) & (told[:, 0] > 0) & (went >= usual / 2.0)
    if good.sum() < _FEWEST:
        return float("nan")
    backwards = np.where(told[good, 1] < 0, np.pi, 0.0)
    towards = np.arctan2(moved[good, 1], moved[good, 0]) + backwards
    middle = np.angle(np.exp(1j * ends[good]).sum(axis=1))
    return max(float(abs(np.exp(1j * (towards - sense * middle)).mean())) for sense in (1.0, -1.0))


def _rate(told: Array, turned: Array) -> float:
    """Typical turn per metre of wheel difference, where much was commanded; not of headings that were wrapped there."""
    told, turned = np.abs(told), np.abs(turned)
    wide = (told > 0) & (turned < _ROUND / 2.0)
    wide &= told >= (np.median(told[wide]) if wide.any() else np.inf)
    return float(np.median(turned[wide] / told[wide])) if wide.sum() >= _FEWEST else 0.0
