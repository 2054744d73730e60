"""The studies of both robots on this machine's GPU: slices of them, measured and extrapolated, against what the GPU could do.

    python -m tests.bench.gpu [--runs 2048] [--seconds 200] [--cpu-runs 8] [--json PATH]

Exit code 2, and a sentence, on a machine without a GPU.
"""

from __future__ import annotations

import argparse
import sys
import time
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from statistics import fmean
from typing import Any

import numpy as np

from bns.cuda.batch import Batch, warm
from bns.cuda.device import OutOfDeviceMemoryError, device_name
from bns.errors import DeviceError
from bns.robots import load_robot
from bns.spec import RunSpec
from bns.sweep.expand.grid import load_sweep
from bns.sweep.expand.order import ordered_specs
from tests.bench import operations
from tests.bench.__main__ import write
from tests.bench.line import Line, at_least, at_most, without_target

ROOT = Path(__file__).resolve().parents[2]
BATCH = {"khepera": 2048, "snake": 512}
"""Runs side by side: enough to fill an H200, and a batch of the snake's is some six times the work."""
STUDIES = ("khepera", "snake")
WITHIN_MIN = {"khepera": 15}
TOGETHER_MIN = 60
ORIGINAL_NS = 62.0
"""Of the original's library: an iteration, a training pattern and a hidden neuron, on one core."""
_LANES = {(7, 0): 64, (7, 5): 64, (8, 0): 64}
"""Single-precision lanes of a multiprocessor by compute capability; 128 in all others since 8.6."""


@dataclass(frozen=True)
class Peak:
    """What the GPU could do at its highest clocks: single-precision operations and bytes of its memory, a second."""

    flops: float
    bytes_s: float


@dataclass(frozen=True)
class Slice:
    """What was measured of a study of ``study_runs``: runs and their wall seconds, those of training and evolution among them;
    operations, bytes, and training's iterations x patterns x hidden neurons; ``cpu_s``: mean seconds of a run on one core."""

    robot: str
    study_runs: int
    runs: int
    wall_s: float
    training_s: float
    evolution_s: float
    training_ops: float
    evolution_ops: float
    moved_bytes: float
    neuron_iterations: float
    cpu_s: float

    @property
    def study_min(self) -> float:
        """Minutes of the whole study at this rate."""
        return self.study_runs / self.runs * self.wall_s / 60

    def floor_min(self, peak: Peak) -> float:
        """Minutes of the whole study at the GPU's peak."""
        least_s = max((self.training_ops + self.evolution_ops) / peak.flops, self.moved_bytes / peak.bytes_s)
        return self.study_runs / self.runs * least_s / 60


def peak_of(device: Any) -> Peak:
    """From the device's attributes; a multiplication with an addition counts as two operations."""
    lanes = _LANES.get(tuple(device.compute_capability), 128)
    flops = 2.0 * lanes * device.MULTIPROCESSOR_COUNT * device.CLOCK_RATE * 1e3
    return Peak(flops, 2.0 * device.MEMORY_CLOCK_RATE * 1e3 * device.GLOBAL_MEMORY_BUS_WIDTH / 8)


def measured(specs: Sequence[RunSpec], study_runs: int, batch: int, seconds: float, cpu_runs: int) -> Slice:
    """As many batches of these runs as fit into the time, at least one; compiled and warmed up before."""
    robot = load_robot(specs[0].robot)
    warm(robot.name)
    began, runs, sums = time.perf_counter(), 0, np.zeros(6)
    while runs < len(specs):
        some = specs[runs : runs + batch]
        sums += _carried_out(some)
        runs += len(some)
        so_far = time.perf_counter() - began
        if so_far + so_far * len(some) / runs > seconds:
            break
    wall_s = time.perf_counter() - began
    return Slice(robot.name, study_runs, runs, wall_s, *sums, _cpu_s(specs[:runs], cpu_runs))


