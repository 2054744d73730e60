"""Where the markers go: from displacements to positions and back, and what a path is worth (algorithm 3)."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import ArrayLike

from bns.tasks import Task

START_M = ((-0.025, 0.0), (0.625, 0.0))
"""Yellow and green at the start of every task: 65 cm apart, facing east, their middle at (30, 0)."""
YELLOW_ON_ORIGIN_M = ((0.0, 0.0), (0.65, 0.0))
"""The other reading of section 5.3.3: yellow on the origin, so that their middle is at (32.5, 0)."""
PENALTY_M = 10.0
"""For a position outside the surface, for one reached by an unstable cycle and for a goal missed after the current one:
metres of distance, more than the surface is wide. The dissertation says "a large constant"."""
SMALLEST_SUM_M = 0.1
"""The sum that fitness is the inverse of is kept above this, half the way from a region's middle to its edge; so that fitness
never exceeds 10 per metre, twice that of a path which ends at the edge of the last region."""
LEAST_STABLE = 0.5
"""A cycle counts as stable from this output on."""
STABLE = 8
"""Column of an observation that says whether the cycle was stable."""


def walk(
    displacements: np.ndarray,
    changes: np.ndarray | None = None,
    rigid: bool = False,
    start_m: ArrayLike = START_M,
) -> np.ndarray:
    """Observations (n, 9) that displacements (n, 5) add up to.

    Columns: yellow x, y, green x, y at the begin of the cycle, the same at its end (m), and 1 for stable or 0. Both markers'
    frames have y from yellow to green and x to its right, as both stand at the begin of the cycle. A cycle begins where the one
    before ended, or where ``changes`` (n, 5), as of `posture.changes`, moved the markers. ``rigid``: both are on one body, so a
    cycle leaves them as far apart as it found them, and a change as far as the posture puts them. ``start_m`` (2, 2): where the
    markers are at first.
    """
    markers, rows = np.array(start_m), []
    for i, moved in enumerate(displacements):
        before = markers if changes is None else moved_on(markers, changes[i], changes[i, 4] if rigid else None)
        markers = moved_on(before, moved, math.hypot(*(before[1] - before[0])) if rigid else None)
        rows.append(np.concatenate([before.ravel(), markers.ravel(), [float(moved[4] >= LEAST_STABLE)]]))
    return np.array(rows).reshape(-1, 9)


def moved_on(markers: np.ndarray, moved: np.ndarray, gap_m: float | None = None) -> np.ndarray:
    """Markers (2, 2) after displacements (>= 4,): yellow to the right and along, then green; set ``gap_m`` apart, if given,
    with their middle and direction kept."""
    right, along = frame(markers)
    after: np.ndarray = markers + np.outer(moved[[0, 2]], right) + np.outer(moved[[1, 3]], along)
    if gap_m is not None:
        after = after.mean(axis=0) + np.outer([-0.5, 0.5], gap_m * frame(after)[1])
    return after


def frame(markers: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Unit vectors to the right of, and along, the line from yellow to green (2, 2); NaN where both coincide."""
    line = markers[1] - markers[0]
    with np.errstate(invalid="ignore", divide="ignore"):
        along = line / math.hypot(*line)
    return np.array([along[1], -along[0]]), along


def unwalk(observations: np.ndarray) -> np.ndarray:
    """Displacements (n, 5) in the markers' frames of cycles that were observed (n, 9)."""
    found = np.empty((len(observations), 5))
    for row, seen in zip(found, observations, strict=True):
        before, after = seen[:4].reshape(2, 2), seen[4:8].reshape(2, 2)
        right, along = frame(before)
        moved = after - before
        row[[0, 2]], row[[1, 3]], row[4] = moved @ right, moved @ along, seen[STABLE]
    return found


def middles(observations: np.ndarray) -> np.ndarray:
    """Middle between the markers (n, 2), m, at the end of each cycle."""
    return (observations[:, 4:6] + observations[:, 6:8]) / 2


def evaluate_path(observations: np.ndarray, task: Task, start_m: ArrayLike = START_M) -> tuple[float, int, int]:
    """Algorithm 3 over one path: fitness per metre (0 if not finite), goals reached, cycles until the last goal or to the end."""
    total, goal, used = 0.0, 0, len(observations)
    half_x, half_y = task.surface_m[0] / 2, task.surface_m[1] / 2
    position = np.asarray(start_m, np.float64).mean(axis=0)
    for i, position in enumerate(middles(observations)):  # the last one counts below
        if abs(position[0]) > half_x or abs(position[1]) > half_y:
            total += PENALTY_M
        goal += int(np.abs(position - task.goals_m[goal]).max() <= task.region_m / 2)
        if goal == len(task.goals_m):
            used = i + 1
            break
        if not observations[i, STABLE]:
            total += PENALTY_M
    if goal < len(task.goals_m):
        total += math.hypot(*(position - task.goals_m[goal])) + PENALTY_M * (len(task.goals_m) - goal - 1)
    return (1.0 / max(total, SMALLEST_SUM_M) if np.isfinite(observations[:used]).all() else 0.0), goal, used
