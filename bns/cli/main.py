"""The command line: one short function a command, which parses, calls and prints."""

from __future__ import annotations

import argparse
import errno
import os
import sys
import warnings
from collections.abc import Callable, Sequence
from pathlib import Path

from bns import __version__
from bns.cli.commands import calibrate as calibrating
from bns.cli.commands import diagnose as measuring
from bns.cli.commands import examples as listing
from bns.cli.commands import explore as exploring
from bns.cli.commands import import_log as importing
from bns.cli.commands import report as reporting
from bns.cli.commands import results as looking
from bns.cli.commands import simulators as simulating
from bns.cli.commands import sweep as sweeping
from bns.cli.compiling import say_if_compiling
from bns.cli.options.option_types import add_spec_options, duration, positive
from bns.cli.options.sweep_options import DEVICES, say_if_experimental
from bns.cli.options.trial_options import add_looking_options, add_servo_options, add_trial_options
from bns.cli.parser import SHELLS, Adder, Completion, Parser, add_results, add_trust, take_trust
from bns.cli.streams import usable_streams
from bns.errors import BnsError, TrialFileError
from bns.spec import FIELDS, RunSpec

SWEEP_OF_SINGLE_RUNS = "by-hand"
_FULL = {errno.ENOSPC, errno.EDQUOT, errno.EFBIG}
_NO_PLACE = {errno.ENOENT, errno.ENOTDIR, errno.EISDIR, errno.EEXIST, errno.EACCES, errno.EPERM, errno.EROFS}


def main(arguments: Sequence[str] | None = None) -> int:
    """Entry point of ``bns``. Exit codes: 0 done, 1 some runs failed, 2 bad input, 130 interrupted, 143 terminated."""
    usable_streams()
    warnings.showwarning = _shown_once()
    try:
        options = _parser().parse_args(arguments)
        options.command_line = list(sys.argv[1:] if arguments is None else arguments)
        take_trust(options)
        return _flushed(int(options.command(options)))
    except BnsError as error:
        _say(f"bns: {error}")
        return error.exit_code
    except KeyboardInterrupt:
        print("bns: interrupted", file=sys.stderr)
        return sweeping.INTERRUPTED
    except BrokenPipeError:  # the reader of our output, `head` say, has what it wants
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        return 0
    except MemoryError:
        print("bns: out of memory; use a smaller population or fewer jobs", file=sys.stderr)
        return BnsError.exit_code
    except OSError as error:
        if error.errno in _FULL:
            _say(f"bns: cannot write {error.filename or 'the output'}: {error.strerror}")
        elif error.errno in _NO_PLACE and error.filename is not None:
            print(
                f"bns: cannot use {error.filename}: {error.strerror}. Choose another place.",
                file=sys.stderr,
            )
        else:
            raise
        return BnsError.exit_code


def _flushed(code: int) -> int:
    sys.stdout.flush()  # a full disk or a closed pipe shows here, not when the process ends
    return code


def _say(text: str) -> None:
    """Last words, on stderr. Where outputs cannot be written (a full disk), the exit code alone tells, and is kept."""
    for name, words in (("stdout", ""), ("stderr", text)):
        try:
            print(words, end="\n" * bool(words), file=getattr(sys, name), flush=True)
        except OSError:
            setattr(sys, name, None)  # else Python tries once more when it ends, and fails with a code of its own


def _shown_once() -> Callable[..., None]:
    """Prints warnings, each text once a command: several steps of one may meet the same file."""
    said: set[str] = set()

    def show(message: Warning | str, *_place: object, **_more: object) -> None:
        if str(message) not in said:
            said.add(str(message))
            print(f"bns: warning: {message}", file=sys.stderr)

    return show


ABOUT = (
    "Compare a robot log with a model: name the physical effect that the model lacks, add it, and see the error fall. Evolve "
    "controllers with Bootstrapped Neuro-Simulation, sweep its parameters, and try them on a robot."
)
BEGIN = "Begin with: bns example my-first. Options of a command: bns COMMAND --help."