def lines_of(part: Slice, peak: Peak) -> list[Line]:
    """What one slice shows."""
    name, study, ops = part.robot, part.study_runs / part.runs, part.training_ops + part.evolution_ops
    share = part.training_ops / part.training_s / peak.flops
    told = (
        f"{part.runs / part.wall_s:.0f} runs/s; {part.training_s / part.wall_s:.0%} training, "
        f"{part.evolution_s / part.wall_s:.0%} evolution"
    )
    title, floor = f"{name}: the study of {part.study_runs} runs, from {part.runs} of them", part.floor_min(peak)
    within = WITHIN_MIN.get(name)
    whole = Line(title, part.study_min, within, "min", True, floor, told)
    return [
        whole,
        at_least(f"{name}: training, share of the peak in single precision, percent", 100 * share, 25, 100),
        without_target(
            f"{name}: operations of the study", study * ops / 1e15, "P", f"{study * ops / peak.flops:.0f} s at the peak"
        ),
        without_target(
            f"{name}: bytes of the study's lists of commands", study * part.moved_bytes / 1e12, "TB",
            f"{study * part.moved_bytes / peak.bytes_s:.0f} s at the memory's peak",
        ),
        without_target(
            f"{name}: this GPU : one core of this machine, same engine", part.cpu_s / (part.wall_s / part.runs), "x",
            f"{part.cpu_s:.2f} s a run there",
        ),
        without_target(
            f"{name}: training, this GPU : the original's library on one core",
            part.neuron_iterations * ORIGINAL_NS * 1e-9 / part.training_s, "x", f"{ORIGINAL_NS:g} ns a pattern and neuron there",
        ),
    ]  # fmt: skip


def table_of(parts: Sequence[Slice], peak: Peak) -> list[Line]:
    """All lines: every slice's, and where both studies were measured, how long they take together."""
    lines = [line for part in parts for line in lines_of(part, peak)]
    if {part.robot for part in parts} == set(STUDIES):
        whole, floor = (sum(found) for found in zip(*((p.study_min, p.floor_min(peak)) for p in parts), strict=True))
        lines.append(at_most("the whole study with the snake", whole, TOGETHER_MIN, "min", floor))
    return lines


def main(arguments: list[str] | None = None) -> int:
    """Command line."""
    parser = argparse.ArgumentParser(prog="python -m tests.bench.gpu", description="The studies on a GPU.")
    parser.add_argument("--runs", type=int, default=2048, help="runs of each slice at most (default: %(default)s)")
    parser.add_argument("--seconds", type=float, default=200.0, help="time for each (default: %(default)s)")
    parser.add_argument("--cpu-runs", type=int, default=8, help="of them repeated on one core (default: %(default)s)")
    parser.add_argument("--json", type=Path, metavar="PATH", help="write the lines to this file as well")
    options = parser.parse_args(arguments)
    parts: list[Slice] = []
    try:
        print(device_name(), flush=True)
        peak = peak_of(current_device())
        for study in STUDIES:
            specs = ordered_specs(load_sweep(ROOT / "sweeps" / f"{study}.yaml"))
            parts.append(measured(specs[: options.runs], len(specs), BATCH[study], options.seconds, options.cpu_runs))
            for line in lines_of(parts[-1], peak):
                print(line.in_words(), flush=True)
    except (DeviceError, OutOfDeviceMemoryError) as error:
        print(f"bench-gpu: {'the rest was not' if parts else 'nothing'} measured. {error}", file=sys.stderr)
        return DeviceError.exit_code
    lines = table_of(parts, peak)
    print(lines[-1].in_words())
    if options.json:
        write(options.json, lines, False)
    return 0


def current_device() -> Any:
    """The GPU, with its attributes."""
    from numba import cuda

    return cuda.get_current_device()


def _carried_out(specs: Sequence[RunSpec]) -> np.ndarray:
    """Seconds of training and of evolution; operations of both; bytes; training's iterations x patterns x hidden neurons."""
    batch, patterns = Batch(specs), np.zeros(len(specs))
    while not batch.done:
        batch.step()
        patterns += np.where([spec.evaluations >= batch.evaluation for spec in specs], batch.patterns(), 0)
    sums = np.zeros(6)
    for spec, evals, count in zip(specs, batch.evals(), patterns, strict=True):
        if isinstance(evals, ArithmeticError):
            raise evals  # a figure over runs that failed would be worth nothing
        sums += (
            float(evals["training_cpu_s"].sum()), float(evals["evolution_cpu_s"].sum()),
            operations.training(batch.robot, spec, count), operations.evolution(batch.robot, spec, evals),
            _moved(spec, evals, len(batch.robot.command_columns)),
            count * spec.training_iterations_per_evaluation * operations.neurons(batch.robot),
        )  # fmt: skip
    return sums


def _cpu_s(specs: Sequence[RunSpec], runs: int) -> float:
    """Mean processor seconds of runs spread over the slice."""
    from bns.sweep.jobs.job import run_job

    return fmean(run_job(spec).run["cpu_s"] for spec in specs[:: max(1, len(specs) // runs)][:runs])


def _moved(spec: RunSpec, evals: dict[str, np.ndarray], components: int) -> float:
    """Bytes of command lists: read from two parents, written, and read to be scored, each generation."""
    lists = float(evals["mean_commands"].sum()) * spec.population_size * components * 4
    return lists * 3 * spec.generations_per_evaluation


if __name__ == "__main__":
    sys.exit(main())
