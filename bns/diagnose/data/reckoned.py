"""Poses that were computed from the commands instead of tracked: dead reckoning, or a simulation without noise."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import pandas as pd

from bns.diagnose.settings import DEFAULTS
from bns.measurements import COMMANDS, POSE

EXACT = DEFAULTS.data.reckoned_share
FEWEST = DEFAULTS.data.reckoned_fewest


def reckoned(table: pd.DataFrame, trials: Sequence[tuple[str, np.ndarray]]) -> tuple[int, str] | None:
    """The first row (from 0) and what is odd, if the way from pose to pose is that of the commands, as no motor and tracker are.

    The way that a robot is told while one command lasts, and the way between poses then, have one ratio to `EXACT` of themselves
    in most steps; so have turns. A command may hold from its row on or until it. ``trials``: names and row numbers.
    """
    t, pose = table["t_s"].to_numpy(dtype=float), table[list(POSE)].to_numpy(dtype=float)
    told = table[list(COMMANDS)].to_numpy(dtype=float)
    steps = [step for _, rows in trials if len(rows) > 1 and (step := _steps(t[rows], pose[rows], told[rows])) is not None]
    if not steps:
        return None
    moved, ways = (np.concatenate(part, axis=-1) for part in zip(*steps, strict=True))
    for way in ways:  # from the row on, or until it
        off = [_off(came, asked) for came, asked in zip(moved, way, strict=True)]
        known = [one for one in off if one is not None]
        if known and max(known) < EXACT:
            return int(table.index[trials[0][1][0]]), (
                f"from pose to pose the robot moves as it was told to, to {100 * max(known):.1g} % of the way in half of all "
                "steps. No motor and no tracker are so exact: these poses look computed from the commands (dead reckoning, or a "
                "simulation without noise). If they are, a diagnosis finds how they were computed, and nothing of the robot: "
                "give poses from a camera, a motion capture system or a scanner"
            )
    return None


def _steps(t: np.ndarray, pose: np.ndarray, told: np.ndarray) -> tuple[np.ndarray, np.ndarray] | None:
    """What was moved and turned between poses, (2, steps), and what was told then, (2 readings, 2, steps), of one trial."""
    seen = np.flatnonzero(np.isfinite(pose).all(axis=1))
    if len(seen) < 2:
        return None
    lasted = np.diff(t)[:, None]
    speeds = np.column_stack([(told[:, 0] + told[:, 1]) / 2.0, told[:, 1] - told[:, 0]])
    speeds = np.nan_to_num(speeds)
    ways = []
    for held in (speeds[:-1], speeds[1:]):
        driven = np.concatenate([np.zeros((1, 2)), np.cumsum(held * lasted, axis=0)])
        ways.append(np.diff(driven[seen], axis=0).T)
    x, y, heading = pose[seen].T
    turned = np.diff(heading)
    turned = np.arctan2(np.sin(turned), np.cos(turned))
    middle = heading[:-1] + turned / 2.0
    ahead = np.diff(x) * np.cos(middle) + np.diff(y) * np.sin(middle)
    return np.stack([ahead, turned]), np.stack(ways)


def _off(moved: np.ndarray, told: np.ndarray) -> float | None:
    """How far half of the steps are from the ratio that most have, as a share; None where hardly anything was told."""
    asked = np.abs(told)
    which = asked > 0.2 * float(asked.max(initial=0.0))
    if which.sum() < FEWEST:
        return None
    ratio = moved[which] / told[which]
    usual = float(np.median(ratio))
    return float(np.median(np.abs(ratio - usual))) / abs(usual) if usual else None
