"""A whole run with the prototype's settings on one core, and how far it is from what the core could do."""

from __future__ import annotations

import time
from statistics import median

import numpy as np

from bns.bootstrap.loop import run
from bns.robots.khepera import ROBOT
from bns.spec import RunSpec
from bns.sweep.jobs.job import warm
from tests.bench import operations as counted
from tests.bench.clock import one_core
from tests.bench.line import Line, at_most


def peak_flops() -> float:
    """Operations a second of processor time in single precision: the best of several large matrix products."""
    n, taken = 1024, []
    a, b = np.ones((n, n), np.float32), np.ones((n, n), np.float32)
    for _ in range(20):
        began = time.process_time()
        a @ b
        taken.append(time.process_time() - began)
    return 2 * n**3 / min(taken)


def operations(spec: RunSpec, evals: dict[str, np.ndarray]) -> tuple[float, float]:
    """Of training and of evolution, for a run that left these rows."""
    patterns = float(evals["training_patterns"].sum())
    return counted.training(ROBOT, spec, patterns), counted.evolution(ROBOT, spec, evals)


def measure(quick: bool) -> list[Line]:
    """Processor seconds of the median seed: a machine that others use as well does not lengthen them by waiting."""
    warm()
    taken, floors, notes = [], [], []
    with one_core():
        for seed in range(1 if quick else 3):
            spec = RunSpec(seed=seed)
            began, wall = time.process_time(), time.perf_counter()
            evals = run(spec).tables["evals"]
            taken.append(time.process_time() - began)
            training, evolution = operations(spec, evals)
            floors.append((training + evolution) / peak_flops())
            notes.append(
                f"seed {seed}: {taken[-1]:.1f} s processor, {time.perf_counter() - wall:.1f} s wall, "
                f"{evals['training_patterns'][-1]} patterns, {training / (training + evolution):.0%} of it training"
            )
    middle = int(np.argsort(taken)[len(taken) // 2])
    name = "a run: circle, population 400, 100 evaluations, one core"
    floor_note = "floor: operations at this core's peak in matrix products"
    return [at_most(name, median(taken), 5, "s", floors[middle], "; ".join([floor_note, *notes]))]
