"""What ``bns plan`` forecasts from one short run, beside what the sweep then takes."""

from __future__ import annotations

import tempfile
from pathlib import Path
from statistics import median

from bns.store import load
from bns.sweep.expand.grid import parse_sweep
from bns.sweep.forecast.plan import plan
from bns.sweep.jobs.executor import SerialExecutor
from bns.sweep.jobs.job import warm
from bns.sweep.runner import run_sweep
from tests.bench.line import Line, at_most

TEXT = """
name: mixed
robot: khepera
seeds: 2
fixed: {evaluations: 40}
grid: {population_size: [20, 100, 400]}
"""


def measure(quick: bool) -> list[Line]:
    """The median of three, as how many times one is the other, whichever is more: 1 is a forecast that came true."""
    sweep, ratios = parse_sweep(TEXT, Path("mixed.yaml")), []
    for _ in range(1 if quick else 3):
        with tempfile.TemporaryDirectory() as folder:
            forecast_s = plan(sweep, Path(folder), 1, warm_up=warm).seconds_estimate
            run_sweep(sweep, Path(folder), executor=SerialExecutor())
            ratios.append(forecast_s / load(folder, "runs")["wall_s"].sum())
    note = "forecast over measured: " + ", ".join(f"{ratio:.2f}" for ratio in ratios)
    return [at_most("bns plan of a mixed sweep against its run", median(max(r, 1 / r) for r in ratios), 1.5, "x", note=note)]
