"""A whole emulated rig: a snake of servos on a bus or behind a bridge, under a camera that films its markers."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from bns.hardware.clock import EmulatedClock
from bns.hardware.emulators.devices.bridge import BridgeEmulator
from bns.hardware.emulators.devices.bus import Bus
from bns.hardware.emulators.devices.servo import Servo
from bns.hardware.emulators.devices.terminal import HangUp, PseudoTerminal
from bns.hardware.emulators.faults import FaultPlan
from bns.hardware.emulators.scene import Patch, disc
from bns.hardware.emulators.snake_body import SnakeBody
from bns.hardware.emulators.watchers import GREEN_BGR, YELLOW_BGR, emulated_camera, emulated_lens
from bns.hardware.rig import Rig
from bns.hardware.servos.servo_table import BAUD
from bns.hardware.servos.snake_settings import snake_settings
from bns.hardware.tracking.lens import Lens
from bns.physics.snake.parameters import shipped_parameters
from bns.physics.snake_drive import START_HEADING_RAD, START_M

_RATE_HZ = 5.0
"""Enough for a robot that moves some centimetres in that time."""
_KEPT = 400
"""Moments that a late tracker's rig remembers; some seconds."""


def lens() -> Lens:
    """High enough to see both ends of a robot whose middle is anywhere on the surface; 768 by 432 pixels."""
    return emulated_lens(0.6, 3.0, 0.02)


class EmulatedSnakeRig:
    """Implements `bns.hardware.platform.Emulation`."""

    def __init__(self, rig: Rig, folder: Path, clock: EmulatedClock, plan: FaultPlan, seed: int) -> None:
        settings, faults = snake_settings(rig.driver), plan.of("snake")
        self._clock, self._tracker_faults, self._worn_last = clock, plan.of("tracker"), list[Patch]()
        self.body = SnakeBody(shipped_parameters(), seed)
        self.body.lay(START_M, START_HEADING_RAD, 0.0)
        self._places: list[tuple[float, np.ndarray]] = []
        if any(fault.kind == "late-tracker" for fault in plan.faults):
            clock.listeners.append(self._remember)
        kind = settings.table
        self.servos = [
            Servo(number, clock, faults, self.body.joint(place), kind, baud_rate=kind.bauds[BAUD])
            for place, number in enumerate(settings.ids)
        ]
        self.body.servos = self.servos
        device = BridgeEmulator(self.servos, clock, faults) if settings.wiring == "bridge" else Bus(self.servos, clock, faults)
        self._line = PseudoTerminal(device, folder, "snake")
        self._bridge = device if isinstance(device, BridgeEmulator) else None
        self._hang_up = HangUp(self._line, clock, self._bridge.opened if self._bridge is not None else lambda: None)
        device.cut_line = self._hang_up.cut
        if self._bridge is not None:
            self._bridge.send = self._line.send
        tracker, self._camera = emulated_camera(
            rig.tracker, folder, lambda now_s: self._worn(rig.tracker, now_s), clock, self._tracker_faults, seed, lens(), _RATE_HZ
        )
        self.rig = replace(rig, port=str(self._line.path), tracker=tracker)

    def put_down(self, pose: np.ndarray) -> None:
        """Lay the robot down, straight."""
        self.body.lay(tuple(pose[:2]), float(pose[2]), self._clock.now_s())
        self._camera.film()

    def unstable_between(self, begin_s: float, end_s: float) -> bool:
        """Whether somebody who watched would call what it did in that time unstable."""
        return any(begin_s < t_s <= end_s for t_s, _ in self.body.unstable)

    def close(self) -> None:
        """Take it away."""
        self._hang_up.close()
        if self._remember in self._clock.listeners:
            self._clock.listeners.remove(self._remember)
        if self._bridge is not None:
            self._bridge.close()
        self._line.close()
        self._camera.close()

    def _remember(self, now_s: float) -> None:
        """Where the markers are, for a tracker that is late."""
        places, up = self.body.markers(now_s)
        self._places = [*self._places[-_KEPT:], (now_s, np.column_stack([places, up]))]

    def _remembered(self, then_s: float) -> tuple[np.ndarray, np.ndarray]:
        times, places = np.array([t_s for t_s, _ in self._places]), np.array([place for _, place in self._places])
        found = np.array([[np.interp(then_s, times, column) for column in each.T] for each in np.moveaxis(places, 1, 0)])
        return found[:, :3], found[:, 3]

    def _worn(self, settings: Mapping[str, Any], now_s: float) -> list[Patch]:
        """The markers are balls, alike from everywhere, on the tops of their links: a link that lies on its side hides them.

        Of a frozen scene they are where they were; the body cannot be asked where it was at any other time.
        """
        filmed_s = self._tracker_faults.filmed_s(now_s)
        if filmed_s < now_s and self._worn_last and not self._places:
            return self._worn_last
        places, up = self.body.markers(now_s) if not self._places else self._remembered(filmed_s)
        diameter_m = float(settings["diameter_m"])
        self._worn_last = [
            disc(colour, diameter_m, x, y, z)
            for (x, y, z), top, colour in zip(places.tolist(), up, (YELLOW_BGR, GREEN_BGR), strict=True)
            if top > 0.0
        ]
        return self._worn_last
