"""The body of an emulated two-wheeled robot: the physics model, moved by whatever speeds were set, whenever they were.

All of the drive since it was put down is integrated at once by the code of the physics world, so that an emulated trial
and that world cannot disagree about physics. How the robot comes to rest at the end is beyond that world, whose drives end with
their last command: there the wheels brake as `braking` says.
"""

from __future__ import annotations

import threading

import numpy as np

from bns.engine.philox import Key, Purpose, normals
from bns.hardware.emulators.braking import Braking, motor_tau_s
from bns.physics.model import Model
from bns.physics.wheels.differential_drive import observe, track

_STEP_S = 0.01
SPEED_OVER_S = _STEP_S
"""A speed is the mean over so long before its time."""
_AHEAD_S = 4.0


class DifferentialBody:
    """Pose and wheel speeds at any time not before the last order. Draws of jitter and noise are keyed, one a speed order."""

    def __init__(self, model: Model, key: Key, start: tuple[float, float, float]) -> None:
        self.model, self._key = model, key
        self._delay_s = model.values_of("command-delay")["delay_s"]
        self._tau_s = motor_tau_s(model.values_of("motor-lag")["tau_s"])
        self._lock = threading.Lock()
        self._stop_s: float | None = None
        """When an order to stand reaches the wheels; they brake from then on."""
        self._braking: Braking | None = None
        self._orders = 0
        self.put_down(start, 0.0)
        self.order(0.1, 0.1, 0.0)  # compiles what is not compiled yet, before anybody waits for an answer
        self.wheel_speeds_m_s(0.0)
        self.put_down(start, 0.0)

    def put_down(self, pose: tuple[float, float, float], t_s: float) -> None:
        """Somebody places the robot: it stands at `pose` from now on, wheels as they were ordered last."""
        with self._lock:
            self._restart(np.asarray(pose, np.float64), t_s)

    def order(self, left_m_s: float, right_m_s: float, t_s: float) -> None:
        """Wheel speeds from now on; both 0 is an order to stand."""
        with self._lock:
            self._orders += 1
            if left_m_s == right_m_s == 0.0:
                self._stop_s = t_s + self._delay_s if self._stop_s is None else self._stop_s
                return
            if self._stop_s is not None and t_s > self._stop_s:
                self._restart(self._at(t_s), t_s)
            self._stop_s = None
            jitter = normals(self._key, Purpose.WORLD_EVALUATED, self._orders, 1, 1)[0, 0, :2]
            speeds = np.array([left_m_s, right_m_s]) * (1.0 + self.model.jitter_relative * jitter)
            self._segments.append((max(t_s, self._segments[-1][0]), *speeds))
            self._samples = np.empty((0, 3))

    def pose(self, t_s: float) -> np.ndarray:
        """True pose (3,): x_m, y_m, heading_rad, unwrapped."""
        with self._lock:
            return self._at(t_s)

    def seen(self, t_s: float) -> np.ndarray:
        """Pose of what a tracker looks at: with the model's effects on measurements (an offset marker, say), without noise."""
        return observe(self.pose(t_s)[None], None, self.model)[0]

    def wheel_speeds_m_s(self, t_s: float) -> tuple[float, float]:
        """Speeds of the wheels over the ground, m/s."""
        with self._lock:
            return self._speeds_between(self._at(t_s - _STEP_S), self._at(t_s))

    def _speeds_between(self, before: np.ndarray, now: np.ndarray) -> tuple[float, float]:
        """Of the wheels, from one pose to that a step later."""
        ahead = np.array([np.cos(now[2]), np.sin(now[2])]) @ (now[:2] - before[:2]) / _STEP_S
        half_turn = (now[2] - before[2]) / _STEP_S * self.model.wheelbase_m / 2.0
        return float(ahead - half_turn), float(ahead + half_turn)

    def _restart(self, pose: np.ndarray, t_s: float) -> None:
        self._pose0, self._t0_s = pose, t_s
        self._segments: list[tuple[float, float, float]] = [(t_s, 0.0, 0.0)]
        self._samples = np.empty((0, 3))
        self._stop_s, self._braking = None, None

    def _at(self, t_s: float) -> np.ndarray:
        if self._stop_s is None or t_s <= self._stop_s:
            return self._driven(t_s)
        if self._braking is None:
            speeds = np.array(self._speeds_between(self._driven(self._stop_s - _STEP_S), self._driven(self._stop_s)))
            self._braking = Braking(self._stop_s, self._driven(self._stop_s), speeds, self.model.wheelbase_m, self._tau_s)
        return self._braking.pose_at(t_s)

    def _driven(self, t_s: float) -> np.ndarray:
        """Pose (3,) by the orders to drive alone."""
        after_s = max(t_s - self._t0_s, 0.0)
        if after_s >= (len(self._samples) - 1) * _STEP_S:
            self._samples = self._integrated(after_s + _AHEAD_S)
        position = after_s / _STEP_S
        low = int(position)
        share = position - low
        mixed: np.ndarray = (1 - share) * self._samples[low] + share * self._samples[low + 1]
        return mixed

    def _integrated(self, until_s: float) -> np.ndarray:
        times = np.array([s[0] for s in self._segments] + [self._t0_s + until_s])
        speeds = np.array(self._segments)[:, 1:]
        driven = track(
            self.model,
            speeds[None, :, 0],
            speeds[None, :, 1],
            np.diff(times)[None],
            dense_dt_s=_STEP_S,
            start=tuple(self._pose0),
        )
        return driven.poses[0]
