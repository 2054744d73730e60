"""Do the GPU and the CPU give the same study? The same runs on both, compared by their statistics.

    python -m tests.bench.devices [--runs 200] [--robot snake] [--evaluations 100] [--jobs N] [--json PATH]

Both draw the same numbers, but round otherwise, so that single runs part after some generations. What must not differ is what a
study is made of: success, diversity and fitness error. Runs are compared in pairs of the same seed: success by the exact test of
McNemar, numbers by Wilcoxon's signed ranks, at three evaluations, with Holm's correction over all. Exit code 1 if any differs.
"""

from __future__ import annotations

import argparse
import json
import sys
from collections.abc import Sequence
from dataclasses import asdict, dataclass
from pathlib import Path

import numpy as np
from joblib import Parallel, delayed
from scipy.stats import binomtest, wilcoxon

from analysis.multiple_tests import holm
from bns.cuda.batch import Batch
from bns.cuda.device import OutOfDeviceMemoryError, device_name
from bns.errors import DeviceError
from bns.spec import RunSpec
from bns.sweep.jobs.cores import cores
from bns.sweep.jobs.job import run_job
from bns.tasks import task_names

ROBOTS = ("khepera", "snake")
NUMBERS = ("diversity", "fitness_error")
SUCCESS = "success"
ALPHA = 0.01
ROUNDING = 1e-3
"""Numbers as near as this, relatively, count as equal: runs that have not parted yet differ by rounding, and that has a sign."""
_SHARES = (0.25, 0.5, 1.0)
"""Of a run's evaluations: when it is compared."""


@dataclass(frozen=True)
class Comparison:
    """Means on both devices of one column at one evaluation, and how likely so large a difference is by chance alone."""

    robot: str
    column: str
    evaluation: int
    runs: int
    gpu: float
    cpu: float
    p: float

    def in_words(self, adjusted_p: float) -> str:
        """One row of the table."""
        what = f"{self.robot}: {self.column} at evaluation {self.evaluation}"
        verdict = "DIFFERS" if adjusted_p < ALPHA else "the same"
        return f"{what:48s} GPU {self.gpu:9.4g}  CPU {self.cpu:9.4g}  {self.runs} pairs  p {adjusted_p:.2g}  {verdict}"


def specs_of(robot: str, runs: int, **changes: object) -> list[RunSpec]:
    """So many runs at the source's settings, the tasks by turns, every seed once."""
    tasks = task_names(robot)
    return [RunSpec(robot=robot, task=tasks[seed % len(tasks)], seed=seed, **changes) for seed in range(runs)]  # type: ignore[arg-type]


def on_gpu(specs: Sequence[RunSpec]) -> list[dict[str, np.ndarray]]:
    """The columns of every run; ArithmeticError of the first that failed."""
    batch = Batch(specs)
    while not batch.done:
        batch.step()
    return [_whole(columns) for columns in batch.evals()]


def on_cpu(specs: Sequence[RunSpec], jobs: int) -> list[dict[str, np.ndarray]]:
    """Likewise, shared out to processes."""
    return list(Parallel(n_jobs=jobs)(delayed(_columns)(spec) for spec in specs))


def compared(
    specs: Sequence[RunSpec], gpu: Sequence[dict[str, np.ndarray]], cpu: Sequence[dict[str, np.ndarray]]
) -> list[Comparison]:
    """Success and numbers of pairs of runs (all of one length) at three evaluations."""
    found, evaluations = [], specs[0].evaluations
    for evaluation in sorted({max(1, round(share * evaluations)) for share in _SHARES}):
        for column in (SUCCESS, *NUMBERS):
            there, here = (np.array([one[column][evaluation - 1] for one in side], float) for side in (gpu, cpu))
            p = _same_rate(there, here) if column == SUCCESS else _same_middle(there, here)
            found.append(
                Comparison(specs[0].robot, column, evaluation, len(specs), float(there.mean()), float(here.mean()), p)
            )
    return found


def main(arguments: list[str] | None = None) -> int:
    """Command line."""
    parser = argparse.ArgumentParser(prog="python -m tests.bench.devices", description="GPU and CPU compared by whole runs.")
    parser.add_argument("--runs", type=int, default=200, help="runs a side and robot (default: %(default)s)")
    parser.add_argument("--robot", choices=ROBOTS, help="one robot alone")
    parser.add_argument("--evaluations", type=int, default=100, help="of each run (default: %(default)s)")
    parser.add_argument("--jobs", type=int, help="processes on the CPU's side (default: all cores)")
    parser.add_argument("--json", type=Path, metavar="PATH", help="write the comparisons to this file as well")
    options = parser.parse_args(arguments)
    comparisons: list[Comparison] = []
    try:
        print(device_name(), flush=True)
        for robot in (options.robot,) if options.robot else ROBOTS:
            specs = specs_of(robot, options.runs, evaluations=options.evaluations)
            comparisons += compared(specs, on_gpu(specs), on_cpu(specs, cores(options.jobs)))
    except (DeviceError, OutOfDeviceMemoryError) as error:
        print(f"devices: nothing compared. {error}", file=sys.stderr)
        return DeviceError.exit_code
    return report(comparisons, options.json)


def report(comparisons: Sequence[Comparison], path: Path | None) -> int:
    """Print all; 1 if any differs."""
    adjusted = holm([one.p for one in comparisons])
    for one, p in zip(comparisons, adjusted, strict=True):
        print(one.in_words(p))
    if path is not None:
        path.parent.mkdir(parents=True, exist_ok=True)
        rows = [asdict(one) | {"adjusted_p": float(p)} for one, p in zip(comparisons, adjusted, strict=True)]
        path.write_text(json.dumps(rows, indent=1) + "\n")
    return int((adjusted < ALPHA).any())


def _columns(spec: RunSpec) -> dict[str, np.ndarray]:
    record = run_job(spec)
    if "evals" not in record.tables:
        raise RuntimeError(f"{spec.run_id} failed on the CPU: {record.run['error']}")
    return dict(record.tables["evals"])


def _whole(columns: dict[str, np.ndarray] | ArithmeticError) -> dict[str, np.ndarray]:
    if isinstance(columns, ArithmeticError):
        raise columns
    return columns


def _same_rate(there: np.ndarray, here: np.ndarray) -> float:
    """Exact test of McNemar: among the pairs that differ, either side wins equally often."""
    differ = there != here
    return float(binomtest(int(there[differ].sum()), int(differ.sum())).pvalue) if differ.any() else 1.0


def _same_middle(there: np.ndarray, here: np.ndarray) -> float:
    apart = np.where(np.abs(there - here) > ROUNDING * np.abs(here), there - here, 0.0)
    return float(wilcoxon(apart).pvalue) if apart.any() else 1.0


if __name__ == "__main__":
    sys.exit(main())
