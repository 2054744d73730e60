"""What several tests of figures do."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from store.synthetic import record

from bns.spec import RunSpec
from bns.store import RunRecord, Writer
from bns.sweep.expand.grid import parse_sweep
from bns.sweep.expand.order import ordered_specs

MUTATION = """
name: mutation
robot: khepera
seeds: 5
fixed: {evaluations: 6, population_size: 8, generations_per_evaluation: 2, training_iterations_per_evaluation: 20}
grid: {task: [circle, complex], mutation_rate: [0.1, 0.5]}
"""


def written(results: Path, sweep: str, records: list[RunRecord], **more) -> None:
    with Writer(results, sweep, **more) as writer:
        for one in records:
            writer.append(one)


def curves(figure, number: int = 0) -> dict[str, tuple]:
    """Label -> (x, y) of the labelled lines of one of the axes."""
    lines = figure.axes[number].get_lines()
    return {line.get_label(): line.get_data() for line in lines if not line.get_label().startswith("_")}


def with_evals(spec: RunSpec, **columns) -> RunRecord:
    """A run that went well, with these values in its evals: an array, or one value for all rows."""
    made = record(spec)
    for name, value in columns.items():
        empty = value is None
        made.tables["evals"][name] = np.full(spec.evaluations, value, object if empty else None) if np.ndim(value) == 0 else value
    return made


def carry_out(results: Path, text: str, keep: slice = slice(None)) -> None:
    """Do a sweep (a part of its runs) in this process."""
    from bns.sweep.jobs.job import run_job  # which loads the compiled kernels

    sweep = parse_sweep(text, Path("test.yaml"))
    with Writer(results, sweep.name, sweep_text=text, sweep_runs=sweep.total) as writer:
        for spec in list(ordered_specs(sweep))[keep]:
            writer.append(run_job(spec))
