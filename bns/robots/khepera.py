"""Khepera III: two wheels, commands of left speed, right speed and duration, driven open loop (section 4.2).

Device units: wheel speeds in the firmware's units (144.01 units per mm/s before firmware 3.0), durations in ms.
"""

from __future__ import annotations

import math

import numpy as np
import pandas as pd

from bns.engine.evolution import CommandBounds, Population, breed, diversity, random_population
from bns.engine.jit import exact, fast, inline
from bns.engine.philox import Key, Purpose, uniforms
from bns.engine.snn import INPUTS, predict_into
from bns.measurements import COLUMNS, trial_table
from bns.robots.base import Luck, Scores
from bns.tasks import Task

UNITS_PER_M_S = 144_010.0
GOAL_RADIUS_M = 0.07
MISSED_GOAL_M = 10.0
"""Penalty for a goal not reached, in metres of distance: more than any path on the surface adds up to, so that one goal
more always outweighs a shorter path. The source says "a large constant"."""
SMALLEST_SUM_M = 0.01
"""The distance sum that fitness is the inverse of is kept above this, so that fitness never exceeds 100 per metre."""
LARGEST_HEADING_RAD = 1e5
"""A controller whose heading in simulation runs beyond this counts as failed arithmetic: its networks have diverged."""
START = (0.0, 0.0, math.pi / 2)
"""Start of every task: between the goals, facing north."""

_LOW = np.array([3000.0, 3000.0, 400.0], np.float32)
_HIGH = np.array([30000.0, 30000.0, 3000.0], np.float32)
_CENTRE, _PER_UNIT = (_LOW + _HIGH) / 2, 2 / (_HIGH - _LOW)
_SCALE = np.array([0.2, 0.3, 3.0], np.float32)
"""Metres, metres and radians that an output of 1 stands for: the order of what random commands do."""


@fast
def _gather(commands, lengths, centre, per_unit, X, starts):  # type: ignore[no-untyped-def]  # compiled
    """Inputs of all commands of all controllers, side by side: previous left and right (0 at first), left, right, duration."""
    n = 0
    for i in range(lengths.size):
        starts[i] = n
        left, right = -centre[0] * per_unit[0], -centre[1] * per_unit[1]
        for j in range(lengths[i]):
            X[0, n], X[1, n] = left, right
            left = (commands[i, j, 0] - centre[0]) * per_unit[0]
            right = (commands[i, j, 1] - centre[1]) * per_unit[1]
            X[2, n], X[3, n] = left, right
            X[4, n] = (commands[i, j, 2] - centre[2]) * per_unit[2]
            n += 1
    return n


@inline
def _sine(x):  # type: ignore[no-untyped-def]  # compiled
    """Sine to 1e-11 for |x| below LARGEST_HEADING_RAD, without a branch, so that it vectorises."""
    half_turns = np.int32(x / math.pi + 1048576.5) - 1048576
    r = x - half_turns * math.pi
    s = r * r
    p = -1 / 1307674368000 * s + 1 / 6227020800
    p = p * s - 1 / 39916800
    p = p * s + 1 / 362880
    p = p * s - 1 / 5040
    p = p * s + 1 / 120
    p = p * s - 1 / 6
    return (r + r * s * p) * (1.0 - 2.0 * (half_turns & 1))


@fast
def _directions(heading, sine, cosine):  # type: ignore[no-untyped-def]  # compiled
    for c in range(heading.size):
        sine[c] = _sine(heading[c])
        cosine[c] = _sine(heading[c] + math.pi / 2)


@exact
def _headings(turns, starts, lengths, scale, heading, astray):  # type: ignore[no-untyped-def]  # compiled
    """Heading at the start of every command; infinite in `astray` for controllers that one leads out of bounds, 0 for others."""
    for i in range(lengths.size):
        angle, furthest = START[2], 0.0
        for c in range(starts[i], starts[i] + lengths[i]):
            heading[c] = angle
            furthest = max(furthest, abs(angle))
            angle += turns[c] * scale
        astray[i] = np.inf if furthest > LARGEST_HEADING_RAD else 0.0


@exact
def _steps(outputs, scale, sine, cosine):  # type: ignore[no-untyped-def]  # compiled
    """Steps in the world, in place of the directions: x in `cosine`, y in `sine`; apart from the walk, so that it vectorises."""
    to_right, forward = outputs[0], outputs[1]
    for c in range(sine.size):
        right, ahead = to_right[c] * scale[0], forward[c] * scale[1]
        x, y = ahead * cosine[c] + right * sine[c], ahead * sine[c] - right * cosine[c]
        cosine[c], sine[c] = x, y


