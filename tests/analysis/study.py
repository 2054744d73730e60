"""A made-up study with planted effects: known parameters raise known successes by a known amount."""

from __future__ import annotations

import itertools
from pathlib import Path

import numpy as np

from bns.spec import RunSpec
from tests.store.synthetic import publish_chunk

GRID = {
    "population_size": (50, 100, 200, 400),
    "tournament_size": (0.1, 0.2, 0.3, 0.4, 0.5),
    "mutation_rate": (0.1, 0.3, 0.5, 0.7, 0.9),
    "real_world_selection_size": (0.1, 0.3, 0.5, 0.7, 0.9),
}
TASKS = ("circle", "infinity", "complex")
DIFFICULTY = {"circle": 0.0, "infinity": -0.1, "complex": -0.4}


def make_study(
    path: Path, seeds: int = 30, tasks: tuple[str, ...] = TASKS, evaluations: int = 100, sweep: str = "khepera", **fixed
) -> None:
    """Every combination of GRID (``fixed`` replaces values of a parameter) on every task, one file a task and seed."""
    grid = GRID | {name: value if isinstance(value, tuple) else (value,) for name, value in fixed.items()}
    cells = [dict(zip(grid, values, strict=True)) for values in itertools.product(*grid.values())]
    random = np.random.default_rng(7)
    for number, (task, seed) in enumerate(itertools.product(tasks, range(seeds))):
        specs = [RunSpec(task=task, seed=seed, evaluations=evaluations, **cell) for cell in cells]
        own = planted(specs, random)
        publish_chunk(path, sweep, f"part-j{number:032x}-0", specs, random, **own)


def chance(spec: RunSpec) -> float:
    """Chance of success at the end: falls by 0.6 over the mutation rates, grows by 0.15 with the population."""
    size = np.log2(spec.population_size / 50) / 3
    return float(np.clip(0.75 - 0.75 * (spec.mutation_rate - 0.1) + 0.15 * size + DIFFICULTY[spec.task], 0.01, 0.97))


def planted(specs: list[RunSpec], random: np.random.Generator) -> dict[str, np.ndarray]:
    """Columns of evals, run after run: successes that come with the evaluations, diversity that follows the mutation rate."""
    count, evaluations = len(specs), specs[0].evaluations
    end = np.array([chance(spec) for spec in specs])[:, None]
    risen = end * np.linspace(0, 1, evaluations) ** 0.5
    luck = random.random((count, 1)) * 0.7 + random.random((count, evaluations)) * 0.3
    columns = {
        f"success_{cm}cm": luck < np.clip(risen * factor, 0, 0.99) for cm, factor in ((7, 1), (10, 1.2), (14, 1.4), (20, 1.6))
    }
    rate = np.array([spec.mutation_rate for spec in specs])[:, None]
    diversity = 0.4 + 0.8 * rate + random.normal(0, 0.03, (count, evaluations)) + 0.1 * rate * np.linspace(0, 1, evaluations)
    error = 0.3 + 0.8 * np.maximum(diversity - 0.7, 0) + random.exponential(0.1, (count, evaluations))
    flat = {name: values.ravel() for name, values in columns.items()}
    return flat | {"success": flat["success_7cm"], "diversity": diversity.ravel(), "fitness_error": error.ravel()}
