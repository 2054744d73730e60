"""The body of an emulated two-wheeled robot: the physics model, moved by whatever speeds were set, whenever they were.

All of the drive since it was put down is integrated at once by the code of the physics world, so that an emulated trial
and that world cannot disagree about physics.
"""

from __future__ import annotations

import threading

import numpy as np

from bns.engine.philox import Key, Purpose, normals
from bns.physics.differential_drive import observe, track
from bns.physics.model import Model

_STEP_S = 0.01
_AHEAD_S = 4.0
_REST_S = 2.0  # all effects with a memory have settled


class DifferentialBody:
    """Pose and wheel speeds at any time not before the last order. Draws of jitter and noise are keyed, one a speed order."""

    def __init__(self, model: Model, key: Key, start: tuple[float, float, float]) -> None:
        self.model, self._key = model, key
        self._lock = threading.Lock()
        self._orders = 0
        self._looks = 0
        self.put_down(start, 0.0)
        self.order(0.0, 0.0, 0.0)  # compiles what is not compiled yet, before anybody waits for an answer
        self.wheel_speeds_m_s(0.0)
        self.put_down(start, 0.0)

    def put_down(self, pose: tuple[float, float, float], t_s: float) -> None:
        """Somebody places the robot: it stands at `pose` from now on, wheels as they were ordered last."""
        with self._lock:
            self._restart(np.asarray(pose, np.float64), t_s)

    def order(self, left_m_s: float, right_m_s: float, t_s: float) -> None:
        """Wheel speeds from now on."""
        with self._lock:
            if self._at_rest(t_s):
                self._restart(self._at(t_s)[:3], t_s)
            self._orders += 1
            jitter = normals(self._key, Purpose.WORLD_EVALUATED, self._orders, 1, 1)[0, 0, :2]
            speeds = np.array([left_m_s, right_m_s]) * (1.0 + self.model.jitter_relative * jitter)
            self._segments.append((max(t_s, self._segments[-1][0]), *speeds))
            self._samples = np.empty((0, 3))

    def pose(self, t_s: float) -> np.ndarray:
        """True pose (3,): x_m, y_m, heading_rad, unwrapped."""
        with self._lock:
            return self._at(t_s)[:3]

    def seen(self, t_s: float) -> np.ndarray:
        """Pose of what a tracker looks at: with the model's effects on measurements (an offset marker, say), without noise."""
        return observe(self.pose(t_s)[None], None, self.model)[0]

    def wheel_speeds_m_s(self, t_s: float) -> tuple[float, float]:
        """Speeds of the wheels over the ground, m/s."""
        with self._lock:
            before, now = self._at(t_s - _STEP_S), self._at(t_s)
        ahead = np.array([np.cos(now[2]), np.sin(now[2])]) @ (now[:2] - before[:2]) / _STEP_S
        half_turn = (now[2] - before[2]) / _STEP_S * self.model.wheelbase_m / 2.0
        return float(ahead - half_turn), float(ahead + half_turn)

    def _restart(self, pose: np.ndarray, t_s: float) -> None:
        self._pose0, self._t0_s = pose, t_s
        self._segments: list[tuple[float, float, float]] = [(t_s, 0.0, 0.0)]
        self._samples = np.empty((0, 3))

    def _at_rest(self, t_s: float) -> bool:
        since_s, left, right = self._segments[-1]
        return left == 0.0 and right == 0.0 and t_s - since_s > _REST_S

    def _at(self, t_s: float) -> np.ndarray:
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
