"""What the kernels are told of each run of a batch."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from bns.engine.philox import Key
from bns.spec import RunSpec
from bns.tasks import Task

SETTINGS = np.dtype(
    [
        ("evaluations", np.int32),
        ("generations", np.int32),
        ("iterations", np.int32),
        ("population", np.int32),
        ("shortest", np.int32),
        ("longest", np.int32),
        ("goals", np.int32),
        ("backtrack", np.int32),
        ("key0", np.uint32),
        ("key1", np.uint32),
        ("mutation_rate", np.float64),
        ("half_region", np.float64),
        ("half_x", np.float64),
        ("half_y", np.float64),
    ],
    align=True,
)
"""One record a run; generations and iterations are those of one evaluation, longest is the most commands that a controller of
it can have, goals is how many there are, half_region half their width, half_x and half_y half of the surface, m."""


def settings_of(specs: Sequence[RunSpec], keys: Sequence[Key], tasks: Sequence[Task], longest: Sequence[int]) -> np.ndarray:
    """Records (runs,) of runs with these keys, tasks and longest lists."""
    table = np.zeros(len(specs), SETTINGS)
    for row, spec, key, task, most in zip(table, specs, keys, tasks, longest, strict=True):
        row["evaluations"] = spec.evaluations
        row["generations"] = spec.generations_per_evaluation
        row["iterations"] = spec.training_iterations_per_evaluation
        row["population"] = spec.population_size
        row["shortest"], row["longest"] = spec.min_commands, most
        row["goals"], row["half_region"] = len(task.goals_m), task.region_m / 2
        row["half_x"], row["half_y"] = (side / 2 for side in task.surface_m)
        row["backtrack"] = spec.training_algorithm == "rprop+"
        row["key0"], row["key1"] = key.words
        row["mutation_rate"] = spec.mutation_rate
    return table
