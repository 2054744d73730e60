"""A sweep on one and on two workers: throughput, the workers' time not spent in runs, and how long it is in starting."""

from __future__ import annotations

import subprocess
import sys
import tempfile
import time
from concurrent.futures import ThreadPoolExecutor
from functools import partial
from pathlib import Path
from statistics import median
from unittest.mock import patch

import numpy as np
import pandas as pd

from bns.engine.philox import Key
from bns.engine.rprop import Rprop
from bns.engine.snn import initial_weights
from bns.store import Writer, load
from bns.sweep import runner
from bns.sweep.grid import Sweep, parse_sweep
from bns.sweep.job import warm
from bns.sweep.runner import Summary, run_sweep
from tests.bench.clock import alternating
from tests.bench.line import Line, at_least, at_most, without_target

JOBS = 2
EVALUATIONS = 45
FOLD_AT = 16
"""Runs between two folds: eight times as often as a sweep folds by itself, so that a short one has some."""


def sweep_of(runs: int) -> Sweep:
    """Prototype settings, cut to about a second a run: a fifth of a whole one, so the harder test."""
    text = f"name: bench\nrobot: khepera\nseeds: {runs}\nfixed: {{task: circle, evaluations: {EVALUATIONS}}}\n"
    return parse_sweep(text, Path("bench.yaml"))


def began_and_ended(runs: pd.DataFrame) -> tuple[np.ndarray, np.ndarray]:
    """Of each run, seconds since the epoch."""
    began = runs["started_at"].astype("datetime64[us, UTC]").astype("int64").to_numpy() / 1e6
    return began, began + runs["wall_s"].to_numpy()


class Course:
    """One sweep in a folder of its own: when its runs were done (seconds since the epoch), and its runs table."""

    def __init__(self, jobs: int, runs: int) -> None:
        self.jobs, self.stamps = jobs, list[float]()
        folding = patch.object(runner, "Writer", partial(Writer, fold_at=FOLD_AT))
        with tempfile.TemporaryDirectory() as folder, folding:
            summary = run_sweep(sweep_of(runs), Path(folder), jobs=jobs, on_progress=self._note)
            if summary.done != runs:
                raise RuntimeError(f"the sweep stopped early, so its times say nothing: {summary}")
            self.runs: pd.DataFrame = load(folder, "runs")

    def _note(self, summary: Summary) -> None:
        if summary.new:
            self.stamps.append(time.time())

    @property
    def window(self) -> tuple[float, float]:
        """The steady state: from the first run of each worker done until nothing is left to begin."""
        return self.stamps[JOBS - 1], self.stamps[-JOBS]

    @property
    def overhead(self) -> float:
        """Share of the workers' time that is not spent in runs."""
        return 1 - self._in_window().sum() / (self.window[1] - self.window[0]) / self.jobs

    @property
    def folds(self) -> int:
        """Folds in the window: the journal is folded before a run's progress is told."""
        return sum(self.window[0] < stamp <= self.window[1] for stamp in self.stamps[FOLD_AT - 1 :: FOLD_AT])

    def _in_window(self) -> np.ndarray:
        """Seconds of each run that lie in the window."""
        began, ended = began_and_ended(self.runs)
        return np.clip(np.minimum(ended, self.window[1]) - np.maximum(began, self.window[0]), 0, None)


def start_and_end_s() -> tuple[float, float]:
    """Seconds from the command line to the first run, and from the last run to the end of the command.

    A process of its own, whose kernels lie compiled on the disk: imports, the lock, the spec file, what is finished,
    warming up in the parent and in each worker; at the end the last fold and the workers' leave.
    """
    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder) / "bench.yaml"
        file.write_text(sweep_of(JOBS).text)
        command = [sys.executable, "-m", "bns", "sweep", str(file), "--jobs", str(JOBS), "--results", folder]
        called = time.time()
        subprocess.run(command, check=True, capture_output=True)
        left = time.time()
        began, ended = began_and_ended(load(folder, "runs"))
    return float(began.min()) - called, left - float(ended.max())


def hardware_ratio() -> float:
    """What two cores give where nothing is shared: training on two threads (the kernels hold no lock) against one."""
    rng = np.random.default_rng(0)
    X, y = rng.uniform(-1, 1, (5, 400)).astype(np.float32), rng.uniform(-1, 1, (1, 400)).astype(np.float32)
    rules = [Rprop.start(initial_weights(Key(seed, 0), 1, 20), "rprop+") for seed in range(JOBS)]

    def both() -> None:
        list(pool.map(lambda rule: rule.train(X, y, 400, 20_000), rules))

    with ThreadPoolExecutor(JOBS) as pool:
        taken = alternating({"one": lambda: rules[0].train(X, y, 400, 20_000), "both": both}, 3)
    return JOBS * taken["one"] / taken["both"]


def ratio(one: Course, two: Course) -> float:
    """Throughput of the workers against one worker, on the runs that both sweeps have: runs differ in length."""
    common = one.runs.merge(two.runs, on="run_id", suffixes=("_one", "_two"))
    slower = common["wall_s_two"].sum() / common["wall_s_one"].sum()
    return float(two.jobs * (1 - two.overhead) / (1 - one.overhead) / slower)


def measure(quick: bool) -> list[Line]:
    """Two workers against one on the same settings, in turn."""
    warm()
    ratios, overheads, ceilings, ends_of = [], [], [], []
    for _ in range(1 if quick else 2):
        one, two = Course(1, 8 if quick else 12), Course(JOBS, 20 if quick else 40)
        ratios.append(ratio(one, two))
        overheads.append(100 * two.overhead)
        ceilings.append(hardware_ratio())
        ends_of.append(start_and_end_s())
    runs_note = f"{len(two.runs)} runs of {median(two.runs['wall_s']):.2f} s"
    starts, ends = zip(*ends_of, strict=True)
    return [
        at_least("two workers against one, runs a second", median(ratios), 1.9, median(ceilings),
                 f"{runs_note} ({len(one.runs)} on one); ceiling: two bare threads of the training kernel"),
        at_most("sweep overhead: workers' time not spent in runs", median(overheads), 2, "%",
                note=f"steady state of {runs_note}, {two.folds} folds in it"),
        without_target("start-up of a sweep: from the command to the first run", median(starts), "s",
                       f"kernels compiled before; from the last run to the end {median(ends):.2f} s"),
    ]  # fmt: skip
