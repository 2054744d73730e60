"""A sweep on Dask while a worker is killed every minute: ``make soak-dask`` (twenty minutes).

Five minutes undisturbed, ten with kills, five undisturbed again, in one store; then what became of the runs.
"""

import argparse
import json
import sys
import tempfile
import time
from dataclasses import asdict, dataclass
from pathlib import Path

from dask_cluster import Cluster, Killer

from bns.store import load
from bns.sweep.budget import Budget
from bns.sweep.expand.grid import Sweep, parse_sweep
from bns.sweep.jobs.dask_workers import DaskExecutor
from bns.sweep.jobs.executor import Job
from bns.sweep.jobs.job import run_job
from bns.sweep.runner import run_sweep

TEXT = """
name: soak
robot: khepera
seeds: 5000
fixed: {task: circle, evaluations: 60}
grid: {population_size: [200, 400]}
"""
WANTED = 0.85


@dataclass(frozen=True)
class Stretch:
    """What was swept at a stretch: ``runs`` in ``seconds``, of which workers spent ``work_s`` on the stored runs."""

    runs: int
    seconds: float
    work_s: float

    def __add__(self, other: "Stretch") -> "Stretch":
        return Stretch(self.runs + other.runs, self.seconds + other.seconds, self.work_s + other.work_s)


@dataclass(frozen=True)
class Verdict:
    """The rate with kills over the rate without, and the same of the workers' time that went into stored runs.

    The second is the one to trust where other programs disturb the machine: a run that they slow down counts for more.
    """

    kills: int
    kept_rate: float
    kept_time: float
    counted: int
    stored: int
    twice: int
    not_ok: int
    repeated: int

    @property
    def is_clean(self) -> bool:
        """Whether every run that was counted is stored once, and ok."""
        return self.counted == self.stored and not self.twice and not self.not_ok


def soak(
    cluster: Cluster,
    results: Path,
    sweep: Sweep,
    undisturbed_s: float,
    disturbed_s: float,
    every_s: float,
    job: Job = run_job,
) -> Verdict:
    """Sweep undisturbed, with kills, and undisturbed again."""
    warm_up = stretch(cluster, results, sweep, every_s, job, limit=2)
    before = stretch(cluster, results, sweep, undisturbed_s, job)
    with Killer(cluster.address, every_s) as killer:
        disturbed = stretch(cluster, results, sweep, disturbed_s, job)
    undisturbed = before + stretch(cluster, results, sweep, undisturbed_s, job)
    runs, evals = load(results, "runs"), load(results, columns=["run_id", "evaluation"])
    return Verdict(
        kills=killer.kills,
        kept_rate=disturbed.runs / disturbed.seconds / (undisturbed.runs / undisturbed.seconds),
        kept_time=disturbed.work_s / disturbed.seconds / (undisturbed.work_s / undisturbed.seconds),
        counted=(warm_up + undisturbed + disturbed).runs,
        stored=len(runs),
        twice=int(runs["run_id"].duplicated().sum() + evals.duplicated().sum()),
        not_ok=int((runs["status"] != "ok").sum()),
        repeated=int((runs["attempts"] > 1).sum()),
    )


def stretch(
    cluster: Cluster, results: Path, sweep: Sweep, seconds: float, job: Job, limit: int | None = None
) -> Stretch:
    """Sweep for about that long."""
    before_s = load(results, "runs")["wall_s"].sum() if results.exists() and any(results.iterdir()) else 0.0
    executor, began = DaskExecutor(cluster.address, job=job), time.monotonic()
    summary = run_sweep(
        sweep, results, job=job, executor=executor, warm_up=int, budget=Budget(seconds), limit=limit
    )
    elapsed_s = time.monotonic() - began
    print(f"{summary.new} runs in {elapsed_s:.1f} s", file=sys.stderr, flush=True)
    return Stretch(summary.new, elapsed_s, load(results, "runs")["wall_s"].sum() - before_s)


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--minutes", type=float, default=10.0, help="with kills")
    parser.add_argument("--undisturbed", type=float, metavar="MINUTES", help="before, and again after")
    parser.add_argument("--every", type=float, default=60.0, help="seconds between kills")
    options = parser.parse_args()
    with tempfile.TemporaryDirectory() as folder, Cluster(2) as cluster:
        sweep = parse_sweep(TEXT, Path("soak.yaml"))
        undisturbed_s = 60 * (options.undisturbed or options.minutes / 2)
        verdict = soak(cluster, Path(folder), sweep, undisturbed_s, 60 * options.minutes, options.every)
    print(json.dumps(asdict(verdict)))
    return 0 if verdict.is_clean and verdict.kills and verdict.kept_time >= WANTED else 1


if __name__ == "__main__":
    sys.exit(main())
