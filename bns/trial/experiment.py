"""Given commands driven on a robot, to measure it: the same drivers, safety and table of measurements as a trial."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pandas as pd

from bns.errors import HardwareError
from bns.hardware.safety import Stopping
from bns.measurements import write_measurements
from bns.robots import load_robot
from bns.robots.base import on_floor
from bns.robots.khepera import UNITS_PER_M_S
from bns.trial.crew import Crew
from bns.trial.folder import JOURNAL, MEASUREMENTS, measured
from bns.trial.session import Set, staged

COLUMNS = ("trial", "left_m_s", "right_m_s", "duration_s")
_FASTEST_M_S, _LONGEST_S = 0.3, 60.0


def read_commands(path: Path) -> list[np.ndarray]:
    """Controllers (n, 3) in the robot module's units, one a trial, of a CSV file with `COLUMNS`; HardwareError if it is none."""
    try:
        table = pd.read_csv(path)
    except (OSError, ValueError) as error:
        raise HardwareError(f"cannot read the commands {path}: {error}. It is a CSV file with {', '.join(COLUMNS)}.") from error
    missing = [name for name in COLUMNS if name not in table.columns]
    if missing:
        raise HardwareError(f"{path} lacks the column {', '.join(missing)}; it needs {', '.join(COLUMNS)}.")
    numbers = table[list(COLUMNS)].apply(pd.to_numeric, errors="coerce")
    good = np.isfinite(numbers).all(axis=1) & (numbers[["left_m_s", "right_m_s"]].abs() <= _FASTEST_M_S).all(axis=1)
    good &= (numbers["duration_s"] > 0) & (numbers["duration_s"] <= _LONGEST_S)
    if not len(table) or not good.all():
        line = int(np.argmin(good)) + 2 if len(table) else 2
        raise HardwareError(
            f"line {line} of {path} is no command: speeds are from -{_FASTEST_M_S:g} to {_FASTEST_M_S:g} m/s, durations above 0 "
            f"and up to {_LONGEST_S:g} s."
        )
    scale = np.array([UNITS_PER_M_S, UNITS_PER_M_S, 1000.0])
    return [group[list(COLUMNS[1:])].to_numpy() * scale for _, group in numbers.groupby("trial", sort=True)]


def drive_commands(path: Path, how: Set, results: Path, seed: int) -> str:
    """Drive every trial of a file from the start; measurements beside the journal; the report in words."""
    if how.rig.robot != "khepera":
        raise HardwareError(f"given commands are driven by a khepera, not by a {how.rig.robot}.")
    trials = read_commands(path)
    folder = results / "trials" / f"experiment-{path.stem}{'-emulated' if how.emulated else ''}"
    journal = folder / JOURNAL
    if journal.exists():
        raise HardwareError(f"there is an experiment in {folder} already; move it away or rename {path}.")
    robot = load_robot(how.rig.robot)
    start = on_floor(robot, robot.start_pose())[0]
    with Stopping() as stopping, staged(how, seed, journal, stopping) as stage:
        crew = Crew(stage.platform, stage.operator, how.rig, start, stage.clock, stage.journal)
        try:
            for number, commands in enumerate(trials, 1):
                crew.evaluate(number, commands)
        finally:
            stage.journal.sync()
            table = measured(journal)
            if len(table):
                write_measurements(table, folder / MEASUREMENTS)
    ended = f"; {len(crew.ends)} ended early" if crew.ends else ""
    return f"{len(trials)} trials driven{ended}; {len(table)} rows of measurements in {folder / MEASUREMENTS}"
