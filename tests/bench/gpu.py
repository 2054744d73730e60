"""The Khepera study on this machine's GPU: a slice of it, measured and extrapolated, against what the GPU could do.

    python -m tests.bench.gpu [--runs 2048] [--seconds 300] [--json PATH]

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

from bns.cuda.batch import Batch
from bns.cuda.device import device_name
from bns.errors import DeviceError
from bns.robots.khepera import ROBOT
from bns.spec import RunSpec
from bns.sweep.grid import load_sweep
from bns.sweep.order import ordered_specs
from tests.bench.__main__ import write
from tests.bench.line import Line, at_least, at_most, without_target
from tests.bench.whole_run import operations

ROOT = Path(__file__).resolve().parents[2]
BATCH = 2048
CPU_RUNS = 12
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
    """What was measured: runs and their wall seconds, those of training and evolution among them; operations, bytes,
    and training's iterations x patterns x hidden neurons."""

    runs: int
    wall_s: float
    training_s: float
    evolution_s: float
    training_ops: float
    evolution_ops: float
    moved_bytes: float
    neuron_iterations: float


def peak_of(device: Any) -> Peak:
    """From the device's attributes; a multiplication with an addition counts as two operations."""
    lanes = _LANES.get(tuple(device.compute_capability), 128)
    flops = 2.0 * lanes * device.MULTIPROCESSOR_COUNT * device.CLOCK_RATE * 1e3
    return Peak(flops, 2.0 * device.MEMORY_CLOCK_RATE * 1e3 * device.GLOBAL_MEMORY_BUS_WIDTH / 8)


def measured(batches: Sequence[Sequence[RunSpec]], seconds: float) -> Slice:
    """As many of the batches as fit into the time, at least one; compiled and warmed up before."""
    _carried_out([RunSpec(evaluations=1, population_size=8)])
    began, runs, times, done = time.perf_counter(), 0, np.zeros(2), []
    for specs in batches:
        evals = _carried_out(specs)
        done += list(zip(specs, evals, strict=True))
        runs += len(specs)
        times += [sum(float(columns[name].sum()) for columns in evals) for name in ("training_cpu_s", "evolution_cpu_s")]
        so_far = time.perf_counter() - began
        if so_far + so_far * len(specs) / runs > seconds:
            break
    ops = np.array([operations(spec, columns) for spec, columns in done]).sum(axis=0)
    return Slice(
        runs, time.perf_counter() - began, *times, *ops,
        sum(_moved(spec, columns) for spec, columns in done), sum(_neuron_iterations(*one) for one in done),
    )  # fmt: skip


def lines_of(part: Slice, peak: Peak, study_runs: int, cpu_s: float) -> list[Line]:
    """The table; cpu_s is what a run of the same slice takes one core of this machine, on average."""
    study, run_s = study_runs / part.runs, part.wall_s / part.runs
    ops, share = part.training_ops + part.evolution_ops, part.training_ops / part.training_s / peak.flops
    floor_s = max(ops / peak.flops, part.moved_bytes / peak.bytes_s)
    return [
        at_most(
            f"the study of {study_runs} runs, from {part.runs} of them", study * part.wall_s / 60, 15, "min",
            study * floor_s / 60, f"{part.runs / part.wall_s:.0f} runs/s; {part.training_s / part.wall_s:.0%} training, "
            f"{part.evolution_s / part.wall_s:.0%} evolution",
        ),
        at_least("training: share of the peak in single precision, percent", 100 * share, 25, 100),
        without_target("operations of the study", study * ops / 1e15, "P", f"{study * ops / peak.flops:.0f} s at the peak"),
        without_target(
            "bytes of the study's lists of commands", study * part.moved_bytes / 1e12, "TB",
            f"{study * part.moved_bytes / peak.bytes_s:.0f} s at the memory's peak",
        ),
        without_target("this GPU : one core of this machine, same engine", cpu_s / run_s, "x", f"{cpu_s:.2f} s a run there"),
        without_target(
            "training: this GPU : the original's library on one core",
            part.neuron_iterations * ORIGINAL_NS * 1e-9 / part.training_s, "x", f"{ORIGINAL_NS:g} ns a pattern and neuron there",
        ),
    ]  # fmt: skip


def main(arguments: list[str] | None = None) -> int:
    """Command line."""
    parser = argparse.ArgumentParser(prog="python -m tests.bench.gpu", description="The Khepera study on a GPU.")
    parser.add_argument("--runs", type=int, default=2 * BATCH, help="runs of the slice at most (default: %(default)s)")
    parser.add_argument("--seconds", type=float, default=300.0, help="time for them (default: %(default)s)")
    parser.add_argument("--json", type=Path, metavar="PATH", help="write the lines to this file as well")
    options = parser.parse_args(arguments)
    try:
        name = device_name()
    except DeviceError as error:
        print(f"bench-gpu: nothing measured. {error}", file=sys.stderr)
        return error.exit_code
    from numba import cuda

    print(name)
    specs = ordered_specs(load_sweep(ROOT / "sweeps" / "khepera.yaml"))
    chosen = specs[: options.runs]
    part = measured([chosen[at : at + BATCH] for at in range(0, len(chosen), BATCH)], options.seconds)
    lines = lines_of(part, peak_of(cuda.get_current_device()), len(specs), _cpu_s(chosen))
    for line in lines:
        print(line.in_words())
    if options.json:
        write(options.json, lines, False)
    return 0


def _carried_out(specs: Sequence[RunSpec]) -> list[Any]:
    batch = Batch(specs)
    while not batch.done:
        batch.step()
    found = batch.evals()
    faults = [columns for columns in found if isinstance(columns, ArithmeticError)]
    if faults:
        raise faults[0]  # a figure over runs that failed would be worth nothing
    return found


def _cpu_s(specs: Sequence[RunSpec]) -> float:
    """Mean processor seconds of runs spread over the slice."""
    from bns.sweep.job import run_job

    return fmean(run_job(spec).run["cpu_s"] for spec in specs[:: max(1, len(specs) // CPU_RUNS)][:CPU_RUNS])


def _moved(spec: RunSpec, evals: dict[str, np.ndarray]) -> float:
    """Bytes of command lists: read from two parents, written, and read to be scored, each generation."""
    lists = float(evals["mean_commands"].sum()) * spec.population_size * 3 * 4
    return lists * 3 * spec.generations_per_evaluation


def _neuron_iterations(spec: RunSpec, evals: dict[str, np.ndarray]) -> float:
    neurons = len(ROBOT.networks) * ROBOT.hidden
    return float(evals["training_patterns"].sum()) * spec.training_iterations_per_evaluation * neurons


if __name__ == "__main__":
    sys.exit(main())
