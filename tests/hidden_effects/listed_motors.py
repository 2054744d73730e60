"""Listed effects of controllers, gears and wheels, written a second time."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.signal import lfilter

from tests.hidden_effects.cause import Cause, Moment
from tests.hidden_effects.listed_loads import FINE


@dataclass
class SupplySag(Cause):
    """Both motors draw currents in proportion to their speeds from a battery with a resistance; both get what is left."""

    loss_s_m: float

    def command(self, wheels: np.ndarray) -> np.ndarray:
        turning = wheels.copy()
        for _ in range(60):
            left = 1.0 - self.loss_s_m * np.abs(turning).sum(axis=-1, keepdims=True)
            turning = (turning + wheels * left) / 2
        return turning


@dataclass
class CommandQuantisation(Cause):
    """The controller knows multiples of a step."""

    step_m_s: float
    share: float = 1.0

    def command(self, wheels: np.ndarray) -> np.ndarray:
        known = np.floor(wheels / self.step_m_s + 0.5) * self.step_m_s
        return (1 - self.share) * wheels + self.share * known


@dataclass
class CommandTruncation(Cause):
    """The controller stores whole steps and forgets what is left, as C does."""

    step_m_s: float
    share: float = 1.0

    def command(self, wheels: np.ndarray) -> np.ndarray:
        forgotten = np.fmod(wheels, self.step_m_s)
        return wheels - self.share * forgotten


@dataclass
class StartDelay(Cause):
    """A wheel turns when it has been told to for a while: looked at in small steps."""

    wait_s: float

    def wheels(self, wheels: np.ndarray, moment: Moment) -> np.ndarray:
        out, small_s = np.zeros_like(wheels), moment.step_s / FINE
        told_s = np.zeros_like(wheels[:, 0])
        for i in range(wheels.shape[1]):
            for _ in range(FINE):
                told_s = np.where(wheels[:, i] == 0, 0.0, told_s + small_s)
                out[:, i] += np.where(told_s > self.wait_s + small_s / 2, wheels[:, i], 0.0) / FINE
        return out


@dataclass
class ReversalPause(Cause):
    """A wheel may turn one way when it has not been told to turn the other way for a while: looked at in small steps."""

    pause_s: float

    def wheels(self, wheels: np.ndarray, moment: Moment) -> np.ndarray:
        out, small_s = np.empty_like(wheels), moment.step_s / FINE
        last_s = np.full((2, *wheels[:, 0].shape), -np.inf)  # when each wheel last turned forwards and backwards
        now_s = 0.0
        for i in range(wheels.shape[1]):
            told, turned = wheels[:, i], np.zeros_like(wheels[:, i])
            for _ in range(FINE):
                now_s += small_s
                other = np.where(told > 0, last_s[1], last_s[0])
                free = now_s - other > self.pause_s + small_s / 2
                turned += np.where(free, told, 0.0) / FINE
                for sign, seen in zip((1, -1), last_s, strict=True):
                    seen[free & (np.sign(told) == sign)] = now_s
            out[:, i] = turned
        return out


@dataclass
class Breakaway(Cause):
    """Each wheel has two switches, one for each direction, moved by its commands in turn: on from one, off below a lower one."""

    threshold_m_s: float
    stop_ratio: float

    def command(self, wheels: np.ndarray) -> np.ndarray:
        return self._one_way(wheels) - self._one_way(-wheels)

    def _one_way(self, wheels: np.ndarray) -> np.ndarray:
        said = np.where(wheels >= self.threshold_m_s, 1, np.where(wheels < self.threshold_m_s * self.stop_ratio, -1, 0))
        state, out = np.full_like(said[:, 0], -1), np.zeros_like(wheels)
        for i in range(wheels.shape[1]):
            state = np.where(said[:, i] != 0, said[:, i], state)
            out[:, i] = wheels[:, i] * (state > 0)
        return out


@dataclass
class CommandTimeout(Cause):
    """A countdown that every new command of either wheel sets back; the wheels turn while it runs: looked at in small steps."""

    timeout_s: float

    def wheels(self, wheels: np.ndarray, moment: Moment) -> np.ndarray:
        out, small_s = np.empty_like(wheels), moment.step_s / FINE
        left_s = np.full(len(wheels), self.timeout_s)
        for i in range(wheels.shape[1]):
            if i:
                left_s[(np.abs(wheels[:, i] - wheels[:, i - 1]) > 1e-9).any(axis=1)] = self.timeout_s  # not by rounding
            runs = np.zeros(len(wheels))
            for _ in range(FINE):
                runs += (left_s > small_s / 2) / FINE
                left_s -= small_s
            out[:, i] = wheels[:, i] * runs[:, None]
        return out


@dataclass
class OverloadTrip(Cause):
    """A driver whose fault latches when the command it gets jumps too far, and clears by a timer: looked at in small steps."""

    step_m_s: float
    off_s: float

    def jumps(self, wheels: np.ndarray) -> np.ndarray:
        """How far each driver's commands jump at the beginning of every step, (trials, steps, 2)."""
        return np.abs(np.diff(wheels, axis=1, prepend=0.0))

    def wheels(self, wheels: np.ndarray, moment: Moment) -> np.ndarray:
        faults, small_s = self.jumps(wheels) > self.step_m_s, moment.step_s / FINE
        clears_s, out = np.zeros((len(wheels), 2)), np.empty_like(wheels)
        for i in range(wheels.shape[1]):
            clears_s = np.where(faults[:, i], self.off_s, clears_s)
            turns = np.zeros_like(clears_s)
            for _ in range(FINE):
                turns += clears_s < small_s / 2
                clears_s = clears_s - small_s
            out[:, i] = wheels[:, i] * turns / FINE
        return out


