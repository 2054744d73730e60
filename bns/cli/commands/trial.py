"""What `bns trial` was asked for, made out of its options."""

from __future__ import annotations

import argparse
from collections.abc import Mapping
from typing import Any

from bns.api.trial import driven, trial_setup, trial_spec
from bns.errors import TrialFileError, TrialPausedError
from bns.trial.again.replay import replayed
from bns.trial.experiment import drive_commands
from bns.trial.session import TrialSetup


def carried_out(options: argparse.Namespace, parameters: Mapping[str, Any]) -> str:
    """Carry out what the options say; a report as text."""
    if options.replay is not None:
        return replayed(options.replay, options.results).text
    spec, setup = trial_spec(**parameters), setup_of(options)
    try:
        if options.commands is not None:
            return drive_commands(options.commands, setup, options.results, spec.seed).text
        return driven(spec, setup, options.results).summary()
    except TrialPausedError as why:
        if "--resume" in str(why):
            raise
        raise TrialPausedError(f"{why} (paused, the robot stands: the same command with --resume goes on)") from why
    except OSError as error:
        if error.filename is not None:  # the command line tells of files and folders by their names
            raise
        raise TrialFileError.of("the output", error) from error


def setup_of(options: argparse.Namespace) -> TrialSetup:
    """Rig, clock and operator as the options have them."""
    return trial_setup(
        options.robot,
        options.rig,
        emulated=options.emulated,
        speed=None if options.speed == 1.0 else options.speed,
        faults=options.faults,
        unattended=options.yes,
        resume=options.resume,
        most_rounds=options.most_rounds,
        until_success=options.until_success,
        figures=not options.no_figures,
        repeats=options.repeats,
    )
