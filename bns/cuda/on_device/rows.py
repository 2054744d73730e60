"""The rows that kernels leave of a run, as the columns that `bns.bootstrap.recorder` keeps."""

from __future__ import annotations

from typing import Any

import numpy as np

from bns.cuda.on_device.measuring import MEASURED
from bns.spec import RADII_CM

_WHOLE = (
    "goals_reached", "commands", "training_patterns", "validation_patterns", "generations", "bound_hits", "arithmetic_failures"
)  # fmt: skip
_ALWAYS_FINITE = ("diversity", "mean_fitness", "best_fitness", "fitness_world", "evaluated_fitness_world")


def evals_of(
    driven: tuple[str, ...],
    evaluated: np.ndarray,
    fittest: np.ndarray,
    measured: np.ndarray,
    training_s: np.ndarray,
    evolution_s: np.ndarray,
    overhead_s: float,
) -> dict[str, np.ndarray]:
    """Columns of one run, (evaluations,) each; evaluated and fittest (evaluations, n) with the columns ``driven``, measured
    (evaluations, 11), the seconds of its share of the GPU, and the robot time of an evaluation beside driving.

    Raises:
        ArithmeticError: a column is not finite that is finite in every run that went well.
    """
    picked, best, more = _named(driven, evaluated), _named(driven, fittest), _named(MEASURED, measured)
    columns = {"evaluation": np.arange(1, len(measured) + 1)} | more
    columns |= {
        "fitness_simulation": more["best_fitness"],
        "fitness_world": best["fitness_world"],
        "fitness_error": np.abs(more["best_fitness"] - best["fitness_world"]),
        "goals_reached": best["goals_reached"],
        "fittest_commands": best["commands"],
        "training_cpu_s": training_s,
        "evolution_cpu_s": evolution_s,
    }
    successes = _successes("success", best)
    columns |= successes | {f"ever_{name}": _so_far(values) for name, values in successes.items()}
    columns |= {
        "evaluated_fitness_simulation": picked["fitness_simulation"],
        "evaluated_fitness_world": picked["fitness_world"],
        "evaluated_fitness_error": np.abs(picked["fitness_simulation"] - picked["fitness_world"]),
        "evaluated_goals_reached": picked["goals_reached"],
        "commands": picked["commands"],
        "driven_ms": picked["driven_ms"],
        "robot_s": np.cumsum(picked["driven_ms"] / 1000.0 + overhead_s),
    } | _successes("evaluated_success", picked)
    for name in _ALWAYS_FINITE:
        if not np.isfinite(columns[name]).all():
            first = int(np.flatnonzero(~np.isfinite(columns[name]))[0]) + 1
            raise ArithmeticError(f"{name} is {columns[name][first - 1]} at evaluation {first}")
    return columns


def _named(names: tuple[str, ...], rows: np.ndarray) -> dict[str, Any]:
    columns = dict(zip(names, rows.T, strict=True))
    # A number that is not finite stays a float: it is found afterwards, and no whole number could say it.
    return {
        name: values.astype(np.int64) if name in _WHOLE and np.isfinite(values).all() else values
        for name, values in columns.items()
    }


def _successes(prefix: str, driven: dict[str, Any]) -> dict[str, np.ndarray]:
    """On the whole and by radius; None where a robot's goals have no radius, as in `bns.bootstrap.recorder`."""
    none = np.full(len(driven["success"]), None)
    by_radius = {f"{prefix}_{cm}cm": driven[f"{cm}cm"] > 0 if f"{cm}cm" in driven else none for cm in RADII_CM}
    return {prefix: driven["success"] > 0} | by_radius


def _so_far(values: np.ndarray) -> np.ndarray:
    return np.logical_or.accumulate(values) if values.dtype == bool else values
