"""A Wii remote above an emulated robot: input events as Linux writes them, into a pipe in the file system.

Written after the kernel, not after our tracker (`tests/hardware/test_wii.py` holds golden bytes of the same):

- drivers/hid/hid-wiimote-modules.c: the device is called "Nintendo Wii Remote IR"; `wiimod_ir_in_ir` hands on the camera's ten
  bits as they are; `wiimod_ir_probe` gives the axes ABS_HAT0X (0..1023), ABS_HAT0Y (0..767) and on to ABS_HAT3Y a fuzz of 2; one
  report after the fourth light.
- The camera's x grows to the right and its y upwards: public programs (of WiimoteLib, say) take 1 - x/1024 and y/768 as the place
  on a screen, whose y grows downwards, that the remote points at, and what a remote sees moves against that. Both are 1023
  where no light is (xwiimote's `xwii_event_ir_is_valid`).
- drivers/input/input.c: `input_defuzz_abs_event` smooths changes below four pixels, and an unchanged value is no event; a report
  without any is not handed on. A full queue is emptied: SYN_DROPPED.

The picture of a remote that hangs with its lens down is what somebody sees who looks down: not mirrored.
Unlike the kernel's, a pipe cannot be asked for what it remembers, so after SYN_DROPPED everything is reported again.
"""

from __future__ import annotations

import contextlib
import math
import os
from collections.abc import Callable
from pathlib import Path

import numpy as np

from bns.hardware.clock import EmulatedClock
from bns.hardware.emulators.faults import Faults
from bns.hardware.tracking.infrared.evdev import ABS_HAT0X, EV_ABS, EV_SYN, EVENT, SYN_DROPPED, SYN_REPORT
from bns.hardware.tracking.rigid import placed
from bns.hardware.tracking.wii import LEDS_M, Overhead

_RATE_HZ = 100.0
_JITTER_PX = 0.3
_FUZZ_PX = 2
_SLOTS, _COLUMNS, _ROWS, _EMPTY = 4, 1024, 768, 1023


def sensed_px(points_m: np.ndarray, camera: Overhead) -> np.ndarray:
    """Where a camera `camera.height_m` above the plane of the lights, looking straight down, sees points (n, 2): x right, y up.

    Its y grows along `up_rad`, and x to the right of that as seen from above; a `mirror` between turns x round.
    """
    away = points_m - [camera.x_m, camera.y_m]
    ahead = np.array([math.cos(camera.up_rad), math.sin(camera.up_rad)])
    right = np.array([ahead[1], -ahead[0]]) * (-1.0 if camera.mirror else 1.0)
    focal_px = _COLUMNS / 2 / math.tan(camera.view_rad / 2)
    middle = np.array([_COLUMNS / 2, _ROWS / 2])
    return np.asarray(middle + focal_px / camera.height_m * np.column_stack([away @ right, away @ ahead]))


def defuzzed(value: int, old: int, fuzz: int = _FUZZ_PX) -> int:
    """What the kernel makes of a new value of an axis: small changes are smoothed. Values are not negative."""
    change = abs(value - old)
    if change < fuzz // 2:
        return old
    if change < fuzz:
        return (3 * old + value) // 4
    return (old + value) // 2 if change < 2 * fuzz else value


class WiiEmulator:
    """Writes a report whenever emulated time has moved on to a new one; like the kernel, only what has changed.

    `battery` beside the pipe is the file that can be read while the remote answers; `jitter_px` is the noise of its lights.
    """

    def __init__(
        self,
        path: Path,
        pose: Callable[[float], np.ndarray],
        camera: Overhead,
        clock: EmulatedClock,
        faults: Faults | None = None,
        seed: int = 0,
        leds_m: np.ndarray = LEDS_M,
        jitter_px: float = _JITTER_PX,
    ) -> None:
        self._jitter_px, self.battery = jitter_px, path.with_name(f"{path.name}-battery")
        self.battery.write_text("80\n")
        self.path, self._pose, self._camera, self._clock, self._leds_m = path, pose, camera, clock, leds_m
        self._faults = faults or Faults()
        self._draw = np.random.default_rng([seed, 1024])
        self._last = np.full((_SLOTS, 2), _EMPTY, np.int64)
        self._frame = -1
        os.mkfifo(path)
        self._keep = os.open(path, os.O_RDONLY | os.O_NONBLOCK)  # so that the pipe outlives its readers
        self._write = os.open(path, os.O_WRONLY | os.O_NONBLOCK)
        clock.listeners.append(self.moved_on)

    def moved_on(self, now_s: float) -> None:
        """Called by the clock."""
        frame = math.floor(now_s * _RATE_HZ)
        if frame <= self._frame:
            return
        self._frame = frame
        if self._faults.strikes("stuck-marker", now_s):
            self.battery.unlink(missing_ok=True)  # it does not answer
            return
        if not self.battery.exists():
            self.battery.write_text("80\n")
        self._send(self._lights(now_s), now_s)

    def close(self) -> None:
        """Take the pipe away."""
        self._clock.listeners.remove(self.moved_on)
        os.close(self._write)
        os.close(self._keep)
        self.path.unlink(missing_ok=True)
        self.battery.unlink(missing_ok=True)

    def _lights(self, now_s: float) -> np.ndarray:
        px = sensed_px(placed(self._leds_m, self._pose(now_s)), self._camera)
        px = np.rint(px + self._jitter_px * self._draw.standard_normal(px.shape)).astype(np.int64)
        inside = (px >= 0).all(axis=1) & (px[:, 0] < _EMPTY) & (px[:, 1] < _ROWS)
        lights = [p for p, seen in zip(px, inside, strict=True) if seen]
        if self._faults.strikes("lost-marker", now_s):
            lights = lights[1:]
        if self._faults.strikes("reflection", now_s):
            lights.append(self._draw.integers([0, 0], [_EMPTY, _ROWS]))
        if self._faults.strikes("swapped-markers", now_s):
            self._draw.shuffle(lights)
        report = np.full((_SLOTS, 2), _EMPTY, np.int64)
        report[: len(lights)] = lights[:_SLOTS] if lights else report[:0]
        return report

    def _send(self, report: np.ndarray, now_s: float) -> None:
        pairs = zip(report.ravel().tolist(), self._last.ravel().tolist(), strict=True)
        report = np.array([defuzzed(new, old) for new, old in pairs], np.int64).reshape(_SLOTS, 2)
        changed = np.argwhere(report != self._last)
        if not len(changed):
            return
        self._last = report
        try:
            os.write(self._write, self._packed(changed, now_s))
        except BlockingIOError:  # nobody reads: like the kernel, throw the queue away and say so
            with contextlib.suppress(BlockingIOError):
                while os.read(self._keep, 65536):
                    pass
            everything = np.argwhere(np.ones_like(report, bool))
            os.write(self._write, self._lost(now_s) + self._packed(everything, now_s))

    def _packed(self, places: np.ndarray, now_s: float) -> bytes:
        events = [self._event(now_s, EV_ABS, ABS_HAT0X + 2 * i + axis, self._last[i, axis]) for i, axis in places]
        return b"".join([*events, self._event(now_s, EV_SYN, SYN_REPORT, 0)])

    def _lost(self, now_s: float) -> bytes:
        return self._event(now_s, EV_SYN, SYN_DROPPED, 0) + self._event(now_s, EV_SYN, SYN_REPORT, 0)

    @staticmethod
    def _event(now_s: float, kind: int, code: int, value: int) -> bytes:
        return EVENT.pack(int(now_s), int(now_s % 1.0 * 1e6), kind, code, int(value))
