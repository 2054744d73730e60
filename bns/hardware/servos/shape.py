"""How far apart a snake's markers are, by the angles of its joints: links in a row, one joint sideways, the next up and down."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from bns.physics.snake.parameters import SnakeParameters


def apart_m(joints_rad: Sequence[float] | np.ndarray, parameters: SnakeParameters) -> float:
    """Distance of the markers, which are on the tops of their links, whichever way up the body lies."""
    between = parameters.joints_between_markers
    ahead, turned = _ways(parameters), np.eye(3)
    top = np.array([0.0, 0.0, parameters.radius_m])
    place = turned[:, 0] * ahead[0] - top
    for joint, length_m in zip(range(between.start, between.stop), ahead[1:], strict=True):
        turned = turned @ _turn(float(joints_rad[joint]), joint % 2 == 0)
        place = place + turned[:, 0] * length_m
    return float(np.linalg.norm(place + turned @ top))


def _ways(parameters: SnakeParameters) -> np.ndarray:
    """Along the straight body: from the yellow marker to the first joint, from joint to joint, and to the green marker, m."""
    between, length_m, gap_m = parameters.joints_between_markers, parameters.length_m, parameters.marker_gap_m
    joints_m = parameters.pitch_m * (1.0 + np.arange(between.start, between.stop))
    return np.diff([(length_m - gap_m) / 2.0, *joints_m, (length_m + gap_m) / 2.0])


def _turn(angle_rad: float, sideways: bool) -> np.ndarray:
    c, s = np.cos(angle_rad), np.sin(angle_rad)
    if sideways:
        return np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])
    return np.array([[c, 0.0, s], [0.0, 1.0, 0.0], [-s, 0.0, c]])
