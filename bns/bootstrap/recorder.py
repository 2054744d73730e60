"""What is kept of a run: one row an evaluation, and with ``record: full`` paths, generations and probes."""

from __future__ import annotations

from typing import Any

import numpy as np

from bns.approaches.parts.base import Approach
from bns.bootstrap.driver import Drive
from bns.bootstrap.simulators import Simulator
from bns.engine.evolution import Population
from bns.engine.philox import Key, Purpose
from bns.robots.base import Robot
from bns.spec import RADII_CM, RunSpec
from bns.tasks import Task
from bns.worlds.base import World

PROBES, PROBE_COMMANDS = 10, 5
"""Figure 4.17b: ten random controllers of five commands."""


def robot_time_s(driven_ms: float, overhead_s: float) -> float:
    """Robot time that an evaluation costs, s: what was driven, and putting the robot back."""
    return driven_ms / 1000.0 + overhead_s


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
        self._once, self._overhead_s, self._robot_s = not world.repeatable, spec.overhead_s, 0.0
        self._full, self._with_paths = spec.record == "full", spec.record in {"paths", "full"}
        self._evals, self._paths, self._generations, self._probe_rows = (_Columns() for _ in range(4))
        self.last_poses = self.last_simulated = robot.start_pose()[:0]
        self._ever: dict[str, bool | None] = {}
        self._evaluated: dict[str, Any] = {}
        self._path = (np.empty((0, 0)), self.last_poses, self.last_poses)
        if self._full:
            self._probes = robot.random_controllers(key, PROBES, PROBE_COMMANDS)
            self._probe_world = self._probed()
            self._probe_before: list[np.ndarray] | None = None

    def add_evaluated(self, evaluation: int, drive: Drive, simulator: Simulator) -> None:
        """Keep the drive of the controller picked for this evaluation, and what a simulator foretells of it."""
        controller, poses = drive.commands, drive.poses
        in_world, goals = self._robot.evaluate_path(poses, self._task)
        simulated = simulator.poses(controller)
        in_simulation = self._robot.evaluate_path(simulated, self._task)[0] if simulator.foretells else float("nan")
        driven_ms = self._robot.driven_ms(controller[: len(poses)])
        self._robot_s += robot_time_s(driven_ms, self._overhead_s)
        self._evaluated = {
            "evaluated_fitness_simulation": in_simulation,
            "evaluated_fitness_world": in_world,
            "evaluated_fitness_error": abs(in_simulation - in_world),
            "evaluated_goals_reached": goals,
            "commands": len(poses),
            "driven_ms": driven_ms,
            "robot_s": self._robot_s,
        } | self._successes("evaluated_success", poses)
        self._path = (controller, poses, simulated)
        if self._with_paths:
            self._add_path(evaluation, "evaluated", *self._path)

    def record(self, evaluation: int, approach: Approach) -> dict[str, Any]:
        """Measure the fittest controller in the world and add this evaluation's row."""
        known = approach.measures()
        fittest, poses, simulated = self._fittest(evaluation, approach)
        in_world, goals = self._robot.evaluate_path(poses, self._task)
        in_simulation = known["best_fitness"] if approach.simulator.foretells else float("nan")
        if self._once:
            in_simulation = self._evaluated["evaluated_fitness_simulation"]
        self.last_poses, self.last_simulated = poses, simulated
        successes = self._successes("success", poses)
        for name, value in successes.items():
            # None stays None: where there is no distance to a goal, nothing has ever come within one.
            self._ever["ever_" + name] = value if value is None else self._ever.get("ever_" + name, False) or value
        if self._with_paths:
            self._add_path(evaluation, "fittest", fittest, poses, self.last_simulated)
        if self._full:
            self._record_full(evaluation, approach)
        return self._evals.add(
            evaluation=evaluation,
            fitness_error=abs(in_simulation - in_world),
            fitness_simulation=in_simulation,
            fitness_world=in_world,
            goals_reached=goals,
            fittest_commands=len(fittest),
            **known,
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

    def _successes(self, prefix: str, poses: np.ndarray) -> dict[str, bool | None]:
        within = self._robot.successes(poses, self._task) or (None,) * len(RADII_CM)
        by_radius = {f"{prefix}_{cm}cm": ok for cm, ok in zip(RADII_CM, within, strict=True)}
        return {prefix: self._robot.succeeded(poses, self._task)} | by_radius

    def _fittest(self, evaluation: int, approach: Approach) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Controller, path in the world and in simulation. A robot drives only what was picked: that one stands in."""
        if self._once:
            return self._path
        fittest = approach.plan(approach.fittest())
        poses = self._drive(fittest, Purpose.WORLD_FITTEST, evaluation)
        return fittest, poses, approach.simulator.poses(fittest)

    def _record_full(self, evaluation: int, approach: Approach) -> None:
        for generation in approach.history:
            best = approach.plan(generation.best, generation.number)
            driven = self._drive(best, Purpose.WORLD_GENERATION, generation.number)
            self._generations.add(
                evaluation=evaluation,
                generation=generation.number,
                best_fitness=generation.best_fitness,
                best_fitness_world=self._robot.evaluate_path(driven, self._task)[0],
                mean_fitness=generation.mean_fitness,
            )
        if evaluation == getattr(self._world, "changes_at", None):
            self._probe_world = self._probed()
        self._add_probes(evaluation, self._probes, approach.simulator)

    def _probed(self) -> list[np.ndarray]:
        """Where the probes end in the world as it is now."""
        return [self._final(self._drive(self._probes.controller(i), Purpose.PROBE, 1 + i)) for i in range(PROBES)]

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

    def _add_probes(self, evaluation: int, probes: Population, simulator: Simulator) -> None:
        now = [self._final(simulator.poses(probes.controller(i))) for i in range(len(probes))]
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
