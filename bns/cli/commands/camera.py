"""What `bns calibrate` and `bns track` were asked for, made out of their options."""

from __future__ import annotations

import argparse
import math
import sys
import tempfile
from contextlib import ExitStack
from dataclasses import replace
from pathlib import Path

import numpy as np

from bns.api.trial import trial_setup
from bns.errors import HardwareError
from bns.extras import extra
from bns.hardware.clock import Clock, EmulatedClock, RealClock
from bns.hardware.emulators.faults import FaultPlan
from bns.hardware.looking import coloured, from_folder, views, watch
from bns.hardware.platform import platform_module
from bns.hardware.rig import Rig, load_rig, shipped_rig
from bns.hardware.tracking.calibration import Board, Calibration, calibrate, check_scale
from bns.hardware.tracking.camera import StreamCamera
from bns.hardware.tracking.infrared.wii_calibration import ON_THE_START, checked_tracker, hanging, look_at_lights
from bns.hardware.tracking.kinds import checked
from bns.hardware.tracking.picture import SETTINGS as PICTURE
from bns.hardware.tracking.wii import LEDS_M
from bns.hardware.tracking.wii import open_tracker as open_wii
from bns.trial.delay import in_words, measured_delay

with extra("robot"):
    import cv2

_PRINT_PX_PER_M = 300 / 0.0254
_SIZE_PX = (1280, 720)
_ON_START = "Lay the board flat on the floor, its middle on the start, its long side east to west; then Enter: "
_ELSEWHERE = "Lay it flat somewhere else, as far out as the camera sees all of it, turned as you like; then Enter: "


def calibrated(options: argparse.Namespace) -> str:
    """Carry out `bns calibrate`; a report in words."""
    if options.wii:
        return _hung(options)
    if options.colours is not None:
        return _coloured(options)
    if options.delay:
        how = trial_setup(_robot(options), options.rig, emulated=options.emulated, speed=math.inf if options.emulated else None)
        return in_words(measured_delay(how))
    if not 5.0 <= options.square_mm <= 1000.0:
        raise HardwareError(f"--square-mm is {options.square_mm:g}; measure the printed square, 5 to 1000 mm.")
    board = Board(square_m=options.square_mm / 1000, marker_m=0.75 * options.square_mm / 1000)
    if options.print_board is not None:
        return _printed(board, options.print_board)
    if options.measured_mm is not None:
        check_scale(board, options.measured_mm / 1000)
    if not options.output.absolute().parent.is_dir():
        raise HardwareError(
            f"there is no folder {options.output.parent} to write {options.output.name} into; make it first."
        )
    found = from_folder(options.frames, options.floor, board) if options.frames else _filmed(options, board)
    found.save(options.output)
    height_m = float(-(found.lens.rotation.T @ found.lens.shift_m)[2])
    few = "" if found.floor_views > 1 else "; further out than the board a single view may be a centimetre off (--places)"
    return (
        f"calibrated from {found.views} views, RMS {found.rms_px:.2f} pixels; the camera is {height_m:.2f} m above the floor\n"
        f"floor from {found.floor_views} view{'s' * (found.floor_views > 1)}: corners kept back are off by "
        f"{1000 * found.floor_rms_m:.1f} mm RMS, {1000 * found.floor_worst_m:.1f} mm at most{few}\n"
        f"written to {options.output}; name it in the rig's tracker as calibration"
    )


def _hung(options: argparse.Namespace) -> str:
    """How the Wii remote hangs, seen from a robot that stands on the task's start."""
    if options.rig is None:
        raise HardwareError("--wii needs --rig FILE: its tracker names the remote, its height and the LEDs.")
    rig = load_rig(options.rig, "khepera")
    clock, height_m = RealClock(), checked_tracker(rig.tracker)
    leds_m = np.asarray(rig.tracker.get("leds_m", LEDS_M), np.float64)
    tracker = open_wii(checked(rig.tracker), clock)
    try:
        input("Put the robot on the start, its nose to the north (up on the tasks' drawings); then Enter: ")
        found = hanging(look_at_lights(tracker, clock, len(leds_m)), ON_THE_START, height_m, leds_m)
    finally:
        tracker.close()
    return f"write these into the tracker of {options.rig}:\n{found.in_words()}"


