"""Trajectory planning with a static simulator: controllers evolved on it, then driven in the physics world (section 5.4.2)."""

from __future__ import annotations

import os
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

from bns.bootstrap.evolver import Evolver
from bns.bootstrap.simulators import NetworkSimulator
from bns.engine.philox import Key, Purpose
from bns.engine.snn import predict
from bns.errors import StoreError
from bns.robots.base import Robot
from bns.robots.simulator import load_static_simulator
from bns.spec import RunSpec
from bns.static_simulator.train_in_stages import evolving
from bns.tasks import Task
from bns.worlds.base import World

TRIALS, REPEATS = 12, 3
RANDOM = 100
"""Random controllers, driven once each."""
ROUND, MOST_ROUNDS = 100, 5
"""Generations between two looks at whether the fittest finishes the task in simulation, and how many such rounds at most."""
COMMANDS, TOURNAMENT = 4, 20 / 400
GOOD = 7 / 9 - 1e-9
"""Fraction of goals, over a controller's drives, that the worst of the dissertation's three good controllers reached (78 %)."""
OUTCOMES = ("left the surface", "rolled over", "unstable cycle", "missed a goal", "all goals")
"""What can become of a drive; the first that applies counts."""


def validate(
    robot: Robot, task: Task, world: World, progress: Callable[[int, int], None] = lambda done, of: None, sets: int = 1
) -> pd.DataFrame:
    """One row a pose of every trial: columns trial, repeat (-1: in simulation, without noise), step, the robot's poses, and
    those of its drive: commands, generations, goals_reached, final_error_m, outcome. Same simulator, same rows.

    Each of ``sets`` has `TRIALS` trials, numbered on; every trial has a seed of its own."""
    simulator, rows, trials = load_static_simulator(robot.name), [], sets * TRIALS
    for trial in range(trials):
        progress(trial, trials)
        evolver = _evolved(robot, task, trial, simulator.weights)
        planned = evolver.plan(evolver.fittest(), NetworkSimulator(evolver.robot, task, simulator.weights))
        outputs = predict(simulator.weights, robot.inputs(planned), robot.sigmoid_output)
        simulated = robot.poses(robot.displacements(outputs), planned)
        about = {"trial": trial + 1, "commands": len(planned), "generations": evolver.generations}
        rows.append(_rows(robot, task, simulated, simulated, about | {"repeat": -1}))
        for repeat in range(REPEATS):
            driven = world.drive(planned, evolver.key, Purpose.WORLD_EVALUATED, repeat + 1)
            rows.append(_rows(robot, task, driven, simulated, about | {"repeat": repeat + 1}))
    progress(trials, trials)
    return pd.concat(rows, ignore_index=True)


def _evolved(robot: Robot, task: Task, trial: int, weights: np.ndarray) -> Evolver:
    spec = RunSpec(
        robot=robot.name,
        task=task.name,
        seed=trial,
        tournament_size=TOURNAMENT,
        max_commands=COMMANDS,
        generations_per_evaluation=ROUND,
    )
    robot = evolving(robot)
    simulator = NetworkSimulator(robot, task, weights)
    evolver = Evolver.start(robot, task, Key.of_run(trial, 0, robot.name, f"validate {task.name}"), spec, simulator)
    for _ in range(MOST_ROUNDS):
        evolver.evolve(simulator)
        if evolver.scores.goals_reached[evolver.order[0]] == len(task.goals_m):
            break
    return evolver


def _rows(robot: Robot, task: Task, poses: np.ndarray, simulated: np.ndarray, about: dict[str, Any]) -> pd.DataFrame:
    table = pd.DataFrame(robot.pose_columns(np.vstack([robot.start_pose(), poses])))
    there = np.column_stack([robot.pose_columns(np.vstack([simulated[len(poses) - 1], poses[-1]]))[n] for n in ("x_m", "y_m")])
    table.insert(0, "step", np.arange(len(table)))
    return table.assign(
        **about,
        goals_reached=robot.evaluate_path(poses, task)[1],
        final_error_m=float(np.hypot(*(there[1] - there[0]))),
        outcome=outcome(robot, task, poses, len(simulated)),
    )


