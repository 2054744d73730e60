"""`bns.trial`: a run whose world is a robot, or its emulator; given commands driven; a trial run again from its journal."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from os import PathLike
from pathlib import Path
from typing import TYPE_CHECKING, Any, Unpack, overload

from bns.api.common.progress import Progress
from bns.api.common.shown import Shown
from bns.api.measurements import Measurements
from bns.api.run import Parameters, Row, RunResult, asked_spec, telling
from bns.errors import HardwareError, SpecError
from bns.hardware.emulators.faults import FaultPlan, load_plan
from bns.hardware.rig import load_rig, shipped_rig
from bns.robots import load_robot
from bns.spec import RunSpec, robot_and_options
from bns.tasks import default_task
from bns.trial.again.replay import replayed
from bns.trial.experiment import drive_commands
from bns.trial.folder import MEASUREMENTS
from bns.trial.report import TrialResult as Driven
from bns.trial.session import MOST_ROUNDS, TrialSetup, carry_out

if TYPE_CHECKING:
    from matplotlib.axes import Axes

_Path = str | PathLike[str]


class _Driven(Shown):
    """What was driven on a robot, or its emulator, and kept in a folder."""

    folder: Path

    @cached_property
    def measurements(self) -> Measurements:
        """What was commanded and where the robot was, of every drive."""
        return Measurements(self.folder / MEASUREMENTS)


@dataclass(frozen=True, repr=False)
class TrialResult(_Driven):
    """A stored trial. ``folder`` holds its journal and measurements, ``driven`` the summary of its drives and stops."""

    run: RunResult
    folder: Path
    driven: Driven
    text: str

    def summary(self) -> str:
        """When the goals were first reached, drives and stops of the robot, and where the files are."""
        return self.text

    def plot(self, ax: Axes | None = None) -> Axes:
        """The path of the fittest controller, as `bns.RunResult` draws it, cm."""
        return self.run.plot(ax)

    def _line(self) -> str:
        evals, spec = self.run.evals, self.run.spec
        return f"{spec.robot}, {spec.task}, seed {spec.seed}, {len(evals)} evaluations driven, in {self.folder}"


@dataclass(frozen=True, repr=False)
class ExperimentResult(_Driven):
    """Given commands that were driven. ``folder`` holds their journal and measurements."""

    folder: Path
    text: str

    def summary(self) -> str:
        """How many trials were driven, and where the measurements are."""
        return self.text

    def _line(self) -> str:
        return f"{self.text.partition(';')[0]}, in {self.folder}"


class Settings(Parameters, total=False):
    """How a trial is carried out, for type checkers; `trial` says what each is."""

    rig: _Path | None
    emulated: bool
    results: _Path
    seed: int
    speed: float | None
    faults: _Path | FaultPlan | None
    unattended: bool
    resume: bool
    most_rounds: int
    until_success: int | None
    repeats: int | None
    figures: bool
    progress: Progress | None
    on_evaluation: Callable[[Row], None] | None


@overload
def trial(
    robot: str = ..., task: str | None = ..., *, commands: None = ..., replay: None = ..., **settings: Unpack[Settings]
) -> TrialResult: ...


@overload
def trial(
    robot: str = ..., task: str | None = ..., *, commands: _Path, replay: None = ..., **settings: Unpack[Settings]
) -> ExperimentResult: ...


@overload
def trial(*, replay: _Path, results: _Path = ...) -> RunResult: ...


def trial(
    robot: str = "khepera",
    task: str | None = None,
    *,
    commands: _Path | None = None,
    replay: _Path | None = None,
    rig: _Path | None = None,
    emulated: bool = False,
    results: _Path = "results",
    seed: int = 0,
    speed: float | None = None,
    faults: _Path | FaultPlan | None = None,
    unattended: bool = False,
    resume: bool = False,
    most_rounds: int = MOST_ROUNDS,
    until_success: int | None = None,
    repeats: int | None = None,
    figures: bool = False,
    progress: Progress | None = None,
    on_evaluation: Callable[[Row], None] | None = None,
    **parameters: Unpack[Parameters],
) -> TrialResult | ExperimentResult | RunResult:
    """Carry out a run on a robot: training and evolution go on while it drives.

    Args:
        robot: khepera or snake.
        task: a goal task of that robot; by default the first of its study.
        commands: a file of commands (CSV, as `bns.propose` writes it) to be driven instead of evolving; an ExperimentResult.
        replay: the journal of a trial, to run that again without a robot; a RunResult with the same rows.
        rig: the file of your set-up (docs/trials.md): port, tracker, surface.
        emulated: drive the emulator of the robot, by the same drivers; needs no rig.
        results: folder of all results; the trial has a folder of its own in its ``trials``.
        seed: of this run.
        speed: of the emulator's clock: as fast as it goes, or 1 for the pace of a robot (as `bns trial` has it).
        faults: what the emulator shall do wrong: a plan or its file.
        unattended: answer yes to every prompt.
        resume: go on from the last evaluation driven.
        most_rounds: of training and evolution while one controller drives.
        until_success: end when so many driven controllers in a row have reached all goals.
        repeats: how often the final controller is driven (default: as the robot's study has it); kept in repeats.csv.
        figures: also draw the trial's page of figures.
        progress: called with the fraction done and the evaluation.
        on_evaluation: called with each evaluation's row.
        **parameters: all else, as for `bns.run`.

    Raises:
        HardwareError: a port, robot, camera or plan that cannot be used; nothing has moved.
        TrialPausedError: stopped with the robot confirmed still; ``resume=True`` goes on.
        TrialFileError: a file could not be written; the robot stands, ``resume=True`` goes on.
        StopNotConfirmedError: the robot may still be moving.
        SpecError: a parameter that there is none of, or whose value is not allowed.
    """
    if replay is not None:
        return _replayed(replay, results, commands, rig, emulated)
    setup = trial_setup(
        robot,
        rig,
        emulated=emulated,
        speed=(math.inf if emulated else None) if speed is None else speed,
        faults=faults,
        unattended=unattended,
        resume=resume,
        most_rounds=most_rounds,
        until_success=until_success,
        figures=figures,
        repeats=repeats,
    )
    spec = trial_spec(robot, task, seed=seed, **parameters)
    if commands is not None:
        return ExperimentResult(*drive_commands(Path(commands), setup, Path(results), spec.seed))
    return driven(spec, setup, results, progress=progress, on_evaluation=on_evaluation)


def _replayed(
    journal: _Path, results: _Path, commands: _Path | None, rig: _Path | None, emulated: bool
) -> RunResult:
    """A trial again from its journal, which knows its robot and spec: nothing else is driven."""
    if commands is not None or rig is not None or emulated:
        raise HardwareError("replay runs a trial from its journal, without a robot; give no commands, rig or emulated.")
    kept = replayed(Path(journal), Path(results))
    return RunResult(kept.spec, kept.result, kept.wall_s, {})


def trial_spec(robot: str, task: str | None = None, *, record: str = "paths", **parameters: Any) -> RunSpec:
    """The spec of a trial; the task is the first of the robot's study where none is given. SpecError as for a run."""
    if record == "full":
        raise SpecError(
            "record is 'full', but a robot drives no probes and no fittest of a generation; use evals or paths."
        )
    named = task or default_task(load_robot(robot).name)
    return asked_spec({**parameters, "robot": robot, "task": named, "world": "robot", "record": record})


def trial_setup(
    robot: str,
    rig: _Path | None = None,
    *,
    emulated: bool = False,
    speed: float | None = None,
    faults: _Path | FaultPlan | None = None,
    unattended: bool = False,
    resume: bool = False,
    most_rounds: int = MOST_ROUNDS,
    until_success: int | None = None,
    figures: bool = True,
    repeats: int | None = None,
) -> TrialSetup:
    """Rig, clock and operator; HardwareError for what does not go together."""
    if rig is None and not emulated:
        raise HardwareError(
            "a real robot needs --rig FILE, which names its port, tracker and surface (docs/trials.md shows one); "
            "without a robot, use --emulated (in Python rig=FILE, emulated=True)."
        )
    if speed is not None and not speed > 0.0:
        raise HardwareError(f"--speed is {speed:g}; it must be above 0.")
    for name, given in (("faults", faults), ("speed", speed)):
        if not emulated and given is not None:
            raise HardwareError(f"--{name} is for --emulated; a real robot has its own.")
    of, _ = robot_and_options(robot)
    plan = faults if isinstance(faults, FaultPlan) else FaultPlan() if faults is None else load_plan(Path(faults))
    return TrialSetup(
        shipped_rig(of) if rig is None else load_rig(Path(rig), of),
        emulated,
        1.0 if speed is None else speed,
        plan,
        unattended,
        resume,
        most_rounds,
        until_success,
        figures,
        repeats,
    )


def driven(
    spec: RunSpec,
    setup: TrialSetup,
    results: _Path,
    *,
    progress: Progress | None = None,
    on_evaluation: Callable[[Row], None] | None = None,
) -> TrialResult:
    """Carry out the trial of a spec on a set-up, and keep it."""
    kept = carry_out(spec, setup, Path(results), telling(spec, progress, on_evaluation))
    run = RunResult(spec, kept.result.run, kept.result.wall_s, {})
    return TrialResult(run, kept.folder, kept.result, kept.text)
