"""A batch of runs on the GPU: the four steps of `bns.bootstrap.loop`, for all of them at once."""

from __future__ import annotations

import time
from collections.abc import Sequence
from functools import cache
from typing import Any

import numpy as np

from bns.bootstrap.loop import RunResult
from bns.bootstrap.trainer import untrained
from bns.cuda.device import OutOfDeviceMemoryError, device_name, faults, full
from bns.cuda.kernels import kernels_of
from bns.cuda.settings import settings_of
from bns.cuda.support import check_supported
from bns.engine.evolution import tournament_cdf
from bns.engine.philox import Key, Purpose
from bns.engine.rprop import INITIAL_STEP
from bns.engine.snn import INPUTS, predict
from bns.robots import load_robot
from bns.robots.base import RandomStream
from bns.robots.simulator import load_static_simulator
from bns.spec import RunSpec
from bns.tasks import default_task, load_task
from bns.worlds import build_world

THREADS = 128


class Batch:
    """Runs of one robot side by side. `step` carries out the next evaluation of all; `done` says when there is none left.

    Raises, also in `step`:
        SpecError: a run that only the CPU can do.
        DeviceError: no GPU, or it failed.
        OutOfDeviceMemoryError: so many runs do not fit.
    """

    def __init__(self, specs: Sequence[RunSpec], threads: int | None = None) -> None:
        check_supported(specs)
        device_name()
        self.specs, self._threads = tuple(specs), threads or THREADS
        self.robot = load_robot(specs[0].robot)
        self._kernels = kernels_of(self.robot.name)
        self.evaluations, self.evaluation = max(spec.evaluations for spec in specs), 0
        self._seconds = np.zeros((2, self.evaluations))
        with faults():
            self._allocate()
            self._evolve(0)

    @property
    def done(self) -> bool:
        """Whether every run has come to its end."""
        return self.evaluation == self.evaluations

    def step(self) -> None:
        """The next evaluation, in the order of `bns.bootstrap.loop.run`."""
        self.evaluation += 1
        with faults():
            self._drive(Purpose.WORLD_EVALUATED, True, self._cdf_world, self._evaluated)
            began = self._now()
            self._train(self.evaluation)
            trained = self._now()
            self._evolve(self.evaluation)
            evolved = self._now()
            self._drive(Purpose.WORLD_FITTEST, False, self._cdf_world, self._fittest)
            self._measure()
        active = sum(spec.evaluations >= self.evaluation for spec in self.specs)
        self._seconds[:, self.evaluation - 1] = (trained - began) / active, (evolved - trained) / active

    def patterns(self) -> np.ndarray:
        """How many patterns each run's networks are trained on now (runs,), those of the same inputs as one."""
        with faults():
            found: np.ndarray = (self._distinct if self.robot.repeats_inputs else self._counts[0]).copy_to_host()
        return found

    def evals(self) -> list[dict[str, np.ndarray] | ArithmeticError]:
        """Columns of every run so far, or what is wrong with its numbers; the times are its share of the GPU's."""
        with faults():
            rows = [array.copy_to_host() for array in (self._evaluated, self._fittest, self._measured)]
        found: list[dict[str, np.ndarray] | ArithmeticError] = []
        for run, spec in enumerate(self.specs):
            upto = min(spec.evaluations, self.evaluation)
            own, seconds = [table[run, :upto] for table in rows], self._seconds[:, :upto]
            try:
                found.append(self._kernels.evals_of(self._kernels.driven, *own, *seconds, spec.overhead_s))
            except ArithmeticError as error:
                found.append(error)
        return found

    def columns(self, run: int) -> dict[str, np.ndarray]:
        """Those of one run; ArithmeticError if its numbers are not finite."""
        found = self.evals()[run]
        if isinstance(found, ArithmeticError):
            raise found
        return found

    def result(self, run: int = 0) -> RunResult:
        """One run that is done, as `bns.bootstrap.loop.run` gives it; ArithmeticError if its numbers are not finite."""
        spec, evals = self.specs[run], self.columns(run)
        task, world = load_task(spec.robot, spec.task), build_world(spec.world, self.robot)
        with faults():
            weights, half = self._weights[run].copy_to_host(), spec.generations_per_evaluation * spec.evaluations % 2
            best = int(self._order[run].copy_to_host()[0])
            length = int(self._lengths[half, run].copy_to_host()[best])
            controller = self._commands[half, run, best].copy_to_host()[:length]
            patterns = int(self._counts[0].copy_to_host()[run])
            learned_from = self._X[0, run].copy_to_host()[:, :patterns].copy()
        stream = RandomStream(self._keys[run], spec.generations_per_evaluation * spec.evaluations)
        fittest = self.robot.plan(controller, weights, task, stream)
        poses = world.drive(fittest, self._keys[run], Purpose.WORLD_FITTEST, spec.evaluations)
        outputs = predict(weights, self.robot.inputs(fittest), self.robot.sigmoid_output)
        simulated = self.robot.poses(self.robot.displacements(outputs), fittest)
        return RunResult(
            {"evals": evals}, world.digest, self.robot.networks, weights, controller, poses, simulated, learned_from
        )

    def _allocate(self) -> None:
        """Everything in the GPU's memory; what begins a run is drawn by the CPU engine itself."""
        specs, robot, cuda = self.specs, self.robot, self._kernels.cuda
        tasks = [load_task(spec.robot, spec.task) for spec in specs]
        self._keys = [Key.of_run(spec.seed, spec.root_seed, spec.robot, spec.task) for spec in specs]
        runs, networks = len(specs), len(robot.networks)
        n = max(spec.population_size for spec in specs)
        # How long lists can get is the robot's own matter: a population of one shows it.
        own = [
            robot.initial_population(key, 1, spec.min_commands, spec.max_commands).commands.shape[1]
            for key, spec in zip(self._keys, specs, strict=True)
        ]
        most = max(spec.evaluations * longest for spec, longest in zip(specs, own, strict=True))  # commands that a run can drive
        goals = np.zeros((runs, max(len(task.goals_m) for task in tasks), 2))
        cdfs = np.ones((2, runs, n))
        lists = np.zeros((runs, n, max(own), len(robot.command_columns)), np.float32)
        lengths = np.zeros((2, runs, n), np.int32)
        for run, (spec, task, key) in enumerate(zip(specs, tasks, self._keys, strict=True)):
            goals[run, : len(task.goals_m)] = task.goals_m
            size = spec.population_size
            cdfs[0, run, :size] = tournament_cdf(size, spec.tournament_size)
            cdfs[1, run, :size] = tournament_cdf(size, spec.real_world_selection_size)
            population = robot.initial_population(key, size, spec.min_commands, spec.max_commands)
            lists[run, :size, : own[run]], lengths[0, run, :size] = population.commands, population.lengths
        began = np.stack([untrained(robot, key) for key in self._keys])
        static = load_static_simulator(robot.name)

        put, empty = cuda.to_device, cuda.device_array
        self._settings = put(settings_of(specs, self._keys, tasks, own))
        self._goals, self._cdf_parents, self._cdf_world = put(goals), put(cdfs[0]), put(cdfs[1])
        self._commands = empty((2, *lists.shape), np.float32)
        self._commands[0].copy_to_device(lists)
        self._lengths = put(lengths)
        self._fitness = empty((runs, n), np.float64)
        self._reached, self._used, self._order = (empty((runs, n), np.int32) for _ in range(3))
        self._untrained, self._weights = put(began), put(began)
        self._flat = self._weights.reshape(runs, networks * began.shape[2])
        self._step = put(np.full_like(began, INITIAL_STEP))
        self._last_gradient, self._last_change = put(np.zeros_like(began)), put(np.zeros_like(began))
        self._X = empty((2, runs, INPUTS, most * self._kernels.steps), np.float32)
        self._targets = empty((2, runs, networks, most * self._kernels.steps), np.float32)
        self._counts = put(np.zeros((2, runs), np.int32))
        self._times = empty((1, 1, 1), np.float32)  # a pattern stands for itself
        if robot.repeats_inputs:
            self._merged, self._distinct = put(np.zeros(runs, np.int32)), put(np.zeros(runs, np.int32))
            self._inputs, self._sums = empty((runs, INPUTS, most), np.float32), empty((runs, networks, most), np.float64)
            self._means, self._times = (empty((runs, networks, most), np.float32) for _ in range(2))
        self._failures, self._hits = put(np.zeros(runs, np.int32)), put(np.zeros(runs, np.int32))
        self._static, self._noise_sd = put(static.weights.ravel().copy()), put(static.noise_sd)
        self._evaluated, self._fittest = (
            put(np.full((runs, self.evaluations, len(self._kernels.driven)), np.nan)) for _ in range(2)
        )
        self._measured = put(np.full((runs, self.evaluations, len(self._kernels.measured)), np.nan))

    def _drive(self, purpose: Purpose, learning: bool, cdf: Any, rows: Any) -> None:
        self._kernels.drive[self._kernels.driving_grid(len(self.specs))](
            self.evaluation, self._settings, np.uint32(purpose), learning, self._static, self._noise_sd, self._flat,
            self._commands, self._lengths, self._order, cdf, self._goals, self._X, self._targets, self._counts,
            self._failures, rows,
        )  # fmt: skip

    def _train(self, evaluation: int) -> None:
        runs, networks = self._weights.shape[:2]
        state = self._weights, self._step, self._last_gradient, self._last_change
        patterns = self._X[0], self._targets[0], self._counts[0]
        if self.robot.repeats_inputs:
            distinct = self._inputs, self._sums, self._means, self._times, self._distinct
            self._kernels.merge[runs, self._kernels.warp](evaluation, self._settings, *patterns, self._merged, *distinct)
            patterns = self._inputs, self._means, self._distinct
        X, targets, counts = patterns
        self._kernels.train[(runs, networks), self._kernels.warp](
            evaluation, self._settings, *state, X, targets, self._times, counts
        )
        self._kernels.restart[-(-runs * networks // self._threads), self._threads](
            evaluation, self._settings, self._untrained, *state, self._failures
        )

    def _evolve(self, evaluation: int) -> None:
        self._kernels.evolve[len(self.specs), self._threads](
            evaluation, self._settings, self._weights, self._commands, self._lengths, self._fitness, self._reached,
            self._used, self._order, self._cdf_parents, self._goals, self._failures, self._hits,
        )  # fmt: skip

    def _measure(self) -> None:
        self._kernels.measure[len(self.specs), self._threads](
            self.evaluation, self._settings, self._flat, self._commands, self._lengths, self._used, self._fitness,
            self._order, self._X, self._targets, self._counts, self._failures, self._hits, self._measured,
        )  # fmt: skip

    def _now(self) -> float:
        self._kernels.cuda.synchronize()
        return time.perf_counter()


@cache
def warm(robot: str) -> None:
    """Compile the robot's kernels, once a process, so that no batch is charged with it.

    Raises:
        DeviceError: no GPU, it failed, or its memory is full.
    """
    tiny = RunSpec(
        robot=robot,
        task=default_task(robot),
        population_size=2,
        evaluations=1,
        generations_per_evaluation=0,
        training_iterations_per_evaluation=1,
        min_commands=1,
        max_commands=1,
    )
    try:
        Batch([tiny]).step()
    except OutOfDeviceMemoryError as error:
        raise full(error) from error
