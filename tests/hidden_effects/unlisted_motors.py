"""What motors and their wheels do that no list holds: to swing, to slip or to come loose."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.signal import lfilter

from tests.hidden_effects.cause import Cause, Moment


@dataclass
class LostPulses(Cause):
    """A counter that misses pulses of a fast wheel: its controller makes good what it does not see."""

    from_m_s: float
    lost: float

    def command(self, wheels: np.ndarray) -> np.ndarray:
        size = np.abs(wheels)
        return np.sign(wheels) * np.where(size > self.from_m_s, self.from_m_s + (size - self.from_m_s) / (1 - self.lost), size)


@dataclass
class LeftOvershoot(Cause):
    """The left wheel's speed swings about a new command before it settles; the right one follows at once."""

    frequency_hz: float
    damping: float

    def wheels(self, wheels: np.ndarray, moment: Moment) -> np.ndarray:
        # exact for speeds held through a step: the two roots of s^2 + 2 damping w s + w^2
        root = 2 * np.pi * self.frequency_hz * complex(-self.damping, np.sqrt(1 - self.damping**2))
        pole = np.exp(root * moment.step_s)
        residue = root * np.conj(root) / (root * (root - np.conj(root))) * (pole - 1)
        first = 2 * residue.real
        second = -2 * (residue * np.conj(pole)).real
        swung = lfilter([0, first, second], [1, -2 * pole.real, abs(pole) ** 2], wheels[..., 0], axis=1)
        return np.stack([swung, wheels[..., 1]], axis=-1)


@dataclass
class SpeedLag(Cause):
    """A wheel follows its command the later, the faster it turns."""

    tau_s: float
    fastest_m_s: float

    def wheels(self, wheels: np.ndarray, moment: Moment) -> np.ndarray:
        out, now = np.zeros_like(wheels), np.zeros_like(wheels[:, 0])
        for i in range(wheels.shape[1]):
            tau = np.maximum(self.tau_s * np.abs(wheels[:, i]) / self.fastest_m_s, moment.step_s)
            now = now + (wheels[:, i] - now) * -np.expm1(-moment.step_s / tau)
            out[:, i] = now
        return out


@dataclass
class Stalls(Cause):
    """Now and then the left wheel stands still for a moment."""

    rate_per_s: float
    time_s: float

    def wheels(self, wheels: np.ndarray, moment: Moment) -> np.ndarray:
        begins = moment.rng.random(wheels.shape[:2]) < self.rate_per_s * moment.step_s
        lasts = np.ones(max(int(self.time_s / moment.step_s), 1))
        stands = lfilter(lasts, [1], begins.astype(float), axis=1) > 0.5
        return wheels * np.stack([~stands, np.ones_like(stands)], axis=-1)


@dataclass
class LooseWheel(Cause):
    """From some time of the session on the left wheel loses a share of its speed."""

    loss: float
    from_s: float

    def demand(self, wheels: np.ndarray, moment: Moment) -> np.ndarray:
        loose = moment.session_s + moment.trial_s > self.from_s
        return wheels * np.stack([1 - self.loss * loose, np.ones_like(loose)], axis=-1)


@dataclass
class WeakSupply(Cause):
    """Each wheel slows the other: the faster that one is told to turn, the slower this one turns."""

    loss: float
    fastest_m_s: float

    def command(self, wheels: np.ndarray) -> np.ndarray:
        return wheels * (1 - self.loss * np.abs(wheels[..., ::-1]) / self.fastest_m_s)


MOTORS: dict[str, type[Cause]] = {
    "lost-pulses": LostPulses,
    "left-overshoot": LeftOvershoot,
    "speed-lag": SpeedLag,
    "stalls": Stalls,
    "loose-wheel": LooseWheel,
    "weak-supply": WeakSupply,
}
