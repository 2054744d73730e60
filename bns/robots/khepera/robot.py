"""Khepera III: two wheels, commands of left speed, right speed and duration, driven open loop (section 4.2).

Device units: wheel speeds in the firmware's units (144.01 units per mm/s before firmware 3.0), durations in ms.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING

import numpy as np

from bns.engine.breeding import breed
from bns.engine.evolution import CommandBounds, Population, diversity, random_population
from bns.engine.philox import Key, Purpose, normals, uniforms
from bns.engine.snn import INPUTS
from bns.measurements import COLUMNS, trial_table
from bns.robots.base import RandomStream, Scores, rotate
from bns.robots.khepera.noisy import Expected, expected
from bns.robots.khepera.options import READINGS, Options
from bns.robots.khepera.rollout import inputs, roll_out, walked
from bns.robots.khepera.rules import (
    GOAL_RADIUS_M,
    HIGH,
    LARGEST_HEADING_RAD,
    LOW,
    SCALE,
    SMALLEST_SUM_M,
    START,
)
from bns.tasks import Task

if TYPE_CHECKING:  # half a second to load, and a run needs no table
    import pandas as pd

UNITS_PER_M_S = 144_010.0


class Khepera:
    """Implements `bns.robots.base.TwoWheeled`. Other readings of the dissertation: `bns.robots.khepera.options`."""

    name = "khepera"
    networks = ("dx", "dy", "dtheta")
    hidden = 20
    input_count = INPUTS
    sigmoid_output = False
    repeats_inputs = False
    recipe = None
    radii_m = (0.07, 0.10, 0.14, 0.20)
    bounds = CommandBounds(LOW, HIGH, np.array([2000.0, 2000.0, 400.0], np.float32))
    command_columns = ("left_units", "right_units", "duration_ms")
    measured_columns = COLUMNS
    given_columns: Mapping[str, tuple[float, float]] = {
        "left_m_s": (-0.3, 0.3), "right_m_s": (-0.3, 0.3), "duration_s": (0.001, 60.0),
    }  # fmt: skip
    options: tuple[str, ...] = tuple(sorted(READINGS))
    nguyen_widrow = False
    substitute_sd_m = None
    physics = "bns.physics.wheels.khepera_drive"
    world_model = "khepera-world"
    simulators = "bns.robots"
    two_wheeled = True
    marks_unstable = False
    narrows_goals = True

    def __init__(self, switched_on: tuple[str, ...] = ()) -> None:
        self.switched_on, self._options = switched_on, Options(switched_on)
        self.flat_spot, self._operators, self._penalty_m = (
            self._options.flat_spot, self._options.operators, self._options.penalty_m,
        )  # fmt: skip

    def with_options(self, names: tuple[str, ...]) -> Khepera:
        """The Khepera with some of `options` switched on."""
        return type(self)(names)

    def initial_population(self, key: Key, size: int, shortest: int, capacity: int) -> Population:
        """4 to 13 random commands a controller; more where the shortest list allowed is longer."""
        fewest = max(4, shortest)
        return random_population(key, size, fewest, max(13, fewest), capacity, self.bounds)

    def random_controllers(self, key: Key, count: int, length: int) -> Population:
        """Controllers of `length` random commands, apart from every population's draws."""
        u = uniforms(key, Purpose.PROBE, 0, count, length)[..., :3]
        commands = (LOW + u * (HIGH - LOW)).astype(np.float32)
        return Population(commands, np.full(count, length, np.int32))

    def perturb(self, commands: np.ndarray, key: Key, step: int) -> np.ndarray:
        """Commands (n, 3), each component moved within its mutation span."""
        u = uniforms(key, Purpose.PROBE, step, 1, len(commands))[0, :, :3]
        moved = commands + (2 * u - 1) * self.bounds.mutation_span
        return np.clip(moved, LOW, HIGH).astype(np.float32)

    def inputs(self, commands: np.ndarray) -> np.ndarray:
        """Inputs (5, n): previous left, previous right, left, right, duration, normalised; at rest before the first."""
        return inputs(commands)

    def displacements(self, outputs: np.ndarray) -> np.ndarray:
        """(n, 3): to the right m, ahead m, counter-clockwise rad, in the frame the command began in."""
        return (outputs * SCALE[:, None]).T.astype(np.float64)

    def targets(self, displacements: np.ndarray) -> np.ndarray:
        """Network targets (3, n)."""
        return np.ascontiguousarray((displacements / SCALE).T, np.float32)

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

    def transform(self, poses: np.ndarray, turn_rad: float, shift_m: np.ndarray) -> np.ndarray:
        """Poses (n, 3) turned about the origin, then shifted."""
        return np.column_stack([rotate(poses[:, :2], turn_rad) + shift_m, poses[:, 2] + turn_rad])

    def marked_unstable(self, poses: np.ndarray, commands: Sequence[int]) -> np.ndarray:
        """As they are: no command of two wheels is unstable."""
        return poses

    def plan(
        self, controller: np.ndarray, weights: np.ndarray | None, task: Task, stream: RandomStream | None = None
    ) -> np.ndarray:
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
        return breed(key, parents, order, cdf, rate, self.bounds, shortest, generation, children, self._operators)

    def diversity(self, population: Population, scores: Scores) -> float:
        """Equation 4.1."""
        return diversity(population, self.bounds)

    def score(
        self, population: Population, weights: np.ndarray, task: Task, stream: RandomStream | None = None,
        parents: Scores | None = None,
    ) -> Scores:
        """Fitness on simulator networks (algorithm 2), without noise."""
        known = None if parents is None else parents.outputs
        fitness, reached, failures, outputs = roll_out(
            population, weights, task.goals_m, known, self._penalty_m, task.radius_m or GOAL_RADIUS_M
        )
        return Scores(fitness, reached, failures, outputs=outputs)

    def walk(
        self, population: Population, displacements: np.ndarray, task: Task, stream: RandomStream | None = None
    ) -> Scores:
        """As `score`, from displacements (commands, 3)."""
        radius_m = task.radius_m or GOAL_RADIUS_M
        return Scores(*walked(population, self.targets(displacements), task.goals_m, self._penalty_m, radius_m))

    def expected(
        self, population: Population, outputs: np.ndarray, task: Task, sd: np.ndarray, rows: int, stream: RandomStream
    ) -> Expected:
        """As `score`, from the networks' outputs (3, commands), as means over ``rows`` noisy simulations.

        sd (3,): standard deviations of what a command does, SI; the n-th commands of all controllers have the same noise.
        """
        drawn = normals(stream.key, Purpose.ROLLOUT_NOISE, stream.step, rows, int(population.lengths.max()))
        noise = drawn[..., :3].transpose(0, 2, 1) * (sd / SCALE)[:, None]
        return expected(population, outputs, noise, task.goals_m, self._penalty_m, task.radius_m or GOAL_RADIUS_M)

    def evaluate_path(self, poses: np.ndarray, task: Task) -> tuple[float, int]:
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
        total += self._penalty_m * (len(task.goals_m) - goal)
        return (1.0 / max(total, SMALLEST_SUM_M) if math.isfinite(total) else 0.0), goal

    def succeeded(self, poses: np.ndarray, task: Task) -> bool:
        """Whether all goals are visited in order within 7 cm."""
        return _visited(poses, task.goals_m, GOAL_RADIUS_M) == len(task.goals_m)

    def successes(self, poses: np.ndarray, task: Task) -> tuple[bool, ...]:
        """Whether all goals are visited in order, within each radius."""
        return tuple(_visited(poses, task.goals_m, radius) == len(task.goals_m) for radius in self.radii_m)

    def parse_commands(self, rows: np.ndarray) -> np.ndarray:
        """In the firmware's units and ms."""
        return rows * np.array([UNITS_PER_M_S, UNITS_PER_M_S, 1000.0])

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