@exact
def _walk(outputs, starts, lengths, scale, goals, fitness, reached):  # type: ignore[no-untyped-def]  # compiled
    """Algorithm 2 for every controller; how many could not be computed."""
    count = outputs.shape[1]
    heading, step_y, step_x = np.empty(count), np.empty(count), np.empty(count)
    astray = np.empty(lengths.size)
    _headings(outputs[2], starts, lengths, scale[2], heading, astray)
    _directions(heading, step_y, step_x)
    _steps(outputs, scale, step_y, step_x)
    failures, last = 0, goals.shape[0] - 1
    for i in range(lengths.size):
        x, y, total, goal = START[0], START[1], astray[i], 0
        for c in range(starts[i], starts[i] + lengths[i]):
            x += step_x[c]
            y += step_y[c]
            aim = min(goal, last)
            distance = math.sqrt((x - goals[aim, 0]) ** 2 + (y - goals[aim, 1]) ** 2)
            if goal <= last and distance <= GOAL_RADIUS_M:
                goal += 1
                aim = min(goal, last)
                distance = math.sqrt((x - goals[aim, 0]) ** 2 + (y - goals[aim, 1]) ** 2)
            total += distance
        total += MISSED_GOAL_M * (goals.shape[0] - goal)
        reached[i] = goal
        fitness[i] = 1.0 / max(total, SMALLEST_SUM_M)
        if not np.isfinite(total):
            fitness[i] = 0.0
            failures += 1
    return failures


