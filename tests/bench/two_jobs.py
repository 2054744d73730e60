"""A sweep on one and on two workers: throughput, and what of the workers' time is not spent in runs."""

from __future__ import annotations

import tempfile
import time
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from statistics import median

import numpy as np
import pandas as pd

from bns.engine.philox import Key
from bns.engine.rprop import Rprop
from bns.engine.snn import initial_weights
from bns.store import load
from bns.sweep.grid import Sweep
from bns.sweep.job import warm
from bns.sweep.runner import Summary, run_sweep
from tests.bench.clock import alternating
from tests.bench.line import Line, at_least, at_most

JOBS = 2
COMBO = {"evaluations": 20}


def sweep_of(runs: int) -> Sweep:
    """Prototype settings, cut short: the shorter a run, the harder the test."""
    return Sweep("bench", "khepera", runs, (COMBO,), "", Path("bench.yaml"))


class Course:
    """One sweep in a folder of its own: when its runs were done (seconds since the epoch), and its runs table."""

    def __init__(self, jobs: int, runs: int) -> None:
        self.jobs, self.stamps = jobs, list[float]()
        with tempfile.TemporaryDirectory() as folder:
            run_sweep(sweep_of(runs), Path(folder), jobs=jobs, on_progress=self._note)
            self.runs: pd.DataFrame = load(folder, "runs")

    def _note(self, summary: Summary) -> None:
        if summary.new:
            self.stamps.append(time.time())

    @property
    def window(self) -> tuple[float, float]:
        """The steady state: from the first run of each worker done until nothing is left to begin."""
        return self.stamps[JOBS - 1], self.stamps[-JOBS]

    @property
    def throughput(self) -> float:
        """Runs a second, parts of runs included, while all workers are at work."""
        return float((self._in_window() / self.runs["wall_s"]).sum()) / (self.window[1] - self.window[0])

    @property
    def overhead(self) -> float:
        """Share of the workers' time that is not spent in runs."""
        return 1 - self._in_window().sum() / (self.window[1] - self.window[0]) / self.jobs

    def _in_window(self) -> np.ndarray:
        """Seconds of each run that lie in the window."""
        began = self.runs["started_at"].astype("datetime64[us, UTC]").astype("int64").to_numpy() / 1e6
        ended = began + self.runs["wall_s"].to_numpy()
        return np.clip(np.minimum(ended, self.window[1]) - np.maximum(began, self.window[0]), 0, None)


def hardware_ratio() -> float:
    """What two cores give where nothing is shared: training on two threads (the kernels hold no lock) against one."""
    rng = np.random.default_rng(0)
    X, y = rng.uniform(-1, 1, (5, 400)).astype(np.float32), rng.uniform(-1, 1, (1, 400)).astype(np.float32)
    rules = [Rprop.start(initial_weights(Key(seed, 0), 1, 20), "rprop+") for seed in range(JOBS)]

    def both() -> None:
        list(pool.map(lambda rule: rule.train(X, y, 400, 20_000), rules))

    with ThreadPoolExecutor(JOBS) as pool:
        taken = alternating({"one": lambda: rules[0].train(X, y, 400, 20_000), "both": both}, 5)
    return JOBS * taken["one"] / taken["both"]


def measure(quick: bool) -> list[Line]:
    """Two workers against one on the same runs, in turn."""
    warm()
    runs, rounds = (8, 1) if quick else (16, 3)
    ratios, overheads, ceilings = [], [], []
    for _ in range(rounds):
        one, two = Course(1, runs), Course(JOBS, runs)
        ratios.append(two.throughput / one.throughput)
        overheads.append(two.overhead)
        ceilings.append(hardware_ratio())
    runs_note = f"{runs} runs of {median(two.runs['wall_s']):.2f} s"
    return [
        at_least("two workers against one, runs a second", median(ratios), 1.9, median(ceilings),
                 f"{runs_note}; ceiling: two bare threads of the training kernel"),
        at_most("sweep overhead: workers' time not spent in runs", 100 * median(overheads), 2, "%", note=runs_note),
    ]  # fmt: skip