def _printed(board: Board, path: Path) -> str:
    if path.suffix != ".png":
        raise HardwareError(f"the board is written as PNG; let {path} end in .png.")
    good, coded = cv2.imencode(".png", board.picture(_PRINT_PX_PER_M))
    assert good
    path.write_bytes(coded.tobytes())
    width, height = (1000 * side for side in board.size_m)
    return f"{path}: print it at 300 dpi without scaling, {width:.0f} x {height:.0f} mm; glue it on something flat"


def _filmed(options: argparse.Namespace, board: Board) -> Calibration:
    clock = RealClock()
    asked = {name: value for name in PICTURE if (value := getattr(options, name)) is not None}
    size, insist = (_size(options.size), True) if options.size else (_SIZE_PX, False)
    camera = StreamCamera(options.camera, clock, size, asked, insist)
    try:
        _say("the camera's pictures: " + ", ".join(f"{name} {value:g}" for name, value in camera.picture.items()))
        if options.measured_mm is None:
            check_scale(board, _measured_m(board))
        kept = views(camera, board, options.views, clock, _say)
        floors = []
        for number in range(options.places):
            input(_ON_START if number == 0 else _ELSEWHERE)
            frame = camera.newest()
            if frame is None:
                raise HardwareError("the camera is disconnected; plug it in again.")
            floors.append(frame.picture)
        return calibrate(kept, floors, board, options.camera, {name: camera.picture[name] for name in asked})
    finally:
        camera.close()


def _measured_m(board: Board) -> float:
    answer = input(f"Measure the printed board's long side, all {board.across} squares, in mm: ")
    try:
        return float(answer) / 1000
    except ValueError as error:
        raise HardwareError(f"{answer!r} is no length in millimetres; measure the board with a ruler.") from error


def _size(text: str) -> tuple[int, int]:
    width, x, height = text.partition("x")
    if not (x and width.isdecimal() and height.isdecimal() and int(width) and int(height)):
        raise HardwareError(f"--size is {text!r}; write width x height in pixels, as 1280x720.")
    return int(width), int(height)


def _coloured(options: argparse.Namespace) -> str:
    """What the colour tracker of a rig sees, drawn; hues that would fit."""
    if options.colours.suffix != ".png":
        raise HardwareError(f"the preview is written as PNG; let {options.colours} end in .png.")
    asked = {name: value for name in ("yellow", "green") if (value := getattr(options, name)) is not None}
    with ExitStack() as stack:
        rig, clock = _looked_at(options, stack)
        text, picture = coloured(replace(rig, tracker={**rig.tracker, **asked}), clock)
    options.colours.write_bytes(picture)
    return f"{text}\nwritten to {options.colours}; try others with --yellow LOW HIGH, --green LOW HIGH"


def _robot(options: argparse.Namespace) -> str:
    """The robot that is named, or that of the rig, or the Khepera."""
    if options.robot is not None:
        return str(options.robot)
    return "khepera" if options.rig is None else load_rig(options.rig).robot


def _looked_at(options: argparse.Namespace, stack: ExitStack) -> tuple[Rig, Clock]:
    """The rig, or its emulation, for as long as the stack is open."""
    if options.rig is None and not options.emulated:
        raise HardwareError("name your set-up with --rig FILE, or look at the emulated one with --emulated.")
    rig: Rig = shipped_rig(_robot(options)) if options.rig is None else load_rig(options.rig, options.robot)
    if not options.emulated:
        return rig, RealClock()
    clock = EmulatedClock()
    folder = Path(stack.enter_context(tempfile.TemporaryDirectory(prefix="bns-rig-")))
    emulation = platform_module(rig.robot).emulate(rig, folder, clock, FaultPlan(), 0)
    stack.callback(emulation.close)
    return emulation.rig, clock


def tracked(options: argparse.Namespace) -> str:
    """Carry out `bns track`; a report in words."""
    with ExitStack() as stack:
        rig, clock = _looked_at(options, stack)
        looks, seen = watch(rig, clock, options.seconds, options.frames, print)
    return f"seen in {seen} of {looks} looks" + (f"; frames in {options.frames}" if options.frames else "")


def _say(text: str) -> None:
    print(text, file=sys.stderr)
