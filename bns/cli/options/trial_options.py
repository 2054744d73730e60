"""Options of the commands that have to do with hardware."""

from __future__ import annotations

import argparse
from collections.abc import Callable
from pathlib import Path
from typing import Any

from bns.cli.options.option_types import number

Convert = Callable[[str], Any]


def add_trial_options(parser: argparse.ArgumentParser, positive: Convert) -> None:
    """Of `bns trial`, beside those of the spec."""
    parser.set_defaults(task=None, record="paths")
    switch = {"action": "store_true"}
    parser.add_argument("--rig", type=Path, metavar="FILE", help="ports, tracker and surface of your set-up (YAML)")
    parser.add_argument("--emulated", **switch, help="drive the emulator of the robot: the same drivers, no hardware")  # type: ignore[arg-type]
    parser.add_argument(
        "--speed",
        type=number,
        default=1.0,
        metavar="X",
        help="speed of the emulated clock, in multiples of real time (default: 1)",
    )
    parser.add_argument("--faults", type=Path, metavar="FILE", help="planned faults of the emulator (YAML)")
    parser.add_argument("--yes", **switch, help="run unattended: answer yes to every prompt")  # type: ignore[arg-type]
    parser.add_argument("--resume", **switch, help="continue after the last evaluation that was driven")  # type: ignore[arg-type]
    parser.add_argument(
        "--replay", type=Path, metavar="JOURNAL", help="run a trial again from its journal, without a robot"
    )
    parser.add_argument("--commands", type=Path, metavar="FILE", help="drive given commands (CSV) instead of evolving")
    parser.add_argument(
        "--most-rounds",
        type=positive,
        default=50,
        metavar="N",
        help="largest number of rounds of training and evolution during one drive (default: 50)",
    )
    parser.add_argument(
        "--until-success",
        type=positive,
        metavar="N",
        help="stop when N controllers in succession have reached all goals",
    )
    parser.add_argument(
        "--repeats",
        type=positive,
        metavar="N",
        help="drive the final controller N times in all, including its evaluation (default: snake 3, khepera 1)",
    )
    parser.add_argument("--no-figures", **switch, help="do not draw the trial's figures at the end")  # type: ignore[arg-type]
    parser.add_argument(
        "--results",
        type=Path,
        default=Path("results"),
        metavar="DIR",
        help="folder of all results (default: results)",
    )


def add_looking_options(
    calibrating: argparse.ArgumentParser, tracking: argparse.ArgumentParser, positive: Convert, duration: Convert
) -> None:
    """Of `bns calibrate` and `bns track`."""
    source = calibrating.add_mutually_exclusive_group(required=True)
    source.add_argument("--camera", metavar="SOURCE", help="number, device file or address of the camera")
    source.add_argument("--frames", type=Path, metavar="DIR", help="folder with pictures of the board that were taken earlier")
    source.add_argument(
        "--print-board", type=Path, metavar="FILE", help="write the board as a PNG file, to be printed without scaling"
    )
    source.add_argument(
        "--wii", action="store_true", help="calibrate the Wii remote of --rig: mirror image, orientation, position, field of view"
    )
    source.add_argument(
        "--delay", action="store_true", help="move the robot of --rig to and fro, and measure the delay of its tracker"
    )
    source.add_argument(
        "--colours",
        type=Path,
        metavar="FILE.png",
        help="write a picture of what the colour tracker of --rig sees, and find hues that fit its markers",
    )
    for name in ("yellow", "green"):
        calibrating.add_argument(
            f"--{name}", type=int, nargs=2, metavar=("LOW", "HIGH"), help="hues to try with --colours, 0 to 179"
        )
    calibrating.add_argument("--rig", type=Path, metavar="FILE", help="your set-up (YAML), for --wii, --delay and --colours")
    calibrating.add_argument(
        "--robot", metavar="NAME", help="robot, for --delay and --colours (default: that of --rig, or khepera)"
    )
    calibrating.add_argument("--emulated", action="store_true", help="use the emulated rig, with --delay or --colours")
    calibrating.add_argument(
        "--floor",
        type=Path,
        nargs="+",
        default=[],
        metavar="FILE",
        help="pictures of the board flat on the floor: first on the start, then elsewhere (default: the last of --frames)",
    )
    calibrating.add_argument(
        "--places", type=positive, default=3, metavar="N", help="number of places on the floor for the board (default: 3)"
    )
    calibrating.add_argument("--measured-mm", type=number, metavar="MM", help="measured width of the whole printed board, in mm")
    calibrating.add_argument("--size", metavar="WxH", help="size of the camera's pictures (default: 1280x720 if available)")
    for name in ("exposure", "focus", "white-balance"):
        calibrating.add_argument(
            f"--{name}",
            type=number,
            metavar="N",
            help="fixed value, in units of the camera's driver (v4l2-ctl -L lists the range)",
        )
    calibrating.add_argument(
        "--square-mm", type=number, default=68.0, metavar="MM", help="side of a printed square in mm (default: 68, for A3)"
    )
    calibrating.add_argument("--views", type=positive, default=15, metavar="N", help="number of views to take (default: 15)")
    calibrating.add_argument(
        "-o", "--output", type=Path, default=Path("camera.json"), metavar="FILE", help="file to write (default: camera.json)"
    )
    tracking.add_argument("--robot", metavar="NAME", help="robot (default: that of --rig, or khepera)")
    tracking.add_argument("--rig", type=Path, metavar="FILE", help="your set-up (YAML)")
    tracking.add_argument("--emulated", action="store_true", help="use the emulated rig")
    tracking.add_argument(
        "--seconds", type=duration, default=5.0, metavar="TIME", help="how long to look (default: 5s)"
    )
    tracking.add_argument("--frames", type=Path, metavar="DIR", help="write annotated frames into this folder")


def add_servo_options(parser: argparse.ArgumentParser) -> None:
    """Of `bns servos`: `scan`, `set-id` and `check`, each at a port."""
    parts = parser.add_subparsers(title="actions", metavar="scan|set-id|check", required=True)

    def part(name: str, text: str) -> argparse.ArgumentParser:
        added = parts.add_parser(name, help=text, description=text[0].upper() + text[1:] + ".")
        added.add_argument("--port", required=True, metavar="DEVICE", help="port of the bus adapter, for example /dev/ttyUSB0")
        added.add_argument(
            "--protocol", type=int, choices=(1, 2), help="1: AX-12, 2: XL430 and XM430 (default: both, which takes longer)"
        )
        added.set_defaults(part=name)
        return added

    part("scan", "list the servos that answer").add_argument(
        "--all-bauds", action="store_true", help="try all rates that a servo can be set to (takes minutes)"
    )
    new = part("set-id", "set the id of the one servo that is connected")
    new.add_argument("id", type=int, metavar="ID", help="new id, 0 to 252")
    new.add_argument("--from", type=int, dest="old", metavar="ID", help="present id, if several servos are connected")
    part("check", "list settings of the servos that do not suit a drive").add_argument(
        "--fix", "--mend", dest="mend", action="store_true", help="first write the settings that a drive needs"
    )
