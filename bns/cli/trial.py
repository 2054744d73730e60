"""What `bns trial` was asked for, made out of its options."""

from __future__ import annotations

import argparse
import math
from collections.abc import Mapping
from typing import Any

from bns.errors import HardwareError, SpecError
from bns.hardware.emulators.faults import FaultPlan, load_plan
from bns.hardware.rig import load_rig, shipped_rig
from bns.robots import load_robot
from bns.spec import RunSpec, robot_and_options
from bns.tasks import default_task
from bns.trial.experiment import drive_commands
from bns.trial.replay import replayed
from bns.trial.session import TrialSetup, carry_out


def carried_out(options: argparse.Namespace, parameters: Mapping[str, Any]) -> str:
    """Carry out what the options say; a report in words."""
    if options.replay is not None:
        return replayed(options.replay, options.results)
    spec, how = spec_of(parameters), how_of(options)
    if options.commands is not None:
        return drive_commands(options.commands, how, options.results, spec.seed)
    return carry_out(spec, how, options.results)


def spec_of(parameters: Mapping[str, Any]) -> RunSpec:
    """The spec; the task is the first of the robot's study where none is given."""
    robot = load_robot(parameters["robot"]).name
    if parameters["record"] == "full":
        raise SpecError(
            "record is 'full'; a robot drives no probes and no fittest of a generation: take evals or paths."
        )
    return RunSpec(**{**parameters, "world": "robot", "task": parameters["task"] or default_task(robot)})


def how_of(options: argparse.Namespace) -> TrialSetup:
    """Rig, clock and operator; HardwareError for what does not go together."""
    if options.rig is None and not options.emulated:
        raise HardwareError(
            "a real robot needs --rig FILE, which names its port, tracker and surface (docs/trials.md shows one); "
            "without a robot at hand, say --emulated."
        )
    if math.isnan(options.speed) or options.speed <= 0.0:
        raise HardwareError(f"--speed is {options.speed:g}; it must be above 0.")
    for name in ("faults", "speed"):
        if not options.emulated and getattr(options, name) not in {None, 1.0}:
            raise HardwareError(f"--{name} is for --emulated; a real robot has its own.")
    robot, _ = robot_and_options(options.robot)
    rig = shipped_rig(robot) if options.rig is None else load_rig(options.rig, robot)
    plan = FaultPlan() if options.faults is None else load_plan(options.faults)
    return TrialSetup(
        rig,
        options.emulated,
        options.speed,
        plan,
        options.yes,
        options.resume,
        options.most_rounds,
        options.until_success,
        not options.no_figures,
        options.repeats,
    )
