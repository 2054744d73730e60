"""A whole emulated rig: a Khepera III on a pseudo-terminal, under the tracker that its rig names."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np

from bns.engine.philox import Key
from bns.hardware.clock import EmulatedClock
from bns.hardware.emulators.body import DifferentialBody
from bns.hardware.emulators.devices.khepera import KheperaEmulator
from bns.hardware.emulators.devices.terminal import HangUp, PseudoTerminal
from bns.hardware.emulators.faults import FaultPlan
from bns.hardware.rig import Rig
from bns.hardware.tracking.kinds import emulated
from bns.hardware.wheels.khepera import firmware
from bns.physics.model import load_model
from bns.robots.khepera import START

_FIRMWARE = (2, 4)


class EmulatedKheperaRig:
    """Implements `bns.hardware.platform.Emulation`."""

    def __init__(self, rig: Rig, folder: Path, clock: EmulatedClock, plan: FaultPlan, seed: int) -> None:
        self._clock = clock
        self.body = DifferentialBody(load_model("khepera-world"), Key.of_run(seed, 0, "khepera", "emulated"), START)
        self.robot = KheperaEmulator(self.body, clock, firmware(*_FIRMWARE), plan.of("khepera"))
        self._line = PseudoTerminal(self.robot, folder, "khepera")
        self._hang_up = HangUp(self._line, clock)
        self.robot.cut_line = self._hang_up.cut
        tracker, self._watcher = emulated(rig.tracker, folder, self.body.seen, clock, plan.of("tracker"), seed)
        self.rig = replace(rig, port=str(self._line.path), tracker=tracker)

    def put_down(self, pose: np.ndarray) -> None:
        """Place the robot."""
        self.body.put_down(tuple(float(v) for v in pose), self._clock.now_s())  # type: ignore[arg-type]  # three of them

    def unstable_between(self, begin_s: float, end_s: float) -> bool:
        """Never: it stands on two wheels."""
        return False

    def close(self) -> None:
        """Take it away."""
        self._hang_up.close()
        self._line.close()
        self._watcher.close()
