"""A trial from its first check to its last figure."""

from __future__ import annotations

import os
import sys
import tempfile
import time
from collections import Counter
from collections.abc import Iterator, Mapping
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass, field, replace
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

from bns.bootstrap.loop import Progress, run
from bns.console import live_view
from bns.errors import BnsError, HardwareError, TrialPausedError
from bns.hardware.clock import Clock, EmulatedClock, RealClock
from bns.hardware.emulators.faults import FaultPlan
from bns.hardware.guard.client import Guard, GuardedClock, GuardedPlatform
from bns.hardware.link.hardware_log import HardwareLog
from bns.hardware.platform import Emulation, Platform, PlatformModule, platform_module, repeats_of
from bns.hardware.rig import Rig
from bns.hardware.safety import Stopping, StopsAtTheEnd
from bns.plotting.scripts import draw, scripts
from bns.plotting.style import path_figure
from bns.robots import load_robot
from bns.robots.base import on_floor
from bns.spec import RunSpec
from bns.sweep.single_run import keep_run
from bns.tasks import load_task
from bns.trial.again.repeats import drive_repeats, final_evaluation, repeats_table, write_repeats
from bns.trial.background import BackgroundDriver
from bns.trial.driver import TrialDriver, leaps_text
from bns.trial.evaluation import Evaluation
from bns.trial.folder import (
    PICTURE,
    REPEATS,
    TrialFolder,
    forget_unless,
    locked,
    measurements_however_it_ends,
    robot_stands,
    spec_event,
    stuck_before,
)
from bns.trial.operator import EmulatedHands, Operator, TerminalOperator, UnattendedOperator
from bns.trial.report import TrialResult, report
from bns.worlds.robot import RobotWorld

GUARD_LOG = "guard.jsonl"
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
    repeats: int | None = None
    """How often the final controller is driven, its evaluation included; None: as often as the robot's platform says."""


@dataclass(frozen=True)
class OpenedRig:
    """Everything that a trial or an experiment drives with, opened and checked."""

    platform: Platform
    operator: Operator
    clock: Clock
    log: HardwareLog
    plan: FaultPlan
    """Of an emulated robot: which planned faults have happened."""


@dataclass(frozen=True)
class KeptTrial:
    """A trial that is in the store: the run and how it went, its folder, the report as text."""

    result: TrialResult
    folder: Path
    text: str


@contextmanager
def open_rig(how: TrialSetup, seed: int, journal: Path | None, stopping: Stopping) -> Iterator[OpenedRig]:
    """Open clock, emulation, journal and platform; at the end, however it comes, the robot is stopped, seen to stand, let go."""
    with ExitStack() as stack:
        rig, hands, guard = how.rig, None, None
        plan = replace(how.plan, happened=Counter())
        module = platform_module(rig.robot)
        clock: Clock = EmulatedClock(how.speed)
        if not how.emulated:
            guard = _guard(rig, module, journal, stack)
            if guard is not None:
                stack.enter_context(_named(guard.path, rig.port))
            clock = RealClock() if guard is None else GuardedClock(guard)
        log = stack.enter_context(HardwareLog(journal, clock))
        stopping.causes.append(log.check)
        if isinstance(clock, EmulatedClock):
            folder = Path(stack.enter_context(tempfile.TemporaryDirectory(prefix="bns-rig-")))
            emulation: Emulation = module.emulate(rig, folder, clock, plan, seed)
            stack.callback(emulation.close)
            rig, hands = emulation.rig, EmulatedHands(emulation, seed)
        elif guard is not None:
            rig = replace(rig, port=guard.path)
        opened: Platform = module.open_platform(rig, clock, log, stopping)
        platform = opened if guard is None else GuardedPlatform(opened, guard, stopping)
        stack.callback(platform.close)
        stack.enter_context(StopsAtTheEnd(platform.stop, lambda: stopping.reason))
        try:
            yield OpenedRig(platform, hands or _somebody(how, stopping), clock, log, plan)
        except TrialPausedError as why:
            if not plan.faults:
                raise
            raise TrialPausedError(f"{why}; {plan.outcome()}") from why


def _somebody(how: TrialSetup, stopping: Stopping) -> Operator:
    return UnattendedOperator(stopping.check) if how.yes else TerminalOperator(stopping.ask, stopping.check)


def _guard(rig: Rig, module: PlatformModule, journal: Path | None, stack: ExitStack) -> Guard | None:
    """The guard of a real robot's port, where the robot's module says how it is stopped."""
    recipe_of = getattr(module, "stop_recipe", None)
    if recipe_of is None or os.name != "posix":  # Windows has no pseudo-terminals
        return None
    log = None if journal is None else journal.with_name(GUARD_LOG)
    guard = Guard(rig.port, recipe_of(rig), rig.limits.silent_s, log, rig.limits.gives_up_s)
    stack.callback(_let_go, guard)
    return guard


@contextmanager
def _named(path: str, port: str) -> Iterator[None]:
    """Errors that name the guard's way to the robot name the port that was given."""
    try:
        yield
    except BnsError as error:
        error.args = tuple(a.replace(path, port) if isinstance(a, str) else a for a in error.args)
        raise


def _let_go(guard: Guard) -> None:
    """Say goodbye; say so where it has to go on."""
    if not guard.close():
        left = " ".join(map(str, guard.left))
        end = f"once its power is cut, end the guard with kill -9 {left} (docs/trials.md, After exit 4)"
        print(f"the guard of the port (process {guard.left[0]}) keeps trying to stop the robot; {end}", file=sys.stderr)


