"""A trial from its first check to its last figure."""

from __future__ import annotations

import tempfile
import time
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass, field
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

from bns.console import live_view
from bns.errors import BnsError, HardwareError
from bns.hardware.clock import Clock, EmulatedClock, RealClock
from bns.hardware.emulators.faults import FaultPlan
from bns.hardware.hardware_log import HardwareLog
from bns.hardware.platform import Emulation, Platform, platform_module
from bns.hardware.rig import Rig
from bns.hardware.safety import Stopping, StopsAtTheEnd
from bns.plotting.scripts import draw, scripts
from bns.plotting.style import path_figure
from bns.robots import load_robot
from bns.robots.base import on_floor
from bns.spec import RunSpec
from bns.sweep.single_run import keep_run
from bns.tasks import load_task
from bns.trial.driver import TrialDriver
from bns.trial.folder import TrialFolder, forget_unless, spec_event
from bns.trial.loop import Trial, TrialResult
from bns.trial.operator import EmulatedHands, Operator, TerminalOperator, UnattendedOperator
from bns.trial.report import report

SWEEP, SWEEP_EMULATED = "trials", "trials-emulated"
MOST_ROUNDS = 50


@dataclass(frozen=True)
class TrialSetup:
    """How a trial is carried out: on which rig, emulated at which speed with which faults, with somebody to ask or not."""

    rig: Rig
    emulated: bool = False
    speed: float = 1.0
    plan: FaultPlan = field(default_factory=FaultPlan)
    yes: bool = False
    resume: bool = False
    most_rounds: int = MOST_ROUNDS
    until_success: int | None = None
    figures: bool = True


@dataclass(frozen=True)
class OpenedRig:
    """Everything that a trial or an experiment drives with, opened and checked."""

    platform: Platform
    operator: Operator
    clock: Clock
    log: HardwareLog


@contextmanager
def open_rig(how: TrialSetup, seed: int, journal: Path | None, stopping: Stopping) -> Iterator[OpenedRig]:
    """Open clock, emulation, journal and platform; at the end, however it comes, the robot is stopped, seen to stand, let go."""
    clock: Clock = EmulatedClock(how.speed) if how.emulated else RealClock()
    with ExitStack() as stack:
        log = stack.enter_context(HardwareLog(journal, clock))
        module, rig, hands = platform_module(how.rig.robot), how.rig, None
        if how.emulated:
            folder = Path(stack.enter_context(tempfile.TemporaryDirectory(prefix="bns-rig-")))
            emulation: Emulation = module.emulate(rig, folder, clock, how.plan, seed)
            stack.callback(emulation.close)
            rig, hands = emulation.rig, EmulatedHands(emulation, seed)
        platform: Platform = module.open_platform(rig, clock, log, stopping)
        stack.callback(platform.close)
        stack.enter_context(StopsAtTheEnd(platform.stop))
        yield OpenedRig(
            platform, hands or (UnattendedOperator() if how.yes else TerminalOperator(stopping.ask)), clock, log
        )


def carry_out(spec: RunSpec, how: TrialSetup, results: Path) -> str:
    """Carry out a trial, store it, draw its path; the report in words. TrialPausedError, StopNotConfirmedError, HardwareError."""
    robot, task = load_robot(spec.robot), load_task(spec.robot, spec.task)
    how.rig.check_task(task.goals_m)
    folder = TrialFolder(results, spec, how.emulated)
    past = folder.open(how.resume)
    try:
        return _driven(spec, how, results, folder, past, robot, task)
    finally:
        folder.close()


def _driven(
    spec: RunSpec, how: TrialSetup, results: Path, folder: TrialFolder, past: list, robot: Any, task: Any
) -> str:
    trial = Trial(spec, "robot-emulated" if how.emulated else "robot", past, how.most_rounds, how.until_success)
    start = on_floor(robot, robot.start_pose())[0]
    started, wall = datetime.now(UTC), time.perf_counter()
    try:
        with Stopping() as stopping, open_rig(how, spec.seed, folder.journal, stopping) as opened:
            opened.log.note("trial", spec=spec_event(spec), emulated=how.emulated, resumed_after=len(past))
            opened.log.sync()
            driver = TrialDriver(opened.platform, opened.operator, how.rig, start, opened.clock, opened.log)
            with live_view(spec, driver.told) as show:
                result = trial.run(driver, show)
            opened.log.note("complete", evaluations=len(result.run.tables["evals"]["evaluation"]))
    except HardwareError:
        if not past:  # nothing has moved: the next attempt is no resumption
            forget_unless(folder.journal, "trial")
        raise
    except BaseException:
        folder.write_measurements()
        raise
    folder.write_measurements()
    return _kept(spec, how, results, folder, result, robot, task, started, time.perf_counter() - wall, driver)


def _figures(spec: RunSpec, results: Path, folder: TrialFolder) -> str:
    """Figures and table rows of this trial alone, on a page in its folder; what came of it, in words."""
    page = folder.path / "figures"
    try:
        complaint = draw(scripts(), results, "--run", spec.run_id, "--out", str(page.absolute()), polite=False)
    except BnsError as error:  # the package was installed without them: the trial is none the worse for it
        complaint = str(error)
    return f"figures: {page / 'index.html'}" if not complaint else f"no figures: {complaint}"


def _kept(
    spec: RunSpec, how: TrialSetup, results: Path, folder: TrialFolder, result: TrialResult, robot: Any, task: Any,
    started: datetime, wall_s: float, driver: TrialDriver,
) -> str:  # fmt: skip
    keep_run(spec, result.run, results, SWEEP_EMULATED if how.emulated else SWEEP, started, wall_s)
    figure = path_figure(spec, task, robot, result.run, folder.path / "path")
    told = report(spec, result, driver, wall_s, how, folder.path, figure)
    return f"{told}\n{_figures(spec, results, folder)}" if how.figures else told
