"""Drawing a whole study (500 combinations, 30 seeds, three tasks, 100 evaluations, made up), each figure in its own process."""

from __future__ import annotations

import resource
import subprocess
import sys
import tempfile
from pathlib import Path

from analysis.__main__ import figures
from tests.bench.clock import seconds
from tests.bench.line import Line, at_most

ROOT = Path(__file__).parents[2]


def measure(quick: bool) -> list[Line]:
    """Seconds from nothing to files, of all figures and of the slowest single one; peak memory."""
    from tests.analysis.study import TASKS, make_study  # needs the tests' folder on the path

    seeds = 3 if quick else 30
    with tempfile.TemporaryDirectory() as folder:
        make_study(Path(folder), seeds=seeds)
        draw(folder)  # once before, so that the files are in memory for all alike
        whole = seconds(lambda: draw(folder))
        single = {name: seconds(lambda name=name: draw(folder, "--only", name)) for name in figures()}
    slowest = max(single, key=lambda name: single[name])
    peak_gb = resource.getrusage(resource.RUSAGE_CHILDREN).ru_maxrss / 2**20
    study = f"a study of {500 * seeds * len(TASKS) * 100 / 1e6:g} million evaluations"
    return [
        at_most(f"all figures of {study}", whole, 60, "s", note=f"{len(single)} scripts, two files a figure"),
        at_most("the slowest figure of it alone", single[slowest], 5, "s", note=slowest),
        at_most("memory that the figures take", peak_gb, 2, "GiB"),
    ]


def draw(results: str, *options: str) -> None:
    """One call of the command, as a user makes it."""
    command = [sys.executable, "-m", "analysis", "--results", results, *options]
    subprocess.run(command, cwd=ROOT, check=True, stdout=subprocess.DEVNULL)