def carry_out(spec: RunSpec, how: TrialSetup, results: Path, on_evaluation: Progress = lambda _row: None) -> KeptTrial:
    """Carry out a trial, store it, draw its path. TrialPausedError, StopNotConfirmedError, TrialFileError,
    HardwareError.

    ``on_evaluation`` is called with each evaluation's row, those of a trial that is gone on with included.
    """
    how.rig.check_task(load_task(spec.robot, spec.task).goals_m)
    folder = TrialFolder(results, spec, how.emulated)
    with locked(folder.path):
        result = _driven(spec, how, folder, folder.past(how.resume), on_evaluation)
        with robot_stands(results):
            return _kept(spec, how, results, folder, result)


def _driven(
    spec: RunSpec, how: TrialSetup, folder: TrialFolder, past: list[Evaluation], on_evaluation: Progress
) -> TrialResult:
    """The loop with the robot as its driver; measurements are written however it ends."""
    started, robot = (datetime.now(UTC), time.perf_counter()), load_robot(spec.robot)
    start = on_floor(robot, robot.start_pose())[0]
    try:
        stuck = stuck_before(folder.journal)
        with (
            measurements_however_it_ends(folder.journal, robot.measured_columns),
            Stopping() as stopping,
            open_rig(how, spec.seed, folder.journal, stopping) as opened,
        ):
            opened.log.note("trial", spec=spec_event(spec), emulated=how.emulated, resumed_after=len(past))
            opened.log.sync()
            goals_m, picture = load_task(spec.robot, spec.task).goals_m, folder.path / PICTURE
            driver = TrialDriver(
                opened.platform, opened.operator, how.rig, start, opened.clock, opened.log, picture, goals_m, stuck
            )
            result = _looped(spec, how, driver, past, started, on_evaluation)
            _repeated(spec, how, driver, folder, result)
            opened.log.note("complete", evaluations=len(result.run.tables["evals"]["evaluation"]))
            result = replace(result, faults=opened.plan.outcome(), leaps=leaps_text(driver.leaps, driver.marked is not None))
    except HardwareError:
        if not past:  # nothing has moved: the next attempt is no resumption
            forget_unless(folder.journal, "trial")
        raise
    return result


def _looped(
    spec: RunSpec,
    how: TrialSetup,
    driver: TrialDriver,
    past: list[Evaluation],
    started: tuple[datetime, float],
    on_evaluation: Progress,
) -> TrialResult:
    """``started``: the time of day, which may be set meanwhile, and the seconds of a clock that is not."""
    robot = load_robot(spec.robot)
    world = RobotWorld("robot-emulated" if how.emulated else "robot")
    with (
        live_view(spec, driver.live_text, driver.underway.text) as show,
        BackgroundDriver(robot, driver, past, how.most_rounds, how.until_success) as background,
    ):

        driver.suspended = getattr(show, "suspended", driver.suspended)

        def tell(row: Mapping[str, Any]) -> None:
            show(row)
            on_evaluation(row)

        result = run(spec, tell, world, background)
    if "evals" not in result.tables:
        raise TrialPausedError(f"all {spec.evaluations} evaluations were skipped: there is no result")
    wall_s = time.perf_counter() - started[1]
    shares = background.waited_share, background.worked_share
    return TrialResult(result, driver.stops_s, driver.ends, *shares, background.rounds, started[0], wall_s)


def _repeated(spec: RunSpec, how: TrialSetup, driver: TrialDriver, folder: TrialFolder, result: TrialResult) -> None:
    """Drive the final controller as often as is asked for; all its paths go into the trial's folder."""
    count = repeats_of(platform_module(how.rig.robot)) if how.repeats is None else how.repeats
    if count == 1:
        return
    evaluation = final_evaluation(result.run.tables["evals"])
    drives = drive_repeats(driver, folder.journal, evaluation, count)
    robot, task = load_robot(spec.robot), load_task(spec.robot, spec.task)
    table = repeats_table(drives, evaluation, robot, task)
    with robot_stands(folder.path / REPEATS):
        write_repeats(table, folder.path / REPEATS)
    result.repeats.extend(bool(rows["success"].iloc[0]) for _, rows in table.groupby("repeat"))


def _kept(spec: RunSpec, how: TrialSetup, results: Path, folder: TrialFolder, result: TrialResult) -> KeptTrial:
    keep_run(spec, result.run, results, SWEEP_EMULATED if how.emulated else SWEEP, result.started, result.wall_s)
    robot, task = load_robot(spec.robot), load_task(spec.robot, spec.task)
    figure = path_figure(spec, task, robot, result.run, folder.path / "path")
    lines = report(spec, result, f"emulated, at {how.speed:g} times its speed" if how.emulated else "robot")
    lines += [f"measurements and journal: {folder.path}", f"path: {figure}"]
    lines += [_figures(spec, results, folder)] if how.figures else []
    return KeptTrial(result, folder.path, "\n".join(lines))


def _figures(spec: RunSpec, results: Path, folder: TrialFolder) -> str:
    """Figures and table rows of this trial alone, on a page in its folder; what came of it, as text."""
    page = folder.path / "figures"
    try:
        complaint = draw(scripts(), results, "--run", spec.run_id, "--out", str(page.absolute()), polite=False)
    except BnsError as error:  # the package was installed without them: the trial is none the worse for it
        complaint = str(error)
    return f"figures: {page / 'index.html'}" if not complaint else f"no figures: {complaint}"
