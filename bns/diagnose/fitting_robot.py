"""Is the model one of this robot? A model of another one would be blamed on effects."""

from __future__ import annotations

import numpy as np

from bns.diagnose.horizons import windows
from bns.diagnose.predictor import Predictor
from bns.diagnose.tracks import Array
from bns.errors import DataError
from bns.physics.model import Model
from bns.robots import robot_names

_FACTOR = 1.8
_EXPLAINED = 0.25
"""Another robot it is if turns that are scaled leave less than this share of the deviation."""
_FEWEST = 5


def check_named_robot(robot: str, model: Model) -> None:
    """DataError if the data name another robot than the one the model is of."""
    name = model.name.removesuffix("-world")
    if robot and robot != name and {robot, name} <= set(robot_names()):
        raise DataError(
            f"The measurements are of the robot {robot}, the model {model.name} is of {name}; give a model of {robot}."
        )


def check_same_robot(predictor: Predictor, model: Model) -> None:
    """DataError if ways or turns are so far off that the data must be another robot's, or in other units."""
    tracks = predictor.tracks
    start, end = windows(tracks, "1s")
    if len(start) < _FEWEST:
        return
    steps = predictor.steps(model).body
    turn = np.concatenate([[0.0], np.cumsum(steps[:, 2])])[1:]
    predicted = turn[end] - turn[start]
    heading = tracks.pose[end, 2] - tracks.pose[start, 2]
    # where the model says that the turn is small enough, it can be told from one more round
    clear = (np.abs(predicted) < 1.2) & (np.abs(predicted) > 0.05)
    seen = (heading + np.pi) % (2 * np.pi) - np.pi
    if clear.sum() >= _FEWEST:
        ratio = _scale(seen[clear], predicted[clear])
        # motors that follow late also turn by another share in a second, but no one factor makes the model right
        explained = np.abs(seen - ratio * predicted)[clear].sum() < _EXPLAINED * np.abs(seen - predicted)[clear].sum()
        if explained and (ratio > _FACTOR or 0 < ratio < 1 / _FACTOR):
            raise DataError(
                f"The robot turns {ratio:.2f} times as far as a model with a wheelbase of {model.wheelbase_m:g} m says. "
                f"Is this its model? A wheelbase of {model.wheelbase_m / ratio:.3g} m would fit: "
                f"--wheelbase {model.wheelbase_m / ratio:.3g}."
            )
    way = np.concatenate([[0.0], np.cumsum(np.hypot(steps[:, 0], steps[:, 1]))])[1:]
    straight = (np.abs(predicted) < 0.3) & (way[end] - way[start] > 0.02)
    if straight.sum() >= _FEWEST:
        went = np.hypot(*(tracks.pose[end, :2] - tracks.pose[start, :2]).T)[straight]
        ratio = float(np.median(went / (way[end] - way[start])[straight]))
        if ratio < 0.03:
            raise DataError(
                "The robot hardly moves although it is told to: is it tracked, are its motors on, are these its commands?"
            )
        if ratio > 3 or ratio < 1 / 3:
            raise DataError(
                f"The robot goes {ratio:.2g} times as far as commanded. Are the speeds in m/s, "
                "the positions in m, the times in s? `bns import` turns other units into these."
            )


def _scale(seen: Array, predicted: Array) -> float:
    """Least absolute deviations of seen = scale * predicted: the median of the ratios, weighted by what was predicted."""
    ratios, weights = seen / predicted, np.abs(predicted)
    order = np.argsort(ratios)
    return float(ratios[order][np.searchsorted(np.cumsum(weights[order]), weights.sum() / 2)])
