"""How a wheel under speed control comes to rest when it is told to stand: the controller puts the whole voltage against it.

The firmware's speed mode has no ramp (its speed profile is of the position mode), and its integral part saturates. A motor at
full voltage moves by dw/dt = (±v - w)/tau, where v is the speed that it would reach. From rest it is at a speed u after
tau·ln(v/(v - u)); told to stand at that speed, with the voltage against it, after tau·ln(1 + u/v), which is about half as long.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

FULL_VOLTAGE_M_S = 0.333
"""Open loop, as the manual of the Khepera III has it (48,000 units; regulated, it gives 43,000 at most)."""
_SETTLED = 0.95
"""Share of a speed that a first-order lag has reached after three time constants."""
_TOP_M_S = 0.2083
"""Highest speed that commands ask for."""


def motor_tau_s(lag_s: float) -> float:
    """Time constant of a motor that takes three time constants of the model's lag from rest to the top speed; a guess, as the
    lag is one: what is known of it is how long a wheel takes to settle."""
    return 3.0 * lag_s / math.log(FULL_VOLTAGE_M_S / (FULL_VOLTAGE_M_S - _SETTLED * _TOP_M_S))


@dataclass(frozen=True)
class Braking:
    """From `since_s` on the wheels, at `speeds_m_s` (2,) then, brake; `pose` (3,) is where the robot was."""

    since_s: float
    pose: np.ndarray
    speeds_m_s: np.ndarray
    wheelbase_m: float
    tau_s: float

    def pose_at(self, t_s: float) -> np.ndarray:
        """Where the robot is at a time not before it brakes: on the arc of the two wheels' ways."""
        left_m, right_m = self._ways_m(t_s - self.since_s)
        turn_rad = (right_m - left_m) / self.wheelbase_m
        along_rad = self.pose[2] + turn_rad / 2.0
        chord_m = (left_m + right_m) / 2.0 * np.sinc(turn_rad / 2.0 / np.pi)
        return np.array(
            [self.pose[0] + chord_m * np.cos(along_rad), self.pose[1] + chord_m * np.sin(along_rad), self.pose[2] + turn_rad]
        )

    def _lasts_s(self) -> np.ndarray:
        lasts: np.ndarray = self.tau_s * np.log1p(np.abs(self.speeds_m_s) / FULL_VOLTAGE_M_S)
        return lasts

    def _ways_m(self, after_s: float) -> np.ndarray:
        """Ways of the wheels (2,) since they brake."""
        if self.tau_s <= 0.0:
            return np.zeros(2)
        passed_s, size = np.minimum(after_s, self._lasts_s()), np.abs(self.speeds_m_s)
        ways = (size + FULL_VOLTAGE_M_S) * self.tau_s * -np.expm1(-passed_s / self.tau_s) - FULL_VOLTAGE_M_S * passed_s
        return np.sign(self.speeds_m_s) * ways
