"""What `bns calibrate` and `bns track` were asked for, made out of their options."""

from __future__ import annotations

import argparse
import sys
import tempfile
from contextlib import ExitStack
from pathlib import Path

from bns.errors import HardwareError
from bns.extras import extra
from bns.hardware.clock import Clock, EmulatedClock, RealClock
from bns.hardware.emulators.faults import FaultPlan
from bns.hardware.looking import from_folder, views, watch
from bns.hardware.platform import platform_module
from bns.hardware.rig import Rig, load_rig, shipped_rig
from bns.hardware.tracking.calibration import Board, calibrate
from bns.hardware.tracking.camera import StreamCamera

with extra("robot"):
    import cv2

_PRINT_PX_PER_M = 300 / 0.0254


def calibrated(options: argparse.Namespace) -> str:
    """Carry out `bns calibrate`; a report in words."""
    if not 5.0 <= options.square_mm <= 1000.0:
        raise HardwareError(f"--square-mm is {options.square_mm:g}; measure the printed square, 5 to 1000 mm.")
    board = Board(square_m=options.square_mm / 1000, marker_m=0.75 * options.square_mm / 1000)
    if options.print_board is not None:
        return _printed(board, options.print_board)
    if not options.output.absolute().parent.is_dir():
        raise HardwareError(
            f"there is no folder {options.output.parent} to write {options.output.name} into; make it first."
        )
    found = from_folder(options.frames, options.floor, board) if options.frames else _filmed(options, board)
    found.save(options.output)
    height_m = float(-(found.lens.rotation.T @ found.lens.shift_m)[2])
    return (
        f"calibrated from {found.views} views, RMS {found.rms_px:.2f} pixels; the camera is {height_m:.2f} m above the floor\n"
        f"written to {options.output}; name it in the rig's tracker as calibration"
    )


def _printed(board: Board, path: Path) -> str:
    if path.suffix != ".png":
        raise HardwareError(f"the board is written as PNG; let {path} end in .png.")
    good, coded = cv2.imencode(".png", board.picture(_PRINT_PX_PER_M))
    assert good
    path.write_bytes(coded.tobytes())
    width, height = (1000 * side for side in board.size_m)
    return f"{path}: print it at 300 dpi without scaling, {width:.0f} x {height:.0f} mm; glue it on something flat"


def _filmed(options: argparse.Namespace, board: Board):  # type: ignore[no-untyped-def]  # a Calibration
    clock = RealClock()
    camera = StreamCamera(options.camera, clock)
    try:
        kept = views(camera, board, options.views, clock, _say)
        input("Lay the board flat on the floor, its middle on the start, its long side east to west; then Enter: ")
        frame = camera.newest()
        if frame is None:
            raise HardwareError("the camera is gone; plug it in anew.")
        return calibrate(kept, frame.picture, board, options.camera)
    finally:
        camera.close()


def tracked(options: argparse.Namespace) -> str:
    """Carry out `bns track`; a report in words."""
    if options.rig is None and not options.emulated:
        raise HardwareError("name your set-up with --rig FILE, or look at the emulated one with --emulated.")
    rig: Rig = shipped_rig(options.robot) if options.rig is None else load_rig(options.rig, options.robot)
    clock: Clock = RealClock()
    with ExitStack() as stack:
        if options.emulated:
            clock = EmulatedClock()
            folder = Path(stack.enter_context(tempfile.TemporaryDirectory(prefix="bns-rig-")))
            emulation = platform_module(rig.robot).emulate(rig, folder, clock, FaultPlan(), 0)
            stack.callback(emulation.close)
            rig = emulation.rig
        looks, seen = watch(rig, clock, options.seconds, options.frames, print)
    return f"seen in {seen} of {looks} looks" + (f"; frames in {options.frames}" if options.frames else "")


def _say(text: str) -> None:
    print(text, file=sys.stderr)