def outcome(robot: Robot, task: Task, poses: np.ndarray, planned: int) -> str:
    """What became of a drive of so many planned commands, one of `OUTCOMES`."""
    seen = robot.pose_columns(poses)
    beyond = (np.abs(seen["x_m"]) > task.surface_m[0] / 2) | (np.abs(seen["y_m"]) > task.surface_m[1] / 2)
    applies = (
        bool(beyond.any()),
        len(poses) < planned,
        not np.all(seen.get("stable", True)),
        not robot.succeeded(poses, task),
        True,
    )
    return OUTCOMES[applies.index(True)]


def random_drives(robot: Robot, world: World, progress: Callable[[int, int], None] = lambda done, of: None) -> pd.DataFrame:
    """Random controllers in the world, as a table of measurements: what a simulator is compared with."""
    key, rows = Key.of_run(0, 0, robot.name, "random drives"), []
    controllers = robot.random_controllers(key, RANDOM, COMMANDS)
    for i in range(RANDOM):
        progress(i, RANDOM)
        commands = controllers.controller(i)
        driven = world.drive(commands, key, Purpose.PROBE, i + 1)
        rows.append(robot.measurements(i + 1, commands[: len(driven)], driven))
    progress(RANDOM, RANDOM)
    return pd.concat(rows, ignore_index=True)


def measurements_path(results: Path, robot: str) -> Path:
    """Where the rows of `random_drives` are kept."""
    return results / "measurements" / f"{robot}-random.parquet"


def table_path(results: Path, robot: str, task: str) -> Path:
    """Where the rows of `validate` are kept."""
    return results / "validation" / f"{robot}-{task}.parquet"


def write_table(table: pd.DataFrame, path: Path) -> None:
    """Write the rows all at once; StoreError if they cannot be written."""
    part = path.with_name(f".{path.name}.{os.getpid()}.part")
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        table.to_parquet(part, index=False)
        part.replace(path)
    except OSError as error:
        raise StoreError(f"cannot write {path}: {error.strerror}; name another folder with --results DIR.") from error


def of_each_set(table: pd.DataFrame, goals: int) -> pd.DataFrame:
    """One row a set of `TRIALS` trials: complete (drives that reached all ``goals``), good (trials whose three drives reached at
    least 7 of 9 goals, as the dissertation's best three of twelve did), goals (fraction reached, over all drives)."""
    drives = table[table.repeat > 0].drop_duplicates(["trial", "repeat"])
    number = ((drives.trial - 1) // TRIALS + 1).rename("set")
    reached = drives.goals_reached.groupby([number, drives.trial]).sum() / (REPEATS * goals)
    return pd.DataFrame(
        {
            "complete": (drives.outcome == OUTCOMES[-1]).groupby(number).sum(),
            "good": (reached >= GOOD).groupby("set").sum(),
            "goals": reached.groupby("set").mean(),
        }
    )


def describe(table: pd.DataFrame, goals: int) -> str:
    """A line a trial: cycles, generations, goals, error at the end and outcome of each drive; then one a set."""
    lines = []
    for trial, rows in table[table.repeat > 0].groupby("trial"):
        drives = rows.drop_duplicates("repeat")
        lines.append(
            f"  trial {trial:2d}: {drives.commands.iloc[0]:2d} commands, {drives.generations.iloc[0]} generations, goals "
            f"{', '.join(map(str, drives.goals_reached))}, error at the end "
            f"{', '.join(f'{100 * error:.0f}' for error in drives.final_error_m)} cm: {'; '.join(drives.outcome.unique())}"
        )
    lines += [
        f"set {number}: {row.complete:.0f} of {TRIALS * REPEATS} drives reached all goals, {row.good:.0f} of {TRIALS} "
        f"controllers at least 7 of 9; {100 * row.goals:.0f} % of the goals"
        for number, row in of_each_set(table, goals).iterrows()
    ]
    return "\n".join(lines)
