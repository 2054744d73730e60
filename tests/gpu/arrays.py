"""One run as the kernels take it."""

from importlib import import_module

import numpy as np

from bns.cuda.kernels import kernels_of
from bns.cuda.settings import settings_of
from bns.engine.evolution import Population, tournament_cdf
from bns.engine.philox import Key
from bns.engine.snn import initial_weights
from bns.robots import load_robot
from bns.spec import RunSpec
from bns.tasks import default_task, load_task

KEY = Key(11, 4)
SIZE = 9
LONGEST = {"khepera": 6, "snake": 3}


class Arrays:
    """With room for two controllers, one command and one goal more than it has; weights are those of networks drawn at random."""

    def __init__(self, robot, size=SIZE, share=0.4, shortest=2, longest=None, scale=1.0, task=None, **spec):
        longest = longest or LONGEST[robot]
        spec = {"mutation_rate": 0.5, "generations_per_evaluation": 1, "training_iterations_per_evaluation": 0} | spec
        self.robot, self.own = load_robot(robot), import_module(f"bns.cuda.robots.{robot}")
        self.kernels, self.task = kernels_of(robot), task or load_task(robot, default_task(robot))
        self.spec = RunSpec(
            robot=robot, task=default_task(robot), population_size=size, evaluations=3, min_commands=shortest,
            max_commands=longest, tournament_size=share, **spec,
        )  # fmt: skip
        self.settings = settings_of([self.spec], [KEY], [self.task], [longest])
        self.start = self.robot.initial_population(KEY, size, shortest, longest)
        components, networks = self.start.commands.shape[2], len(self.robot.networks)
        self.commands = np.zeros((2, 1, size + 2, longest + 1, components), np.float32)
        self.commands[0, 0, :size, :longest] = self.start.commands
        self.lengths = np.zeros((2, 1, size + 2), np.int32)
        self.lengths[0, 0, :size] = self.start.lengths
        self.weights = np.float32(scale) * initial_weights(KEY, networks, self.robot.hidden, self.robot.input_count)[None]
        self.fitness = np.zeros((1, size + 2))
        self.reached, self.used = np.zeros((1, size + 2), np.int32), np.zeros((1, size + 2), np.int32)
        self.order = np.full((1, size + 2), -1, np.int32)
        self.cdf = np.ones((1, size + 2))
        self.cdf[0, :size] = tournament_cdf(size, share)
        self.goals = np.zeros((1, len(self.task.goals_m) + 1, 2))
        self.goals[0, :-1] = self.task.goals_m
        self.failures, self.hits = np.zeros(1, np.int32), np.zeros(1, np.int32)
        most = 3 * longest * self.own.STEPS
        self.X, self.targets = np.zeros((2, 1, 5, most), np.float32), np.zeros((2, 1, networks, most), np.float32)
        self.counts = np.zeros((2, 1), np.int32)

    def evolve(self, evaluation, threads=4):
        with np.errstate(all="ignore"):  # networks that have diverged are among the cases
            self.kernels.evolve[1, threads](
                evaluation, self.settings, self.weights, self.commands, self.lengths, self.fitness, self.reached,
                self.used, self.order, self.cdf, self.goals, self.failures, self.hits,
            )  # fmt: skip

    def drive(self, evaluation, purpose, learning, static, noise_sd):
        """The row of what was driven."""
        rows = np.full((1, 3, len(self.own.DRIVEN)), np.nan)
        self.kernels.drive[self.own.driving_grid(1)](
            evaluation, self.settings, np.uint32(purpose), learning, static.ravel().copy(), noise_sd.copy(),
            self.weights.reshape(1, -1), self.commands, self.lengths, self.order, self.cdf, self.goals, self.X,
            self.targets, self.counts, self.failures, rows,
        )  # fmt: skip
        return dict(zip(self.own.DRIVEN, rows[0, evaluation - 1], strict=True))

    def measure(self, threads=3):
        """The row of the first evaluation."""
        rows = np.zeros((1, 1, len(self.kernels.measured)))
        self.kernels.measure[1, threads](
            1, self.settings, self.weights.reshape(1, -1), self.commands, self.lengths, self.used, self.fitness, self.order,
            self.X, self.targets, self.counts, self.failures, self.hits, rows,
        )  # fmt: skip
        return dict(zip(self.kernels.measured, rows[0, 0], strict=True))

    def population(self, half=0):
        n, longest = self.spec.population_size, self.start.commands.shape[1]
        return Population(self.commands[half, 0, :n, :longest].copy(), self.lengths[half, 0, :n].copy())

    def first(self, array):
        """What belongs to the controllers that there are."""
        return array[0, : self.spec.population_size]
