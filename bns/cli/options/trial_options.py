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
    parser.add_argument("--yes", **switch, help="run unattended: answer yes to every prompt")  # type: ignore[arg-type]
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
    source.add_argument(
        "--wii", action="store_true", help="find how the Wii remote of --rig hangs: mirror, orientation, place, view"
    )
    source.add_argument(
        "--delay", action="store_true", help="have the robot of --rig move to and fro, and find how late its tracker is"
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
    calibrating.add_argument("--robot", default="khepera", help="for --delay and --colours (default: khepera)")
    calibrating.add_argument("--emulated", action="store_true", help="with --delay or --colours: the emulated rig")
    calibrating.add_argument(
        "--floor",
        type=Path,
        nargs="+",
        default=[],
        metavar="FILE",
        help="pictures of the board flat on the floor: on the start first, then elsewhere (default: the last of --frames)",
    )
    calibrating.add_argument(
        "--places", type=positive, default=3, metavar="N", help="places on the floor to lay the board on (default: 3)"
    )
    calibrating.add_argument("--measured-mm", type=float, metavar="MM", help="width of the whole printed board, as measured")
    calibrating.add_argument("--size", metavar="WxH", help="of the camera's pictures (default: 1280x720, or what it has)")
    for name in ("exposure", "focus", "white-balance"):
        calibrating.add_argument(
            f"--{name}", type=float, metavar="N", help="fix it, as the camera's driver counts (v4l2-ctl -L)"
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


def add_servo_options(parser: argparse.ArgumentParser) -> None:
    """Of `bns servos`: `scan`, `set-id` and `check`, each at a port."""
    parts = parser.add_subparsers(title="what to do", metavar="scan|set-id|check", required=True)

    def part(name: str, text: str) -> argparse.ArgumentParser:
        added = parts.add_parser(name, help=text, description=text[0].upper() + text[1:] + ".")
        added.add_argument("--port", required=True, metavar="DEVICE", help="the bus adapter, as /dev/ttyUSB0")
        added.add_argument(
            "--protocol", type=int, choices=(1, 2), help="1: AX-12, 2: XL430 and XM430 (default: both, which takes longer)"
        )
        added.set_defaults(part=name)
        return added

    part("scan", "list the servos that answer").add_argument(
        "--all-bauds", action="store_true", help="at all rates that a servo can be set to (minutes)"
    )
    new = part("set-id", "give the one servo that is connected a number")
    new.add_argument("id", type=int, metavar="ID", help="its new number, 0 to 252")
    new.add_argument("--from", type=int, dest="old", metavar="ID", help="its present number, where several are connected")
    part("check", "say what of the servos' settings is not as a drive needs it").add_argument(
        "--fix", "--mend", dest="mend", action="store_true", help="write the settings that a drive needs first"
    )
