"""Given commands driven on a robot, to measure it: the same drivers, safety and table of measurements as a trial."""

from __future__ import annotations

from pathlib import Path
from typing import NamedTuple

import numpy as np
import pandas as pd

from bns.console import live_view
from bns.errors import HardwareError, SpecError
from bns.hardware.rig import surface_text
from bns.hardware.safety import Stopping
from bns.robots import load_robot
from bns.robots.base import Robot, on_floor
from bns.trial.driver import TrialDriver, leaps_text
from bns.trial.folder import (
    JOURNAL,
    MEASUREMENTS,
    PICTURE,
    check_not_cut,
    check_not_lost,
    forget_unless,
    locked,
    measured,
    measurements_however_it_ends,
    past_evaluations,
    stuck_before,
)
from bns.trial.report import count_of
from bns.trial.session import TrialSetup, open_rig

_START = ("start_x_m", "start_y_m", "start_heading_rad")


def read_commands(path: Path, robot: Robot) -> list[tuple[np.ndarray, np.ndarray]]:
    """Controllers (n, components) in the robot's units, one a trial, each with the pose (3,) that it starts from, of a CSV file
    with `trial`, the robot's `given_columns` and perhaps the start; HardwareError if it is none."""
    limits = robot.given_columns
    columns = ("trial", *limits)
    try:
        table = pd.read_csv(path)
    except OSError as error:
        raise HardwareError(
            f"cannot read the commands {path}: {error.strerror or error}. Give a CSV file with {', '.join(columns)}."
        ) from error
    except ValueError as error:  # the reader's own words may be of several lines, and about its insides
        raise HardwareError(
            f"{path} is no table of comma-separated values. Commands of a {robot.name} are a CSV file with {', '.join(columns)}."
        ) from error
    missing = [name for name in columns if name not in table.columns]
    other = next((mark for mark in (";", "\t") if mark in str(table.columns[0])), None)
    if missing and other is not None:
        raise HardwareError(
            f"{path} is separated by {'semicolons' if other == ';' else 'tabs'}; separate the columns by commas, with points in "
            f"decimal numbers: {', '.join(columns)}."
        )
    if missing:
        raise HardwareError(
            f"{path} lacks the column {', '.join(missing)}; commands of a {robot.name} need {', '.join(columns)}."
        )
    numbers = table[list(columns)].apply(pd.to_numeric, errors="coerce")
    named = ~np.isfinite(numbers["trial"])
    if named.any():
        line = int(np.argmax(named))
        raise HardwareError(
            f"line {line + 2} of {path} has {table['trial'].iloc[line]!r} in the column trial; number the trials: they are "
            "driven in the order of their numbers."
        )
    good = np.isfinite(numbers).all(axis=1)
    for name, (low, high) in limits.items():
        good &= numbers[name].between(low, high)
    if not len(table) or not good.all():
        line = int(np.argmin(good)) + 2 if len(table) else 2
        allowed = ", ".join(f"{name} {low:.4g} to {high:.4g}" for name, (low, high) in limits.items())
        raise HardwareError(f"line {line} of {path} is no command of a {robot.name}; allowed is {allowed}.")
    starts = _starts(path, table, robot)
    try:
        return [
            (robot.parse_commands(group[list(limits)].to_numpy()), starts[int(group.index[0])])
            for _, group in numbers.groupby("trial", sort=True)
        ]
    except SpecError as error:
        raise HardwareError(f"{path}: {error}.") from error


def _starts(path: Path, table: pd.DataFrame, robot: Robot) -> np.ndarray:
    """A start (3,) a row: what the file says, or the robot's own."""
    if not set(_START) <= set(table.columns):
        return np.tile(on_floor(robot, robot.start_pose())[0], (len(table), 1))
    starts: np.ndarray = table[list(_START)].apply(pd.to_numeric, errors="coerce").to_numpy(np.float64)
    if not np.isfinite(starts).all():
        line = int(np.argmin(np.isfinite(starts).all(axis=1))) + 2
        raise HardwareError(
            f"line {line} of {path} has no number for each of {', '.join(_START)}; write them, or leave all out."
        )
    return starts


class Experiment(NamedTuple):
    """Commands that were driven: the folder of journal and measurements, and a report in words."""

    folder: Path
    text: str


def drive_commands(path: Path, how: TrialSetup, results: Path, seed: int) -> Experiment:
    """Drive every trial of a file, or those not yet driven; measurements are written into the journal's folder."""
    trials = read_commands(path, load_robot(how.rig.robot))
    for _, (x_m, y_m, _heading) in trials:
        if not how.rig.limits.surface.holds(x_m, y_m):
            raise HardwareError(
                f"{path} starts a trial at ({x_m:.2f}, {y_m:.2f}) m, off the surface {surface_text(how.rig.limits.surface)}; "
                "change the start, or surface_m in the rig."
            )
    folder = results / "trials" / f"experiment-{path.stem}{'-emulated' if how.emulated else ''}"
    with locked(folder):
        return Experiment(folder, _driven(trials, how, folder / JOURNAL, seed))


def _driven(trials: list[tuple[np.ndarray, np.ndarray]], how: TrialSetup, journal: Path, seed: int) -> str:
    columns = load_robot(how.rig.robot).measured_columns
    done = _driven_before(journal, [commands for commands, _ in trials], how.resume)
    try:
        stuck = stuck_before(journal)
        with (
            measurements_however_it_ends(journal, columns),
            Stopping() as stopping,
            open_rig(how, seed, journal, stopping) as opened,
        ):
            picture = journal.with_name(PICTURE)
            driver = TrialDriver(
                opened.platform, opened.operator, how.rig, trials[0][1], opened.clock, opened.log, picture, stuck=stuck
            )
            with live_view(None, now=driver.underway.text) as show:
                driver.suspended = show.suspended
                for number, (commands, start) in enumerate(trials[done:], done + 1):
                    driver.start = start
                    if driver.evaluate(number, commands).skipped:
                        driver.skipped(number, commands, 0)
    except HardwareError:
        forget_unless(journal, "driven")
        raise
    ended = f"; {len(driver.ends)} ended early" if driver.ends else ""
    rows = len(measured(journal))
    faults = f"\n{opened.plan.outcome()}" if opened.plan.faults else ""
    many, kept = count_of(len(trials), "trial"), journal.with_name(MEASUREMENTS)
    leaps = f"\n{leaps_text(driver.leaps, driver.marked is not None)}" if driver.leaps else ""
    return f"{many} driven{ended}; {rows} rows of measurements in {kept}{leaps}{faults}"


def _driven_before(journal: Path, trials: list[np.ndarray], resume: bool) -> int:
    """How many of the trials are in the journal already; HardwareError if they should not be, or are others."""
    check_not_lost(journal)
    if not journal.exists():
        if resume:
            raise HardwareError(
                f"there is nothing to resume: no journal in {journal.parent}. Begin without --resume."
            )
        return 0
    if not resume:
        raise HardwareError(
            f"there is an experiment in {journal.parent} already; resume it with --resume, move it away or rename the file."
        )
    check_not_cut(journal)
    past = past_evaluations(journal)
    same = len(past) <= len(trials) and all(
        one.picked.shape == asked.shape and np.allclose(one.picked, asked, rtol=1e-5)
        for one, asked in zip(past, trials, strict=False)
    )
    if not same:
        raise HardwareError(
            f"{journal} drove other commands than the file holds now; rename the file to start a new experiment with it."
        )
    return len(past)
