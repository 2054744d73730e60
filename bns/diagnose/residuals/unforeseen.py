"""What a track shows by itself, before any filter: how far it moved beyond what a model predicts."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from bns.diagnose.data.tracks import Array
from bns.diagnose.estimate.fit import Fit
from bns.diagnose.estimate.fitting import Problem
from bns.engine.pose_filter import displacements


def unforeseen(problem: Problem, fit: Fit) -> Array:
    """Forward, left (m) and turn (rad) from the frame before, beyond the model's, (frames, 3); 0 where a trial begins."""
    tracks, steps = problem.predictor.tracks, problem.predictor.steps(fit.model)
    heading = np.roll(tracks.pose[:, 2], 1)
    east, north = steps.drift_m.T
    drift = [np.cos(heading) * east + np.sin(heading) * north, np.cos(heading) * north - np.sin(heading) * east]
    off = displacements(tracks.pose, tracks.is_first) - steps.body
    off[:, :2] -= np.stack(drift, axis=1)
    off[:, 2] = np.angle(np.exp(1j * off[:, 2]))
    off[tracks.is_first] = 0.0
    return off


def unforeseen_way(problem: Problem, fit: Fit, begin: NDArray[np.int64], end: NDArray[np.int64]) -> Array:
    """From frames ``begin`` to ``end`` (windows,), beyond the model's way: (windows, 3) as `unforeseen`.

    In the robot's frame where a window begins. Only the poses at both ends are used.
    """
    return ways(problem, fit, begin, end)[1]


def ways(problem: Problem, fit: Fit, begin: NDArray[np.int64], end: NDArray[np.int64]) -> tuple[Array, Array]:
    """The model's way, and the track's beyond it, both (windows, 3); arguments and frame as of `unforeseen_way`."""
    tracks, steps = problem.predictor.tracks, problem.predictor.steps(fit.model)
    driven = np.zeros((len(begin), 3))
    for k in range(1, int((end - begin).max(initial=0)) + 1):
        within = np.where(begin + k <= end, 1.0, 0.0)[:, None]
        forward, left, turn = (steps.body[np.minimum(begin + k, end)] * within).T
        c, s = np.cos(driven[:, 2]), np.sin(driven[:, 2])
        driven += np.stack([c * forward - s * left, s * forward + c * left, turn], axis=1)
    drift = np.cumsum(steps.drift_m, axis=0)
    c, s = np.cos(tracks.pose[begin, 2]), np.sin(tracks.pose[begin, 2])
    east, north = (drift[end] - drift[begin]).T
    driven[:, :2] += np.stack([c * east + s * north, c * north - s * east], axis=1)
    east, north = (tracks.pose[end, :2] - tracks.pose[begin, :2]).T
    turned = tracks.pose[end, 2] - tracks.pose[begin, 2] - driven[:, 2]
    off = [c * east + s * north - driven[:, 0], c * north - s * east - driven[:, 1], np.angle(np.exp(1j * turned))]
    return driven, np.stack(off, axis=1)
