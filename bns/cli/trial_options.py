"""Options of the commands that have to do with hardware."""

from __future__ import annotations

import argparse
from collections.abc import Callable
from pathlib import Path
from typing import Any

Convert = Callable[[str], Any]


def add_trial_options(parser: argparse.ArgumentParser, positive: Convert) -> None:
    """Of `bns trial`, beside those of the spec."""
    parser.set_defaults(task=None, record="paths")
    switch = {"action": "store_true"}
    parser.add_argument("--rig", type=Path, metavar="FILE", help="ports, tracker and surface of your set-up (YAML)")
    parser.add_argument("--emulated", **switch, help="drive the emulator of the robot: the same drivers, no hardware")  # type: ignore[arg-type]
    parser.add_argument("--speed", type=float, default=1.0, metavar="X", help="of the emulator's clock (default: 1)")
    parser.add_argument("--faults", type=Path, metavar="FILE", help="what the emulator shall do wrong (YAML)")
    parser.add_argument("--yes", **switch, help="nobody is there to be asked")  # type: ignore[arg-type]
    parser.add_argument("--resume", **switch, help="go on from the last evaluation driven")  # type: ignore[arg-type]
    parser.add_argument(
        "--replay", type=Path, metavar="JOURNAL", help="run a trial again from its journal, without a robot"
    )
    parser.add_argument("--commands", type=Path, metavar="FILE", help="drive given commands (CSV) instead of evolving")
    parser.add_argument(
        "--most-rounds",
        type=positive,
        default=50,
        metavar="N",
        help="of training and evolution while one controller drives",
    )
    parser.add_argument(
        "--until-success",
        type=positive,
        metavar="N",
        help="end when N driven controllers in a row have reached all goals",
    )
    parser.add_argument(
        "--repeats",
        type=positive,
        metavar="N",
        help="drive the final controller N times, its evaluation included (default: snake 3, khepera 1)",
    )
    parser.add_argument("--no-figures", **switch, help="draw none of the trial's figures when it is done")  # type: ignore[arg-type]
    parser.add_argument("--results", type=Path, default=Path("results"), metavar="DIR", help="folder of all results")


def add_looking_options(
    calibrating: argparse.ArgumentParser, tracking: argparse.ArgumentParser, positive: Convert, duration: Convert
) -> None:
    """Of `bns calibrate` and `bns track`."""
    source = calibrating.add_mutually_exclusive_group(required=True)
    source.add_argument("--camera", metavar="SOURCE", help="number, device file or address of the camera")
    source.add_argument("--frames", type=Path, metavar="DIR", help="pictures of the board taken before")
    source.add_argument(
        "--print-board", type=Path, metavar="FILE", help="write the board to be printed (PNG), true to size"
    )
    calibrating.add_argument(
        "--floor", type=Path, metavar="FILE", help="picture of the board on the floor (default: the last)"
    )
    calibrating.add_argument("--square-mm", type=float, default=68.0, help="side of a printed square (default: 68, A3)")
    calibrating.add_argument("--views", type=positive, default=15, help="views to take (default: 15)")
    calibrating.add_argument("-o", "--output", type=Path, default=Path("camera.json"), metavar="FILE")
    tracking.add_argument("--robot", default="khepera")
    tracking.add_argument("--rig", type=Path, metavar="FILE", help="your set-up (YAML)")
    tracking.add_argument("--emulated", action="store_true", help="look at the emulated rig")
    tracking.add_argument(
        "--seconds", type=duration, default=5.0, metavar="TIME", help="how long to look (default: 5s)"
    )
    tracking.add_argument("--frames", type=Path, metavar="DIR", help="write annotated frames into this folder")
