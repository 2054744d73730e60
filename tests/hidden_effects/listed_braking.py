"""Listed effects of wheels that speed up, slow down or answer unlike each other, written a second time: in small steps."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from tests.hidden_effects.cause import Cause, Moment
from tests.hidden_effects.listed_loads import BASE_M, FINE


def _in_small_steps(told: np.ndarray, moment: Moment, change: Callable[..., np.ndarray]) -> np.ndarray:
    """Mean over each step (n, t, 2) of speeds from rest, to which ``change(told, now, small_s)`` is added in each part of one."""
    out, now = np.empty_like(told), np.zeros_like(told[:, 0])
    small_s = moment.step_s / FINE
    for i in range(told.shape[1]):
        summed = np.zeros_like(now)
        for _ in range(FINE):
            then = now + change(told[:, i], now, small_s)
            summed, now = summed + (now + then) / 2, then
        out[:, i] = summed / FINE
    return out


def _slower(told: np.ndarray, now: np.ndarray) -> np.ndarray:
    """Which speeds are on their way to rest."""
    return np.sign(told - now) * np.sign(now) < 0


@dataclass
class LagMismatch(Cause):
    """Each wheel makes up for a part of what it lacks, one a larger part than the other."""

    tau_s: float
    ratio: float

    def wheels(self, wheels: np.ndarray, moment: Moment) -> np.ndarray:
        lags_s = 2 * self.tau_s * np.array([1.0, self.ratio]) / (1.0 + self.ratio)
        return _in_small_steps(wheels, moment, lambda told, now, small_s: (told - now) * -np.expm1(-small_s / lags_s))


@dataclass
class BrakingLag(Cause):
    """Each wheel makes up for a part of what it lacks, another one while it slows down."""

    tau_s: float
    brake_ratio: float

    def wheels(self, wheels: np.ndarray, moment: Moment) -> np.ndarray:
        def change(told: np.ndarray, now: np.ndarray, small_s: float) -> np.ndarray:
            lags_s = np.where(_slower(told, now), self.tau_s * self.brake_ratio, self.tau_s)
            return (told - now) * -np.expm1(-small_s / lags_s)

        return _in_small_steps(wheels, moment, change)


def _at_most(told: np.ndarray, now: np.ndarray, small_s: float, limit: np.ndarray, brake_ratio: float) -> np.ndarray:
    most = np.where(_slower(told, now), limit * brake_ratio, limit) * small_s
    return np.clip(told - now, -most, most)


@dataclass
class BrakingLimit(Cause):
    """Each wheel comes nearer to its command in every part of a step, by no more than its limit for that direction."""

    max_m_s2: float
    brake_ratio: float

    def wheels(self, wheels: np.ndarray, moment: Moment) -> np.ndarray:
        limit = np.full(2, self.max_m_s2)
        return _in_small_steps(wheels, moment, lambda *state: _at_most(*state, limit, self.brake_ratio))


@dataclass
class BrakingRamp(Cause):
    """The same of forward velocity and turn rate."""

    forward_m_s2: float
    turn_rad_s2: float
    brake_ratio: float

    def wheels(self, wheels: np.ndarray, moment: Moment) -> np.ndarray:
        told = np.stack([wheels.sum(axis=2) / 2, (wheels[..., 1] - wheels[..., 0]) / BASE_M], axis=2)
        limit = np.array([self.forward_m_s2, self.turn_rad_s2])
        out = _in_small_steps(told, moment, lambda *state: _at_most(*state, limit, self.brake_ratio))
        half = out[..., 1] * BASE_M / 2
        return np.stack([out[..., 0] - half, out[..., 0] + half], axis=2)