class Khepera:
    """Implements `bns.robots.base.Robot`."""

    name = "khepera"
    networks = ("dx", "dy", "dtheta")
    hidden = 20
    input_count = INPUTS
    sigmoid_output = False
    repeats_inputs = False
    recipe = None
    radii_m = (0.07, 0.10, 0.14, 0.20)
    bounds = CommandBounds(_LOW, _HIGH, np.array([2000.0, 2000.0, 400.0], np.float32))
    command_columns = ("left_units", "right_units", "duration_ms")
    measured_columns = COLUMNS
    options: tuple[str, ...] = ()

    def with_options(self, names: tuple[str, ...]) -> Khepera:
        """There are none."""
        return self

    def initial_population(self, key: Key, size: int, shortest: int, capacity: int) -> Population:
        """4 to 13 random commands a controller; more where the shortest list allowed is longer."""
        fewest = max(4, shortest)
        return random_population(key, size, fewest, max(13, fewest), capacity, self.bounds)

    def random_controllers(self, key: Key, count: int, length: int) -> Population:
        """Controllers of `length` random commands, apart from every population's draws."""
        u = uniforms(key, Purpose.PROBE, 0, count, length)[..., :3]
        commands = (_LOW + u * (_HIGH - _LOW)).astype(np.float32)
        return Population(commands, np.full(count, length, np.int32))

    def near(self, commands: np.ndarray, key: Key, step: int) -> np.ndarray:
        """Commands (n, 3), each component moved within its mutation span."""
        u = uniforms(key, Purpose.PROBE, step, 1, len(commands))[0, :, :3]
        moved = commands + (2 * u - 1) * self.bounds.mutation_span
        return np.clip(moved, _LOW, _HIGH).astype(np.float32)

    def inputs(self, commands: np.ndarray) -> np.ndarray:
        """Inputs (5, n): previous left, previous right, left, right, duration, normalised; at rest before the first."""
        X, starts = np.empty((5, len(commands)), np.float32), np.empty(1, np.int64)
        _gather(commands[None].astype(np.float32), np.array([len(commands)], np.int32), _CENTRE, _PER_UNIT, X, starts)
        return X

    def displacements(self, outputs: np.ndarray) -> np.ndarray:
        """(n, 3): to the right m, ahead m, counter-clockwise rad, in the frame the command began in."""
        return (outputs * _SCALE[:, None]).T.astype(np.float64)

    def targets(self, displacements: np.ndarray) -> np.ndarray:
        """Network targets (3, n)."""
        return np.ascontiguousarray((displacements / _SCALE).T, np.float32)

    def poses(self, displacements: np.ndarray, commands: np.ndarray | None = None) -> np.ndarray:
        """Poses x_m, y_m, heading_rad (not wrapped) after each displacement."""
        heading = START[2] + np.concatenate([[0.0], np.cumsum(displacements[:, 2])])
        before = heading[:-1]
        right, ahead = displacements[:, 0], displacements[:, 1]
        x = START[0] + np.cumsum(ahead * np.cos(before) + right * np.sin(before))
        y = START[1] + np.cumsum(ahead * np.sin(before) - right * np.cos(before))
        return np.column_stack([x, y, heading[1:]])

    def measured_displacements(self, poses: np.ndarray) -> np.ndarray:
        """Displacements in the frame at the start of each command; headings must not be wrapped."""
        before = np.vstack([START, poses[:-1]])
        step = poses - before
        cos, sin = np.cos(before[:, 2]), np.sin(before[:, 2])
        return np.column_stack([step[:, 0] * sin - step[:, 1] * cos, step[:, 0] * cos + step[:, 1] * sin, step[:, 2]])

    def learnable(self, displacements: np.ndarray) -> np.ndarray:
        """Every network learns from every command."""
        return np.ones(displacements.shape[::-1], bool)

    def start_pose(self) -> np.ndarray:
        """Pose (1, 3) between the goals, facing north."""
        return np.array([START])

    def pose_columns(self, poses: np.ndarray) -> dict[str, np.ndarray]:
        """Position, m, and heading, rad."""
        return dict(zip(("x_m", "y_m", "heading_rad"), poses.T, strict=True))

    def plan(self, controller: np.ndarray, weights: np.ndarray, task: Task) -> np.ndarray:
        """A controller is driven as it is."""
        return controller

    def breed(
        self,
        key: Key,
        parents: Population,
        order: np.ndarray,
        cdf: np.ndarray,
        rate: float,
        shortest: int,
        generation: int,
        children: Population,
    ) -> int:
        """First segments of two lists swapped, and mutation (section 4.3)."""
        return breed(key, parents, order, cdf, rate, self.bounds, shortest, generation, children)

    def diversity(self, population: Population, scores: Scores) -> float:
        """Equation 4.1."""
        return diversity(population, self.bounds)

    def score(self, population: Population, weights: np.ndarray, task: Task, luck: Luck | None = None) -> Scores:
        """Fitness on simulator networks (algorithm 2), without noise."""
        n, total = len(population), int(population.lengths.sum())
        X = np.empty((5, total), np.float32)
        outputs = np.empty((3, total), np.float32)
        starts = np.empty(n, np.int64)
        _gather(population.commands, population.lengths, _CENTRE, _PER_UNIT, X, starts)
        predict_into(weights, X, total, outputs)
        fitness, reached = np.empty(n), np.empty(n, np.int32)
        failures = _walk(outputs, starts, population.lengths, _SCALE, task.goals_m, fitness, reached)
        return Scores(fitness, reached, int(failures))

    def judge(self, poses: np.ndarray, task: Task) -> tuple[float, int]:
        """Fitness per metre, and goals reached, of one path; 0 where `score` would call the arithmetic failed."""
        # As in `score`, the heading that a command begins with counts, not the one that the last command ends with.
        total, goal = math.inf if np.any(np.abs(poses[:-1, 2]) > LARGEST_HEADING_RAD) else 0.0, 0
        last = len(task.goals_m) - 1
        for x, y, _ in poses:
            distance = math.hypot(*(task.goals_m[min(goal, last)] - (x, y)))
            if goal <= last and distance <= GOAL_RADIUS_M:
                goal += 1
                distance = math.hypot(*(task.goals_m[min(goal, last)] - (x, y)))
            total += distance
        total += MISSED_GOAL_M * (len(task.goals_m) - goal)
        return (1.0 / max(total, SMALLEST_SUM_M) if math.isfinite(total) else 0.0), goal

    def succeeded(self, poses: np.ndarray, task: Task) -> bool:
        """Whether all goals are visited in order within 7 cm."""
        return _visited(poses, task.goals_m, GOAL_RADIUS_M) == len(task.goals_m)

    def successes(self, poses: np.ndarray, task: Task) -> tuple[bool, ...]:
        """Whether all goals are visited in order, within each radius."""
        return tuple(_visited(poses, task.goals_m, radius) == len(task.goals_m) for radius in self.radii_m)

    def driven_ms(self, commands: np.ndarray) -> float:
        """Sum of the durations."""
        return float(commands[:, 2].sum())

    def measurements(self, trial: int, commands: np.ndarray, poses: np.ndarray) -> pd.DataFrame:
        """Rows of the poses at the start and at the end of every command, with wheel speeds in m/s."""
        told = np.column_stack(self.wheel_speeds_m_s(commands.astype(np.float64)))
        return trial_table(trial, told, np.vstack([self.start_pose(), poses]))

    def wheel_speeds_m_s(self, commands: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Left and right wheel-surface speeds m/s and durations s, each (n,), of commands in device units."""
        return commands[:, 0] / UNITS_PER_M_S, commands[:, 1] / UNITS_PER_M_S, commands[:, 2] / 1000.0


def _visited(poses: np.ndarray, goals_m: np.ndarray, radius_m: float) -> int:
    goal = 0
    for x, y, _ in poses:
        if math.hypot(x - goals_m[goal, 0], y - goals_m[goal, 1]) <= radius_m:
            goal += 1
            if goal == len(goals_m):
                break
    return goal


ROBOT = Khepera()