@dataclass
class SupplyTrip(OverloadTrip):
    """One fault for both drivers, by the sum of the jumps."""

    def jumps(self, wheels: np.ndarray) -> np.ndarray:
        return np.broadcast_to(super().jumps(wheels).sum(axis=-1, keepdims=True), wheels.shape)


@dataclass
class ReverseGain(Cause):
    """Half the sum of a speed and its size is what is forwards of it, the rest is backwards."""

    gain: float

    def command(self, wheels: np.ndarray) -> np.ndarray:
        forwards = (wheels + np.abs(wheels)) / 2
        return forwards + self.gain * (wheels - forwards)


@dataclass
class DeadZoneMismatch(Cause):
    """Each wheel loses what it is held back by: the two losses have this mean."""

    width_m_s: float
    left_share: float

    def command(self, wheels: np.ndarray) -> np.ndarray:
        left = self.left_share * self.width_m_s
        held = np.array([left, 2 * self.width_m_s - left])
        return wheels - np.clip(wheels, -held, held)


@dataclass
class SpeedLimitMismatch(Cause):
    """The wheel with the lower limit has this one."""

    max_m_s: float
    left_spare: float

    def command(self, wheels: np.ndarray) -> np.ndarray:
        with np.errstate(divide="ignore"):
            other = self.max_m_s / np.float64(1 - abs(self.left_spare))
        limits = np.array([other, self.max_m_s] if self.left_spare > 0 else [self.max_m_s, other])
        return np.sign(wheels) * np.minimum(np.abs(wheels), limits)


@dataclass
class CommandRate(Cause):
    """A command waits for the next tick of a clock that starts with the trial."""

    period_s: float

    def edges(self, edges_s: np.ndarray) -> np.ndarray:
        return np.ceil(edges_s / self.period_s - 1e-6) * self.period_s


@dataclass
class WarmUp(Cause):
    """Slow at the beginning of each trial."""

    loss: float
    time_s: float

    def demand(self, wheels: np.ndarray, moment: Moment) -> np.ndarray:
        return wheels * (1 - self.loss * np.exp(-np.maximum(moment.trial_s, 0.0) / self.time_s))[:, None]


@dataclass
class Stribeck(Cause):
    """Friction that fades as a wheel turns faster."""

    width_m_s: float
    fade_m_s: float

    def command(self, wheels: np.ndarray) -> np.ndarray:
        size = np.abs(wheels)
        braked = np.clip(size - self.width_m_s / np.exp(size / self.fade_m_s), 0.0, None)
        return np.copysign(braked, wheels)


@dataclass
class Heating(Cause):
    """Each motor's warmth: metres driven, forgotten with time, through the whole session."""

    loss_per_m: float
    cool_s: float

    def wheels(self, wheels: np.ndarray, moment: Moment) -> np.ndarray:
        decay = np.exp(-moment.step_s / self.cool_s)
        out, warm, left_at = np.empty_like(wheels), np.zeros(2), None
        for trial in np.argsort(moment.session_s[:, 0], kind="stable"):
            begin = moment.session_s[trial, 0] + moment.trial_s[0]
            if left_at is not None:
                warm = warm * np.exp(-(begin - left_at) / self.cool_s)
            gained = np.abs(wheels[trial]) * moment.step_s
            heat, _ = lfilter([1.0], [1.0, -decay], gained, axis=0, zi=(decay * warm)[None])
            out[trial] = wheels[trial] * np.maximum(1 - self.loss_per_m * heat, 0.0)
            # after its last command the robot only cools: what is left then may be reckoned back to the next trial's begin
            warm, left_at = heat[-1], moment.session_s[trial, 0] + moment.trial_s[-1]
        return out


@dataclass
class WheelEccentricity(Cause):
    """The wheels' axles are not in their middles; each trial begins somewhere in a turn."""

    left_share: float
    right_share: float
    turn_m: float

    def wheels(self, wheels: np.ndarray, moment: Moment) -> np.ndarray:
        begun = moment.rng.uniform(0, 1, (len(wheels), 1, 2))
        turns = begun + np.cumsum(wheels, axis=1) * (moment.step_s / self.turn_m)
        return wheels * (1 + np.array([self.left_share, self.right_share]) * np.cos(2 * np.pi * turns))


@dataclass
class Backlash(Cause):
    """A wheel that reverses has to take up a gap before it drives."""

    gap_m: float

    @property
    def first_m(self) -> float:
        """How much of it lies behind when a trial begins."""
        return self.gap_m

    def wheels(self, wheels: np.ndarray, moment: Moment) -> np.ndarray:
        out = np.zeros_like(wheels)
        tooth = np.full_like(wheels[:, 0], self.first_m)  # where in the gap the motor's tooth is: 0 or gap_m drives
        for i in range(wheels.shape[1]):
            motor = tooth + wheels[:, i] * moment.step_s
            tooth = np.clip(motor, 0.0, self.gap_m)
            out[:, i] = (motor - tooth) / moment.step_s
        return out


@dataclass
class BacklashStart(Backlash):
    """The same, begun elsewhere in the gap."""

    crossed_share: float

    @property
    def first_m(self) -> float:
        return self.crossed_share * self.gap_m


@dataclass
class BacklashMismatch(Cause):
    """The same with a gap of its own on each side, of which the mean is given."""

    gap_m: float
    crossed_share: float
    left_share: float

    def wheels(self, wheels: np.ndarray, moment: Moment) -> np.ndarray:
        left = self.gap_m * self.left_share
        gaps = left, 2 * self.gap_m - left
        sides = [BacklashStart(gap, self.crossed_share).wheels(wheels[..., i : i + 1], moment) for i, gap in enumerate(gaps)]
        return np.concatenate(sides, axis=-1)
