"""The commands that make something of a diagnosis: propose the next experiment, report to people."""

from __future__ import annotations

import argparse
import json
import sys
from pathlib import Path
from typing import Any

from bns.cli.commands.diagnose import diagnosed
from bns.cli.options.measuring_options import (
    MINUTES,
    add_effect_options,
    add_log,
    add_model_options,
    refuse_sources,
    words_of,
)
from bns.cli.options.option_types import number
from bns.cli.parser import Adder
from bns.cli.progress_bar import ticking


def add_commands(command: Adder) -> None:
    """The parsers of these commands; ``command`` makes one of a name, a function and a text."""
    next_one = command("propose", propose, "plan the next experiment: commands that tell rival explanations apart")
    next_one.add_argument(
        "-o",
        "--output",
        type=Path,
        metavar="FILE.csv",
        help="file to write, for bns trial --commands (default: none)",
    )
    next_one.add_argument("--json", action="store_true", help="print one JSON object")
    page = command("report", report, "write one HTML page: what is missing, how certain that is, what to do next")
    page.add_argument(
        "-o",
        "--output",
        type=Path,
        metavar="FILE.html",
        default=Path("report.html"),
        help="file to write (default: report.html)",
    )
    for one in (next_one, page):
        add_log(one)
        add_experiment_options(one)
        add_model_options(one)
        add_effect_options(one)


def add_experiment_options(parser: argparse.ArgumentParser) -> None:
    """How long, where and how fast."""
    parser.add_argument(
        "--minutes",
        type=number,
        default=MINUTES,
        metavar="N",
        help="minutes of driving to plan, the last trial driven to its end (default: 10)",
    )
    parser.add_argument(
        "--arena",
        metavar="WxH",
        help="size of the arena in metres, or its sides X0,X1,Y0,Y1 (default: where the robot was seen)",
    )
    parser.add_argument(
        "--start",
        metavar="X,Y,DEG",
        help="start of each trial: metres, metres, degrees counter-clockwise from east (--start=0,0,90)",
    )
    parser.add_argument(
        "--speeds",
        metavar="LOW,HIGH",
        help="lowest and highest wheel speed in m/s (default: the robot's bounds and the speeds in the log)",
    )


def propose(options: argparse.Namespace) -> int:
    """Trials that tell the rivals apart, as a file that `bns trial` drives."""
    from bns.api.propose import checked_minutes, checked_output

    checked_minutes(options.minutes)
    out, limits = options.output, _limits(options)
    if out is not None:
        checked_output(out, "The commands", ".csv")
        refuse_sources(options)
    found = diagnosed(options)
    with ticking("planning") as tick:
        proposal = found.propose(**limits, progress=tick)
    written = "" if out is None or proposal.commands.empty else str(proposal.to_csv(out))
    print(json.dumps(proposal.to_json()) if options.json else proposal.summary(written, words_of(options)))
    if out is not None and not written:
        print(f"{out} is not written: no commands would decide anything", file=sys.stderr)
    return 0


def report(options: argparse.Namespace) -> int:
    """The page."""
    from bns.api.propose import checked_minutes, checked_output

    checked_minutes(options.minutes)
    checked_output(options.output, "The report", ".html")
    limits = _limits(options)
    found = diagnosed(options)
    with ticking("reporting") as tick:
        print(found.report(options.output, **limits, command=words_of(options), progress=tick).summary())
    return 0


def _limits(options: argparse.Namespace) -> dict[str, Any]:
    """How long, where and how fast, as values."""
    from bns.cli.values import arena_of, pose_of, speeds_of

    return {
        "minutes": options.minutes,
        "arena": arena_of(options.arena),
        "start": pose_of(options.start),
        "speeds": speeds_of(options.speeds),
    }
