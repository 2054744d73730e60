"""A sweep on one and on two workers: throughput, the workers' time not spent in runs, and how long it is in starting."""

from __future__ import annotations

import subprocess
import sys
import tempfile
import time
from functools import partial
from pathlib import Path
from statistics import median
from unittest.mock import patch

import numpy as np
import pandas as pd

from bns.store import Writer, load
from bns.sweep import runner
from bns.sweep.expand.grid import Sweep, parse_sweep
from bns.sweep.jobs.job import warm
from bns.sweep.runner import Summary, run_sweep
from tests.bench.line import Line, at_least, at_most, without_target
from tests.bench.side_by_side import JOBS, slowdowns

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


def measure(quick: bool) -> list[Line]:
    """What a worker loses to the one beside it, and what both lose to the sweep around them."""
    warm()
    run_slower, bare_slower = slowdowns(EVALUATIONS, 3 if quick else 11)
    one, two = Course(1, 8 if quick else 20), Course(JOBS, 20 if quick else 60)
    gained = JOBS / run_slower * (1 - two.overhead) / (1 - one.overhead)
    ceiling = JOBS / bare_slower
    starts, ends = zip(*(start_and_end_s() for _ in range(1 if quick else 5)), strict=True)
    runs_note = f"{len(two.runs)} runs of {median(two.runs['wall_s']):.2f} s"
    return [
        at_least("two workers against one, runs a second", gained, 1.9, ceiling,
                 "runs alone and side by side by turns, less each sweep's overhead; ceiling: two processes that only compute"),
        at_least("  against two processes that only compute", gained / ceiling, 0.95,
                 note="where others use the machine as well, this is what the sweep can answer for"),
        at_most("sweep overhead: workers' time not spent in runs", 100 * two.overhead, 2, "%",
                note=f"steady state of {runs_note}, {two.folds} folds in it"),
        without_target("start-up of a sweep: from the command to the first run", median(starts), "s",
                       f"kernels compiled before; from the last run to the end {median(ends):.2f} s"),
    ]  # fmt: skip
