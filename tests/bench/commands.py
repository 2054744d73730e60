"""Commands as a user waits for them: how long each takes to start, and what diagnosis, comparison and import take on large logs.

Each is a process of its own, with both cores and an empty cache. Peers: a bare Python that loads numpy; pandas that reads and
writes the same table.
"""

from __future__ import annotations

import os
import subprocess
import sys
import tempfile
from collections.abc import Callable, Sequence
from pathlib import Path
from statistics import median

import numpy as np
import pandas as pd

from bns.api.model import Model
from tests.bench.clock import ONE_THREAD, alternating
from tests.bench.line import Line, at_most, without_target

ROUNDS = 5
SHORT, LONG = (60, 8), (184, 17)
"""Trials, and commands of 1.2 s in each."""
ROWS, ROWS_OF_TRIAL = 1_000_000, 4_000


def measure(quick: bool) -> list[Line]:
    """Wall seconds; ratios over the peers."""
    with tempfile.TemporaryDirectory() as folder:
        place = Path(folder)
        return [*_starts(1 if quick else ROUNDS), *_diagnoses(place, quick), *_import(place, ROWS // 10 if quick else ROWS)]


def _process(*words: str, folder: Path | None = None) -> Callable[[], object]:
    """One call of Python with these arguments; CalledProcessError where it fails."""
    environment = {name: value for name, value in os.environ.items() if name not in ONE_THREAD} | {"BNS_CACHE": "off"}
    command = [sys.executable, *words]
    return lambda: subprocess.run(command, cwd=folder, env=environment, capture_output=True, check=True)


def command_names() -> list[str]:
    """Of all commands, as `bns --help` lists them."""
    helped = subprocess.run([sys.executable, "-m", "bns", "--help"], capture_output=True, text=True, check=True).stdout
    lines = helped.partition("  COMMAND\n")[2].splitlines()
    return [line.split()[0] for line in lines if line.startswith("    ") and not line.startswith("     ")]


def _starts(rounds: int) -> list[Line]:
    helped = alternating({name: _process("-m", "bns", name, "--help") for name in command_names()}, rounds)
    slowest = max(helped, key=lambda name: helped[name])
    ready = {"bare": _process("-c", "import numpy"), "effects": _process("-m", "bns", "effects", "--json")}
    taken = alternating(ready | {"version": _process("-m", "bns", "--version")}, rounds)
    note = "floor: Python that loads numpy"
    return [
        without_target("bns --version", taken["version"], "s"),
        without_target(f"bns COMMAND --help, median of {len(helped)} commands", median(helped.values()), "s"),
        without_target("... of the slowest command", helped[slowest], "s", slowest),
        at_most("bns effects --json", taken["effects"], 0.7, "s", taken["bare"], note),
    ]


def _diagnoses(folder: Path, quick: bool) -> list[Line]:
    """Of a robot whose motors lag and whose wheels differ: what is asked most."""
    from tests.diagnose.worlds import NOMINAL, hidden, measured  # loads the kernels

    robot = hidden(motor_lag={"tau_s": 0.12}, wheel_mismatch={"ratio": 0.97})
    model, poses = Model(NOMINAL).save(folder / "model.yaml"), {}
    for name, (trials, commands) in {"short": SHORT, "long": SHORT if quick else LONG}.items():
        table = measured(robot, trials=trials, commands=commands, seed=3)
        table.to_csv(folder / f"{name}.csv", index=False)
        poses[name] = len(table)
    asked: dict[str, Sequence[str]] = {name: ("-m", "bns", "diagnose", f"{name}.csv", "--model", str(model)) for name in poses}
    asked["compare"] = ("-m", "bns", "compare", "long.csv", "--model", str(model))
    taken = alternating({name: _process(*words, folder=folder) for name, words in asked.items()}, 1 if quick else 3)
    growth = taken["long"] / taken["short"] / (poses["long"] / poses["short"])
    return [
        at_most(f"bns diagnose, {SHORT[0]} trials of 10 s at 25 Hz", taken["short"], 4, "s"),
        at_most(f"bns diagnose, {LONG[0]} trials of 20 s at 25 Hz", taken["long"], 25, "s"),
        at_most("... its time for each pose over that of the shorter log", growth, 1.0, "x"),
        at_most(f"bns compare, {LONG[0]} trials of 20 s", taken["compare"], 3, "s"),
    ]


def _import(folder: Path, rows: int) -> list[Line]:
    """A log in millimetres and milliseconds becomes a table in metres and seconds."""
    rng = np.random.default_rng(0)
    trial, step = np.arange(rows) // ROWS_OF_TRIAL, np.arange(rows) % ROWS_OF_TRIAL
    log = pd.DataFrame({"drive": trial, "time_ms": 40 * step, "left_mm_s": 100.0, "right_mm_s": 100.0})
    log["x_mm"] = np.round(4.0 * step + rng.normal(0, 1, rows), 1)
    log["y_mm"], log["heading_deg"] = np.round(rng.normal(0, 1, (2, rows)), 1)
    log.to_csv(folder / "log.csv", index=False)
    (folder / "log.csv.import.yaml").write_text(
        "columns:\n  trial: {from: drive}\n  t_s: {from: time_ms, unit: ms}\n  left_m_s: {from: left_mm_s, unit: mm/s}\n"
        "  right_m_s: {from: right_mm_s, unit: mm/s}\n  x_m: {from: x_mm, unit: mm}\n  y_m: {from: y_mm, unit: mm}\n"
        "  heading_rad: {from: heading_deg, unit: deg}\n"
    )
    bare = "import pandas; pandas.read_csv('log.csv').to_parquet('bare.parquet')"
    subjects = {
        "ours": _process("-m", "bns", "import", "log.csv", "-o", "table.parquet", folder=folder),
        "bare": _process("-c", bare, folder=folder),
    }
    taken = alternating(subjects, 3)
    return [at_most("bns import, a million rows", taken["ours"], 10, "s", taken["bare"], "floor: read and written by pandas")]
