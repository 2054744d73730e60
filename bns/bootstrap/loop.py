"""Bootstrapped Neuro-Simulation, and its neighbours: the four steps of the dissertation's figure 3.1.

What learns from a drive, and picks the next, is the spec's approach (`bns.approaches`); all else is the same for all of them.

The original trains, evolves and drives at the same time. In a simulated world each evaluation is followed by one round of
a stated number of training iterations and generations, both in the spec, so that the same spec gives the same numbers
anywhere. A trial on a robot is the same loop with a driver that repeats such rounds while the robot drives, and notes how
many there were.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from bns.approaches import start_approach
from bns.bootstrap.driver import Driver, WorldDriver
from bns.bootstrap.recorder import Recorder
from bns.engine.philox import Key
from bns.robots import load_robot
from bns.spec import RunSpec
from bns.tasks import load_task
from bns.worlds import build_world
from bns.worlds.base import World

Progress = Callable[[Mapping[str, Any]], None]


@dataclass(frozen=True)
class RunResult:
    """Tables of one run (name -> columns of equal length), the world's digest, the final networks (networks, W), none
    where the approach has none, the fittest controller (n, components) and its last path (n, columns), in the world and as its
    simulator saw it (NaN without one), and the inputs (inputs, patterns) of what the networks were trained on."""

    tables: dict[str, dict[str, np.ndarray]]
    world_digest: str
    networks: tuple[str, ...]
    weights: np.ndarray
    fittest: np.ndarray
    world_poses: np.ndarray
    snn_poses: np.ndarray
    learned_from: np.ndarray


def run(
    spec: RunSpec, progress: Progress | None = None, world: World | None = None, driver: Driver | None = None
) -> RunResult:
    """Carry out one run; `progress` is called with each evaluation's row.

    `world` replaces the one that the spec names; `driver` drives what is picked (without it, the world itself does).
    """
    robot = load_robot(spec.robot)
    key = Key.of_run(spec.seed, spec.root_seed, robot.name, spec.task)  # options are compared on the same luck
    task = load_task(spec.robot, spec.task)
    world = world or build_world(spec.world, robot)
    driver = driver or WorldDriver(world, key)
    approach = start_approach(robot, task, key, spec)
    recorder = Recorder(robot, task, world, key, spec)

    for evaluation in range(1, spec.evaluations + 1):
        # 1. A controller is picked and driven in the world.
        foretold_by, controller = approach.simulator, approach.pick(evaluation)
        drive = driver.drive(evaluation, controller, approach.advance)
        if drive.skipped:
            continue
        recorder.add_evaluated(evaluation, drive, foretold_by)
        # 2. The approach takes in what it did.
        approach.learn(drive.commands, drive.poses, evaluation)
        # 3. Its simulator is brought up to date, and the population evolves on that.
        if not drive.rounds:  # else such rounds went on while it drove
            approach.advance()
        # 4. Until the evaluations are used up. What is kept is measured apart and teaches the approach nothing.
        row = recorder.record(evaluation, approach)
        driver.evaluated(evaluation, drive, row)
        if progress is not None:
            progress(row)
        if driver.finished:
            break
    return RunResult(
        recorder.tables(),
        world.digest,
        robot.networks if approach.networked else (),
        approach.weights,
        approach.fittest(),
        recorder.last_poses,
        recorder.last_simulated,
        approach.learned_from,
    )
