"""The snake: a physics cycle, training, and a whole run at the source's settings against what the core could do."""

from __future__ import annotations

import time
from statistics import median

import numpy as np

from bns.bootstrap.loop import run
from bns.engine.patterns import TRAINING_SHARE
from bns.engine.philox import Key
from bns.engine.rprop import Rprop
from bns.engine.snn import initial_weights
from bns.physics.snake.body import Body
from bns.physics.snake.parameters import shipped_parameters
from bns.robots.snake import ROBOT
from bns.robots.snake.cycles import COLUMNS, CYCLES
from bns.spec import RunSpec
from tests.bench import operations as counted
from tests.bench.clock import one_core
from tests.bench.line import Line, at_most
from tests.bench.whole_run import peak_flops

PATTERNS = 720
"""Stable cycles that the source's networks of displacements learned from."""
NO_COUNTS = np.empty(0, np.float32)
_TINY = RunSpec(robot="snake", task="two-regions", population_size=4, evaluations=2, generations_per_evaluation=1)


def measure(quick: bool) -> list[Line]:
    """Processor seconds: a machine that others use as well does not lengthen them by waiting."""
    return [_cycle(10 if quick else 100), _training(100 if quick else 1000), _whole(1 if quick else 3)]


def _cycle(count: int) -> Line:
    body = Body(shipped_parameters())
    cycles = ROBOT.random_controllers(Key(0, 0), count, 1).commands[:, 0, :4].astype(np.float64)
    with one_core():
        began, driven_s = time.process_time(), 0.0
        for cycle in cycles:
            body.lay_straight()
            driven_s += body.drive_cycle(cycle).duration_s
        taken = time.process_time() - began
    note = f"{count / taken:.1f} cycles a second, {driven_s / taken:.0f} times as fast as the robot"
    return at_most("snake: a random cycle in physics, one core", taken / count, 0.25, "s", note=note)


def _training(iterations: int) -> Line:
    """One 4-100-1 network with a sigmoid at its output, on as many patterns as the static simulator learns from."""
    key = Key(0, 0)
    X = ROBOT.inputs(ROBOT.random_controllers(key, PATTERNS, 1).commands[:, 0])
    target = (0.5 + 0.2 * np.sin(2 * X[0]) * X[3]).astype(np.float32)
    rule = Rprop.start(initial_weights(key, 1, ROBOT.hidden, ROBOT.input_count), "rprop+", ROBOT.sigmoid_output)
    rule.train_one(0, X, target, NO_COUNTS, PATTERNS, 10)
    with one_core():
        began = time.process_time()
        rule.train_one(0, X, target, NO_COUNTS, PATTERNS, iterations)
        taken = time.process_time() - began
    name = "snake: Rprop, one 4-100-1, a pattern, neuron and iteration"
    return at_most(name, 1e9 * taken / (iterations * PATTERNS * ROBOT.hidden), 2, "ns", note=f"{PATTERNS} patterns")


def _whole(seeds: int) -> Line:
    run(_TINY)
    taken, floors = [], []
    with one_core():
        for seed in range(seeds):
            spec = RunSpec(robot="snake", task="two-regions", seed=seed, record="paths")
            began = time.process_time()
            tables = run(spec).tables
            taken.append(time.process_time() - began)
            floors.append(operations(spec, tables["paths"]) / peak_flops())
    middle = int(np.argsort(taken)[len(taken) // 2])
    note = "floor: operations at this core's peak in matrix products; " + ", ".join(f"{one:.1f} s" for one in taken)
    return at_most("snake: a run, two regions, population 400, 100 evaluations", median(taken), 40, "s", floors[middle], note)


def operations(spec: RunSpec, paths: dict[str, np.ndarray]) -> float:
    """Of training on the distinct cycles driven so far, of predictions for every generation and of its noisy rollouts."""
    learned = paths["who"] == "evaluated"
    commands = np.column_stack([paths[name] for name in COLUMNS[:4]])
    seen = [
        len(np.unique(commands[learned & (paths["step"] > 0) & (paths["evaluation"] <= e)], axis=0))
        for e in range(1, spec.evaluations + 1)
    ]
    evals = {"mean_commands": np.full(spec.evaluations, CYCLES)}
    return counted.training(ROBOT, spec, TRAINING_SHARE * sum(seen)) + counted.evolution(ROBOT, spec, evals)