def _parser() -> Parser:
    parser = Parser(prog="bns", description=ABOUT, epilog=BEGIN)
    parser.add_argument("--version", action="version", version=f"bns {__version__}")
    parser.add_argument(
        "--print-completion",
        choices=SHELLS,
        action=Completion,
        help="print a script that completes commands and options in this shell",
    )
    commands = parser.add_subparsers(title="commands", metavar="COMMAND")
    parser.set_defaults(command=_help_of(parser))

    def command(name: str, function: Callable[[argparse.Namespace], int], text: str) -> Parser:
        added = commands.add_parser(name, help=text, description=text[0].upper() + text[1:] + ".")
        added.set_defaults(command=function)
        return added

    listing.add_commands(command)
    importing.add_commands(command)
    measuring.add_commands(command)
    reporting.add_commands(command)
    exploring.add_commands(command)
    _add_single_runs(command)
    sweeping.add_commands(command)
    looking.add_commands(command)
    simulating.add_commands(command)
    calibrating.add_commands(command)
    return parser


def _help_of(parser: Parser) -> Callable[[argparse.Namespace], int]:
    def show(_options: argparse.Namespace) -> int:
        parser.print_help()
        return 0

    return show


def _add_single_runs(command: Adder) -> None:
    one = command("run", run, "carry out one run and draw its path")
    add_spec_options(one)
    one.add_argument(
        "--measurements",
        type=Path,
        metavar="FILE",
        help="also write commands and poses of all drives as a table (.csv, .parquet)",
    )
    add_trust(one)
    one.add_argument("--save-snn", type=Path, metavar="FILE", help="also write the run's networks as safetensors")
    one.add_argument("--device", choices=DEVICES, default="cpu", help="cpu (default), or cuda for a GPU (experimental)")
    one.add_argument(
        "--render",
        type=Path,
        metavar="FILE",
        help="film or picture of the fittest controller, if the world can draw it (.mp4, .png)",
    )
    add_results(one)
    add_spec_options(
        taken := command("trial", trial, "carry out a run on a robot or on its emulator"), without=("world",)
    )
    add_trial_options(taken, positive)
    add_looking_options(
        command("calibrate", calibrate, "calibrate a camera, a Wii remote or colours, or measure the delay of a tracker"),
        command("track", track, "show what the tracker of a rig sees"),
        positive,
        duration,
    )
    ill = command("doctor", doctor, "check ports, robot, camera and calibration, and say what to fix")
    ill.add_argument("--robot", metavar="NAME", help="which robot the rig must be for (default: the one that it names)")
    ill.add_argument(
        "--rig", type=Path, metavar="FILE", help="your set-up (YAML); its robot and tracker are checked, too"
    )
    add_servo_options(command("servos", servos, "set up Dynamixel servos: which answer, their ids, their settings"))


def run(options: argparse.Namespace) -> int:
    """One run by hand: live view, rows in the store, figure of the path."""
    from bns.cli.commands.run import run_by_hand
    from bns.robots import load_robot
    from bns.tasks import default_task

    if options.task is None:
        options.task = default_task(load_robot(options.robot).name)
    spec = RunSpec(**{name: getattr(options, name) for name in FIELDS})
    say_if_compiling(spec)
    kept = options.save_snn, options.render, options.measurements
    print(run_by_hand(spec, options.results, SWEEP_OF_SINGLE_RUNS, *kept, device=options.device))
    say_if_experimental(options.device)
    return 0


def trial(options: argparse.Namespace) -> int:
    """A run whose world is a robot; codes 0 done, 2 bad input, 3 paused, 4 it may still be moving, 5 a file cannot be written."""
    from bns.extras import require

    if options.replay is None:
        require("robot", "serial", "dynamixel_sdk", "cv2")
    from bns.cli.commands.trial import carried_out

    say_if_compiling()
    report = carried_out(options, {name: getattr(options, name) for name in FIELDS if name != "world"})
    try:
        print(report, flush=True)
    except BrokenPipeError:
        raise
    except OSError as error:
        raise TrialFileError.of("the output", error) from error
    return 0


def calibrate(options: argparse.Namespace) -> int:
    """Print the board, or find the lens and the floor of a camera."""
    from bns.cli.commands.camera import calibrated

    print(calibrated(options))
    return 0


def track(options: argparse.Namespace) -> int:
    """Poses, one a line, and annotated frames."""
    from bns.cli.commands.camera import tracked

    print(tracked(options))
    return 0


def doctor(options: argparse.Namespace) -> int:
    """What is fine and what is not; 2 if something has to be fixed."""
    from bns.cli.commands.doctor import checked_up

    return checked_up(options)


def servos(options: argparse.Namespace) -> int:
    """Set up servos."""
    from bns.cli.commands.servos import served

    return served(options)


if __name__ == "__main__":
    sys.exit(main())
