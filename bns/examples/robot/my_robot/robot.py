"""My robot: two wheels, commands of left speed, right speed (mm/s) and duration (ms).

Genetic operators, kinematics and drawing are those of the Khepera, which has two wheels as well; ranges, scales and goal radius
are its own, and with them how a population is scored. Its commands stand in the store under the Khepera's names (left_units,
right_units, duration_ms), since a store has the same columns for all robots; here a unit is a mm/s.
"""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np

from bns.engine.evolution import CommandBounds, Population
from bns.engine.philox import Purpose, uniforms
from bns.engine.snn import predict
from bns.robots.base import Scores
from bns.robots.khepera import Khepera

LOW = np.array([40.0, 40.0, 500.0], np.float32)
HIGH = np.array([400.0, 400.0, 4000.0], np.float32)
"""Least and largest left speed, right speed (mm/s) and duration (ms)."""
SCALE = np.array([0.5, 0.8, 3.0], np.float32)
"""Metres to the right, metres ahead and radians that an output of 1 stands for: the order of what random commands do."""
GOAL_RADIUS_M = 0.15
MISSED_GOAL_M = 20.0
"""Penalty for a goal not reached: more than any path on the floor adds up to."""


class MyRobot(Khepera):
    """Implements `bns.robots.base.TwoWheeled`."""

    name = "my-robot"
    options = ()
    world_model = str(Path(__file__).with_name("world.yaml"))
    simulators = "my_robot"
    bounds = CommandBounds(LOW, HIGH, np.array([30.0, 30.0, 500.0], np.float32))
    given_columns = {"left_m_s": (-0.5, 0.5), "right_m_s": (-0.5, 0.5), "duration_s": (0.01, 60.0)}  # noqa: RUF012  # read only
    radii_m = (GOAL_RADIUS_M,)

    def random_controllers(self, key, count, length):
        """Controllers of `length` random commands, apart from every population's draws."""
        u = uniforms(key, Purpose.PROBE, 0, count, length)[..., :3]
        return Population((LOW + u * (HIGH - LOW)).astype(np.float32), np.full(count, length, np.int32))

    def perturb(self, commands, key, step):
        """Commands (n, 3), each component moved within its mutation span."""
        u = uniforms(key, Purpose.PROBE, step, 1, len(commands))[0, :, :3]
        return np.clip(commands + (2 * u - 1) * self.bounds.mutation_span, LOW, HIGH).astype(np.float32)

    def inputs(self, commands):
        """Inputs (5, n): previous left, previous right, left, right, duration, from -1 to 1; at rest before the first."""
        now = (np.asarray(commands) - (LOW + HIGH) / 2) * 2 / (HIGH - LOW)
        rest = -(LOW + HIGH)[:2] / (HIGH - LOW)[:2]
        before = np.vstack([rest, now[:-1, :2]])
        return np.ascontiguousarray(np.column_stack([before, now]).T, np.float32)

    def displacements(self, outputs):
        """(n, 3): to the right m, ahead m, counter-clockwise rad, in the frame the command began in."""
        return (outputs * SCALE[:, None]).T.astype(np.float64)

    def targets(self, displacements):
        """Network targets (3, n)."""
        return np.ascontiguousarray((displacements / SCALE).T, np.float32)

    def score(self, population, weights, task, stream=None, parents=None):
        """Fitness on simulator networks: every controller's commands through the networks, its path to the goals."""
        lists = [population.controller(i) for i in range(len(population))]
        outputs = predict(weights, np.hstack([self.inputs(commands) for commands in lists]))
        return self._scored(lists, self.displacements(outputs), task)

    def walk(self, population, displacements, task, stream=None):
        """As `score`, from displacements (commands, 3)."""
        return self._scored([population.controller(i) for i in range(len(population))], displacements, task)

    def _scored(self, lists, displacements, task):
        ends = np.cumsum([len(commands) for commands in lists])
        paths = (self.poses(part) for part in np.split(displacements, ends[:-1]))
        found = [self.evaluate_path(path, task) for path in paths]
        fitness = np.array([fitness for fitness, _ in found])
        reached = np.array([goals for _, goals in found], np.int32)
        return Scores(fitness, reached, int((fitness == 0.0).sum()), outputs=self.targets(displacements))

    def evaluate_path(self, poses, task):
        """Fitness per metre, and goals reached in order; 0 where the arithmetic failed."""
        total, goal, last = 0.0, 0, len(task.goals_m) - 1
        for x, y in poses[:, :2]:
            away = math.hypot(*(task.goals_m[min(goal, last)] - (x, y)))
            if goal <= last and away <= GOAL_RADIUS_M:
                goal += 1
                away = math.hypot(*(task.goals_m[min(goal, last)] - (x, y)))
            total += away
        total += MISSED_GOAL_M * (len(task.goals_m) - goal)
        return (1.0 / max(total, 0.01) if math.isfinite(total) else 0.0), goal

    def succeeded(self, poses, task):
        """Whether all goals are visited in order."""
        return self.evaluate_path(poses, task)[1] == len(task.goals_m)

    def successes(self, poses, task):
        """None by the radii of the Khepera's study: the column `success` says it."""
        return ()

    def parse_commands(self, rows):
        """From m/s and s to mm/s and ms."""
        return rows * 1000.0

    def wheel_speeds_m_s(self, commands):
        """Left and right wheel-surface speeds m/s and durations s, each (n,)."""
        return tuple(commands.T / 1000.0)


ROBOT = MyRobot()
