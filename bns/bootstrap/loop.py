"""Bootstrapped Neuro-Simulation: the four steps of the source's figure 3.1, in lockstep.

The original trains, evolves and drives at the same time. Here each evaluation is followed by a stated number of
training iterations and generations, both in the spec, so that the same spec gives the same numbers anywhere.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from time import thread_time
from typing import Any

import numpy as np

from bns.bootstrap.evolver import Evolver
from bns.bootstrap.recorder import Recorder
from bns.bootstrap.trainer import Trainer
from bns.engine.philox import Key
from bns.robots import load_robot
from bns.spec import RunSpec
from bns.tasks import load_task
from bns.worlds import build_world
from bns.worlds.base import World

Progress = Callable[[Mapping[str, Any]], None]


@dataclass(frozen=True)
class RunResult:
    """Tables of one run (name -> columns of equal length), the world's digest, the final networks (networks, W), the
    fittest controller (n, components) and its last path (n, columns), in the world and as its networks saw it, and the inputs
    (inputs, patterns) of what the networks were trained on."""

    tables: dict[str, dict[str, np.ndarray]]
    world_digest: str
    networks: tuple[str, ...]
    weights: np.ndarray
    fittest: np.ndarray
    world_poses: np.ndarray
    snn_poses: np.ndarray
    learned_from: np.ndarray


def run(spec: RunSpec, progress: Progress | None = None, world: World | None = None) -> RunResult:
    """Carry out one run; `progress` is called with each evaluation's row. `world` replaces the one that the spec names."""
    robot = load_robot(spec.robot)
    key = Key.of_run(spec.seed, spec.root_seed, robot.name, spec.task)  # options are compared on the same luck
    task = load_task(spec.robot, spec.task)
    world = world or build_world(spec.world, robot)
    trainer = Trainer.start(robot, key, spec)
    weights = trainer.evolution_weights()
    evolver = Evolver.start(robot, task, key, spec, weights)
    recorder = Recorder(robot, task, world, key, spec)

    for evaluation in range(1, spec.evaluations + 1):
        # 1. A controller is picked from the population and driven in the world.
        controller = evolver.plan(evolver.pick(evaluation), weights)
        poses = recorder.drive_evaluated(evaluation, controller, weights)
        # 2. What it did joins the training set, and the training networks go on training.
        began = thread_time()
        trainer.add(controller, poses, evaluation)
        trainer.train()
        trained = thread_time()
        # 3. The training networks are copied over the evolution networks, and the population evolves on those.
        weights = trainer.evolution_weights()
        evolver.evolve(weights)
        evolved = thread_time()
        # 4. Until the evaluations are used up. What is kept is measured apart and teaches the networks nothing.
        row = recorder.record(evaluation, trainer, evolver, weights, trained - began, evolved - trained)
        if progress is not None:
            progress(row)
    return RunResult(
        recorder.tables(),
        world.digest,
        robot.networks,
        weights,
        evolver.fittest(),
        recorder.last_poses,
        recorder.last_simulated,
        trainer.data.training.in_use(),
    )
