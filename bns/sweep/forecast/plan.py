"""What a sweep would take, before it is begun."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING

from bns.spec import RunSpec
from bns.store.archive.read import recorded
from bns.store.read.reader import finished, load
from bns.store.write.compaction import bytes_per_run
from bns.sweep.expand.grid import Sweep
from bns.sweep.expand.order import ordered_specs
from bns.sweep.expand.shard import Shard
from bns.sweep.forecast.pace import Pace
from bns.sweep.jobs.executor import Job
from bns.sweep.jobs.job import check_world_files, run_job

if TYPE_CHECKING:  # a third of a second to load, and a sweep needs no table
    import pandas as pd

_TRIAL_EVALUATIONS = 20
_BYTES_PER_EVALUATION = 100
"""Measured with 100 evaluations a run and 40 runs a file."""


START_UP_S = 10.0
"""Until all workers of a machine are at work: interpreters, libraries, kernels loaded from disk. Measured: 3 to 10 s."""


def wall_s(seconds: float, runs: int, workers: int) -> float:
    """Wall time, s, of runs that take ``seconds`` together on one worker: start-up, then as many at once as workers."""
    return START_UP_S + math.ceil(runs / workers) * seconds / runs if runs else 0.0


@dataclass(frozen=True)
class Plan:
    """Runs, wall time and disk space of a sweep; ``basis`` says where the estimate comes from.

    ``remaining`` counts what a run of the sweep would do now; a run that failed counts as had.
    """

    sweep: str
    total: int
    done: int
    remaining: int
    seconds_estimate: float
    bytes_estimate: float
    basis: str


def work(run: RunSpec) -> float:
    """Seconds that a run might take on one core; good for ratios only.

    Evolution goes with population and generations, training with the patterns so far (four an evaluation).
    """
    evolution = run.population_size * run.generations_per_evaluation * 0.75e-6
    training = run.training_iterations_per_evaluation * 2 * run.evaluations * 1e-7
    return run.evaluations * (evolution + training + 1e-4)


def plan(
    sweep: Sweep,
    results: Path,
    jobs: int,
    shard: Shard | None = None,
    *,
    retry_failed: bool = False,
    job: Job = run_job,
    warm_up: Callable[[], object] | None = None,
) -> Plan:
    """Count and estimate, the whole or one ``shard``. Without stored runs of this sweep, one short run is carried out and timed.

    Nothing is written. The seconds are wall time with ``jobs`` workers, their start-up included if there are several; NaN if
    the trial run failed.

    Raises:
        ModelError: a model file that runs to do name as their world is missing or no such file.
    """
    had = {run for run, status in recorded(results, sweep.name).items() if status == "ok" or not retry_failed}
    everything = ordered_specs(sweep)
    specs = everything if shard is None else list(shard.share(everything))
    todo = [spec for spec in specs if spec.run_id not in had] if had else specs
    if not todo:
        return Plan(sweep.name, len(specs), len(specs), 0, 0.0, 0.0, "nothing is left to do")
    if job is run_job:
        check_world_files(todo, sweep.place_of)
    stored = "ok" in finished(results, sweep.name).values()
    seconds, basis = _from_store(results, sweep.name, todo) if stored else _from_trial(todo, job, warm_up)
    return Plan(
        sweep.name,
        len(specs),
        len(specs) - len(todo),
        len(todo),
        seconds if jobs == 1 else wall_s(seconds, len(todo), jobs),
        _bytes(results, sweep.name, todo),
        basis,
    )


def _from_store(results: Path, sweep: str, todo: list[RunSpec]) -> tuple[float, str]:
    columns = [
        "population_size",
        "generations_per_evaluation",
        "training_iterations_per_evaluation",
        "evaluations",
        "wall_s",
    ]
    runs = load(results, "runs", columns=columns, where={"sweep": sweep, "status": "ok"})
    runs["work"] = [work(row) for row in runs.itertuples()]  # type: ignore[arg-type] # same names
    sums: pd.DataFrame = runs.groupby("population_size")[["wall_s", "work"]].sum()
    pace = dict(zip(sums.index, sums["wall_s"] / sums["work"], strict=True))
    overall = float(runs["wall_s"].sum() / runs["work"].sum())
    new_sizes = sorted({spec.population_size for spec in todo} - set(pace))
    basis = f"the mean of {len(runs)} stored runs of this sweep"
    if new_sizes:
        basis += f"; population sizes {', '.join(map(str, new_sizes))} have none and are scaled by work"
    return math.fsum(work(spec) * pace.get(spec.population_size, overall) for spec in todo), basis


def _from_trial(todo: list[RunSpec], job: Job, warm_up: Callable[[], object] | None) -> tuple[float, str]:
    middle = sorted(todo, key=work)[len(todo) // 2]
    trial = replace(middle, evaluations=min(middle.evaluations, _TRIAL_EVALUATIONS))
    if warm_up is not None:
        warm_up()
    record = job(trial)
    if record.run["status"] != "ok":
        return math.nan, f"none: a trial run of {trial.canonical_json()} failed with {record.run['error']}"
    basis = f"the parts of one trial run of {trial.evaluations} evaluations ({record.run['wall_s']:.2f} s)"
    pace = Pace.of(record)
    return math.fsum(pace.seconds(spec) for spec in todo), basis


def _bytes(results: Path, sweep: str, todo: list[RunSpec]) -> float:
    stored = bytes_per_run(results, sweep)
    if not math.isnan(stored):
        return stored * len(todo)
    return float(_BYTES_PER_EVALUATION * sum(spec.evaluations for spec in todo))
