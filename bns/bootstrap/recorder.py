"""What is kept of a run: one row an evaluation, and with ``record: full`` paths, generations and probes."""

from __future__ import annotations

from typing import Any

import numpy as np

from bns.bootstrap.driver import Drive
from bns.bootstrap.evolver import Evolver
from bns.bootstrap.neuro_simulation import NeuroSimulation
from bns.engine.evolution import Population
from bns.engine.philox import Key, Purpose
from bns.engine.snn import predict
from bns.robots.base import Robot
from bns.spec import RADII_CM, RunSpec
from bns.tasks import Task
from bns.worlds.base import World

PROBES, PROBE_COMMANDS = 10, 5
"""Figure 4.17b: ten random controllers of five commands."""


class _Columns:
    """Rows gathered one at a time (or several), given back as columns."""

    def __init__(self) -> None:
        self._columns: dict[str, list[Any]] = {}

    def add(self, **values: Any) -> dict[str, Any]:
        for name, value in values.items():
            self._columns.setdefault(name, []).append(value)
        return values

    def arrays(self) -> dict[str, np.ndarray]:
        return {name: np.array(values) for name, values in self._columns.items()}


class Recorder:
    """Drives controllers for measurement and gathers the tables of one run.

    `last_poses` and `last_simulated` (n, columns) are the latest path of the fittest controller, in the world and in simulation.
    """

    def __init__(self, robot: Robot, task: Task, world: World, key: Key, spec: RunSpec) -> None:
        self._robot, self._task, self._world, self._key = robot, task, world, key
        self._once = not world.repeatable
        self._full, self._with_paths = spec.record == "full", spec.record in {"paths", "full"}
        self._evals, self._paths, self._generations, self._probe_rows = (_Columns() for _ in range(4))
        self.last_poses = self.last_simulated = robot.start_pose()[:0]
        self._ever: dict[str, bool | None] = {}
        self._evaluated: dict[str, Any] = {}
        self._path = (np.empty((0, 0)), self.last_poses, self.last_poses)
        if self._full:
            self._probes = robot.random_controllers(key, PROBES, PROBE_COMMANDS)
            self._probe_world = [
                self._final(self._drive(self._probes.controller(i), Purpose.PROBE, 1 + i)) for i in range(PROBES)
            ]
            self._probe_before: list[np.ndarray] | None = None

    def add_evaluated(self, evaluation: int, drive: Drive, weights: np.ndarray) -> None:
        """Keep the drive of the controller picked for this evaluation, and what networks (networks, W) predict for it."""
        controller, poses = drive.commands, drive.poses
        in_world, goals = self._robot.evaluate_path(poses, self._task)
        simulated = self._simulated(controller, weights)
        in_simulation, _ = self._robot.evaluate_path(simulated, self._task)
        self._evaluated = {
            "evaluated_fitness_simulation": in_simulation,
            "evaluated_fitness_world": in_world,
            "evaluated_fitness_error": abs(in_simulation - in_world),
            "evaluated_goals_reached": goals,
            "commands": len(poses),
            "driven_ms": self._robot.driven_ms(controller[: len(poses)]),
        } | self._successes("evaluated_success", poses)
        self._path = (controller, poses, simulated)
        if self._with_paths:
            self._add_path(evaluation, "evaluated", *self._path)

    def record(self, evaluation: int, simulation: NeuroSimulation) -> dict[str, Any]:
        """Measure the fittest controller in the world and add this evaluation's row."""
        trainer, evolver, weights = simulation.trainer, simulation.evolver, simulation.weights
        training_cpu_s, evolution_cpu_s = simulation.take_cpu_s()
        fittest, poses, simulated = self._fittest(evaluation, evolver, weights)
        in_world, goals = self._robot.evaluate_path(poses, self._task)
        in_simulation = self._evaluated["evaluated_fitness_simulation"] if self._once else evolver.best_fitness
        self.last_poses, self.last_simulated = poses, simulated
        successes = self._successes("success", poses)
        for name, value in successes.items():
            # None stays None: where there is no distance to a goal, nothing has ever come within one.
            self._ever["ever_" + name] = value if value is None else self._ever.get("ever_" + name, False) or value
        training_error, validation_error = trainer.errors()
        if self._with_paths:
            self._add_path(evaluation, "fittest", fittest, poses, self.last_simulated)
        if self._full:
            self._record_full(evaluation, evolver, weights)
        return self._evals.add(
            evaluation=evaluation,
            diversity=evolver.diversity(),
            fitness_error=abs(in_simulation - in_world),
            fitness_simulation=in_simulation,
            fitness_world=in_world,
            best_fitness=evolver.best_fitness,
            mean_fitness=evolver.mean_fitness,
            goals_reached=goals,
            training_error=training_error,
            validation_error=validation_error,
            training_patterns=trainer.data.training.count,
            validation_patterns=trainer.data.validation.count,
            fittest_commands=len(fittest),
            mean_commands=float(evolver.population.lengths.mean()),
            generations=evolver.generations,
            bound_hits=evolver.bound_hits,
            arithmetic_failures=evolver.failures + trainer.failures,
            training_cpu_s=training_cpu_s,
            evolution_cpu_s=evolution_cpu_s,
            **successes,
            **self._ever,
            **self._evaluated,
        )

    def tables(self) -> dict[str, dict[str, np.ndarray]]:
        """Everything kept, table by table."""
        found = {"evals": self._evals.arrays()}
        found |= {
            "paths": self._paths.arrays(),
            "generations": self._generations.arrays(),
            "probes": self._probe_rows.arrays(),
        }
        return {name: columns for name, columns in found.items() if columns}

    def _drive(self, controller: np.ndarray, purpose: Purpose, step: int) -> np.ndarray:
        return self._world.drive(controller, self._key, purpose, step)

    def _simulated(self, controller: np.ndarray, weights: np.ndarray) -> np.ndarray:
        outputs = predict(weights, self._robot.inputs(controller), self._robot.sigmoid_output)
        return self._robot.poses(self._robot.displacements(outputs), controller)

    def _successes(self, prefix: str, poses: np.ndarray) -> dict[str, bool | None]:
        within = self._robot.successes(poses, self._task) or (None,) * len(RADII_CM)
        by_radius = {f"{prefix}_{cm}cm": ok for cm, ok in zip(RADII_CM, within, strict=True)}
        return {prefix: self._robot.succeeded(poses, self._task)} | by_radius

    def _fittest(
        self, evaluation: int, evolver: Evolver, weights: np.ndarray
    ) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Controller, path in the world and in simulation. A robot drives only what was picked: that one stands in."""
        if self._once:
            return self._path
        fittest = evolver.plan(evolver.fittest(), weights)
        poses = self._drive(fittest, Purpose.WORLD_FITTEST, evaluation)
        return fittest, poses, self._simulated(fittest, weights)

    def _record_full(self, evaluation: int, evolver: Evolver, weights: np.ndarray) -> None:
        for generation in evolver.history:
            best = evolver.plan(generation.best, weights, generation.number)
            driven = self._drive(best, Purpose.WORLD_GENERATION, generation.number)
            self._generations.add(
                evaluation=evaluation,
                generation=generation.number,
                best_fitness=generation.best_fitness,
                best_fitness_world=self._robot.evaluate_path(driven, self._task)[0],
                mean_fitness=generation.mean_fitness,
            )
        self._add_probes(evaluation, self._probes, weights)

    def _add_path(
        self, evaluation: int, who: str, controller: np.ndarray, poses: np.ndarray, simulated: np.ndarray
    ) -> None:
        start, driven = self._robot.start_pose(), len(poses)
        commands = np.vstack([np.full((1, controller.shape[1]), np.nan), controller[:driven]])
        columns = dict(zip(self._robot.command_columns, commands.T, strict=True))
        columns |= self._robot.pose_columns(np.vstack([start, poses]))
        simulator = self._robot.pose_columns(np.vstack([start, simulated[:driven]]))
        columns |= {f"snn_{name}": values for name, values in simulator.items()}
        for step in range(driven + 1):
            row = {name: values[step].item() for name, values in columns.items()}
            self._paths.add(evaluation=evaluation, who=who, step=step, **row)

    def _add_probes(self, evaluation: int, probes: Population, weights: np.ndarray) -> None:
        now = [self._final(self._simulated(probes.controller(i), weights)) for i in range(len(probes))]
        before = self._probe_before or [np.full(2, np.nan)] * len(now)
        for i, position in enumerate(now):
            self._probe_rows.add(
                evaluation=evaluation,
                probe=i,
                distance_m=float(np.linalg.norm(position - self._probe_world[i])),
                change_m=float(np.linalg.norm(position - before[i])),
            )
        self._probe_before = now

    def _final(self, poses: np.ndarray) -> np.ndarray:
        last = self._robot.pose_columns(poses[-1:])
        return np.concatenate([last["x_m"], last["y_m"]])
