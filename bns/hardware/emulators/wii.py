"""A Wii remote above an emulated robot: input events as the kernel writes them, into a pipe in the file system."""

from __future__ import annotations

import contextlib
import math
import os
from collections.abc import Callable
from pathlib import Path

import numpy as np

from bns.hardware.clock import EmulatedClock
from bns.hardware.emulators.faults import Faults
from bns.hardware.tracking.rigid import placed
from bns.hardware.tracking.wii import (
    ABS_HAT0X,
    EV_ABS,
    EV_SYN,
    EVENT,
    HEIGHT_PX,
    LEDS_M,
    LIGHTS,
    NOTHING_PX,
    SYN_DROPPED,
    SYN_REPORT,
    WIDTH_PX,
    Overhead,
)

_RATE_HZ = 100.0
_JITTER_PX = 0.3


class WiiEmulator:
    """Writes a report whenever emulated time has moved on to a new one; like the kernel, only what has changed."""

    def __init__(
        self,
        path: Path,
        pose: Callable[[float], np.ndarray],
        camera: Overhead,
        clock: EmulatedClock,
        faults: Faults | None = None,
        seed: int = 0,
        leds_m: np.ndarray = LEDS_M,
    ) -> None:
        self.path, self._pose, self._camera, self._clock, self._leds_m = path, pose, camera, clock, leds_m
        self._faults = faults or Faults()
        self._draw = np.random.default_rng([seed, 1024])
        self._last = np.full((LIGHTS, 2), NOTHING_PX, np.int64)
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
            return
        self._send(self._lights(now_s), now_s)

    def close(self) -> None:
        """Take the pipe away."""
        self._clock.listeners.remove(self.moved_on)
        os.close(self._write)
        os.close(self._keep)
        self.path.unlink(missing_ok=True)

    def _lights(self, now_s: float) -> np.ndarray:
        px = self._camera.px(placed(self._leds_m, self._pose(now_s)))
        px = np.rint(px + _JITTER_PX * self._draw.standard_normal(px.shape)).astype(np.int64)
        inside = (px >= 0).all(axis=1) & (px[:, 0] < WIDTH_PX - 1) & (px[:, 1] < HEIGHT_PX)
        lights = [p for p, seen in zip(px, inside, strict=True) if seen]
        if self._faults.strikes("lost-marker", now_s):
            lights = lights[1:]
        if self._faults.strikes("reflection", now_s):
            lights.append(self._draw.integers([0, 0], [WIDTH_PX - 1, HEIGHT_PX]))
        if self._faults.strikes("swapped-markers", now_s):
            self._draw.shuffle(lights)
        report = np.full((LIGHTS, 2), NOTHING_PX, np.int64)
        report[: len(lights)] = lights[:LIGHTS] if lights else report[:0]
        return report

    def _send(self, report: np.ndarray, now_s: float) -> None:
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
            os.write(self._write, self._event(now_s, EV_SYN, SYN_DROPPED, 0) + self._packed(everything, now_s))

    def _packed(self, places: np.ndarray, now_s: float) -> bytes:
        events = [self._event(now_s, EV_ABS, ABS_HAT0X + 2 * i + axis, self._last[i, axis]) for i, axis in places]
        return b"".join([*events, self._event(now_s, EV_SYN, SYN_REPORT, 0)])

    @staticmethod
    def _event(now_s: float, kind: int, code: int, value: int) -> bytes:
        return EVENT.pack(int(now_s), int(now_s % 1.0 * 1e6), kind, code, int(value))
