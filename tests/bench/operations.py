"""Operations of our formulas: a multiplication and an addition count as two, a comparison and a division as one."""

from __future__ import annotations

import numpy as np

from bns.robots.base import Robot
from bns.robots.snake.rules import NOISY_EVALUATIONS
from bns.spec import RunSpec

INPUT_OPS = 10  # five products and sums
SIGMOID_OPS = 2 + 1 + 8 + 6 + 3  # bns.engine.snn.sigmoid: two bounds, x * x, p, q, and 0.5 + x * p / q
OUTPUT_OPS = 2
BACKWARD_OPS = 15  # error at the neuron, its slope, six sums for the inputs and the bias, one for the output
FORWARD = INPUT_OPS + SIGMOID_OPS + OUTPUT_OPS
CYCLE_OPS = 40
"""Of one cycle of one of the snake's rollouts: the markers' frame, four products and sums each way, bounds, region."""
MEAN_REPEATS = 2.5


def neurons(robot: Robot) -> int:
    """Hidden neurons of all networks of a robot."""
    return len(robot.networks) * robot.hidden


def training(robot: Robot, spec: RunSpec, patterns: float) -> float:
    """Of a run whose networks were trained on so many patterns, summed over the evaluations."""
    return patterns * spec.training_iterations_per_evaluation * neurons(robot) * (FORWARD + BACKWARD_OPS)


def evolution(robot: Robot, spec: RunSpec, evals: dict[str, np.ndarray]) -> float:
    """Of what the networks are asked about all commands of every generation; and, where evolution has noise, of its rollouts."""
    commands = float(evals["mean_commands"].sum()) * spec.population_size * (spec.generations_per_evaluation + 1)
    rollouts = MEAN_REPEATS * (NOISY_EVALUATIONS + 1) * CYCLE_OPS if robot.repeats_inputs else 0.0
    return commands * (neurons(robot) * FORWARD + rollouts)
