"""Listed effects of loads on gripping wheels, written a second time: from forces in small steps, not from closed forms."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numba import njit

from tests.hidden_effects.cause import Body, Cause, Moment

BASE_M = 0.0884
FINE = 40
"""Of the robot (Khepera III), and parts of a step in which forces are integrated."""


def _in_small_steps(wheels: np.ndarray, moment: Moment, push, limits) -> np.ndarray:
    """Mean speeds of two wheels of one body that forces change: ``push(gap)`` (n, 2), ``limits`` of mean and half difference."""
    out, now = np.empty_like(wheels), np.zeros_like(wheels[:, 0])
    small_s = moment.step_s / FINE
    for i in range(wheels.shape[1]):
        way = np.zeros_like(now)
        for _ in range(FINE):
            force = push(wheels[:, i] - now)
            straight, spin = force.mean(axis=1) * limits[0], (force[:, 1] - force[:, 0]) / 2 * limits[1]
            after = now + np.stack([straight - spin, straight + spin], axis=1) * small_s
            way += (now + after) / 2 * small_s
            now = after
        out[:, i] = way / moment.step_s
    return out


@dataclass
class ForceLimit(Cause):
    """Stiff controllers of motors with limited force, on one body with mass and inertia."""

    max_m_s2: float
    turn_ratio: float

    def wheels(self, wheels: np.ndarray, moment: Moment) -> np.ndarray:
        near = self.max_m_s2 * moment.step_s / FINE
        limits = self.max_m_s2, self.max_m_s2 * self.turn_ratio
        return _in_small_steps(wheels, moment, lambda gap: np.clip(gap / near, -1.0, 1.0), limits)


@dataclass
class TractionLimit(Cause):
    """A body on two tyres that push it with what their slip calls for, up to the friction of each."""

    max_m_s2: float
    turn_ratio: float
    stiff_s = 1e-3

    def wheels(self, wheels: np.ndarray, moment: Moment) -> np.ndarray:
        near, limits = self.max_m_s2 * self.stiff_s, (self.max_m_s2, self.max_m_s2 * self.turn_ratio)
        return _in_small_steps(wheels, moment, lambda gap: np.clip(gap / near, -1.0, 1.0), limits)


@dataclass
class MassOffset(Cause):
    """A body whose centre of mass lies off the axle, between stiff springs of speed: forces in small parts of a step."""

    lead_m_s: float
    stiff_s = 2e-3

    def body(self, body: Body, moment: Moment) -> Body:
        small_s = moment.step_s / FINE
        ahead, against = self.lead_m_s / self.stiff_s, 4 * self.lead_m_s / BASE_M**2 / self.stiff_s
        v, w = np.zeros_like(body.forward[:, 0]), np.zeros_like(body.turn[:, 0])
        forward, turn = np.empty_like(body.forward), np.empty_like(body.turn)
        for i in range(forward.shape[1]):
            way = angle = 0.0
            for _ in range(FINE):
                pull = (body.forward[:, i] - v) / self.stiff_s + ahead * w**2
                twist = (body.turn[:, i] - w) / self.stiff_s - against * v * w
                v, w = v + pull * small_s, w + twist * small_s
                way, angle = way + v * small_s, angle + w * small_s
            forward[:, i], turn[:, i] = way / moment.step_s, angle / moment.step_s
        return body._replace(forward=forward, turn=turn)


@dataclass
class VelocityRamp(Cause):
    """A drive that approaches commanded velocity and turn rate in small parts of a step, none larger than its limits allow."""

    forward_m_s2: float
    turn_rad_s2: float

    def wheels(self, wheels: np.ndarray, moment: Moment) -> np.ndarray:
        told = np.stack([wheels.sum(axis=2) / 2, (wheels[..., 1] - wheels[..., 0]) / BASE_M])
        most = np.array([self.forward_m_s2, self.turn_rad_s2])[:, None] * moment.step_s / FINE
        out, now = np.empty_like(told), np.zeros_like(told[..., 0])
        for i in range(told.shape[2]):
            summed = np.zeros_like(now)
            for _ in range(FINE):
                then = np.minimum(np.maximum(told[..., i], now - most), now + most)
                summed, now = summed + (now + then) / 2, then
            out[..., i] = summed / FINE
        return np.stack([out[0] - out[1] * BASE_M / 2, out[0] + out[1] * BASE_M / 2], axis=2)


@dataclass
class InertiaLag(Cause):
    """Forces in proportion to what each wheel lacks, on one body with mass and inertia."""

    tau_s: float
    turn_ratio: float

    def wheels(self, wheels: np.ndarray, moment: Moment) -> np.ndarray:
        return _in_small_steps(wheels, moment, lambda gap: gap, (1 / self.tau_s, 1 / self.tau_s / self.turn_ratio))


@dataclass
class GearFriction(Cause):
    """Motors with a torque constant and a resistance on one body; dry friction takes what momentum it can from each in turn."""

    tau_s: float
    turn_ratio: float
    friction_m_s: float
    loss_m_s: float
    constant = 0.02
    resistance = 5.0

    def wheels(self, wheels: np.ndarray, moment: Moment) -> np.ndarray:
        back = self.constant**2 / self.resistance  # force for each unit of speed that the voltage drives a wheel faster
        own, shared = (self.tau_s * back * (1 + sign * self.turn_ratio) / 2 for sign in (1, -1))
        inverse = np.linalg.inv([[own, shared], [shared, own]])
        small_s = moment.step_s / FINE
        volts = self.constant * (wheels + np.sign(wheels) * (self.friction_m_s - self.loss_m_s))
        return _braked(volts, inverse, self.constant, self.resistance, self.friction_m_s * back * small_s, small_s)


@njit
def _braked(volts, inverse, constant, resistance, most, small_s):
    """Impulses of friction, one wheel after the other until they agree, in each small step."""
    out, free, braked = np.empty_like(volts), np.zeros(2), np.zeros(2)
    for trial in range(volts.shape[0]):
        now = np.zeros(2)
        for i in range(volts.shape[1]):
            way = np.zeros(2)
            for _ in range(FINE):
                force = constant * (volts[trial, i] - constant * now) / resistance * small_s
                braked[:] = 0.0
                for one in range(2):
                    free[one] = now[one] + force[0] * inverse[0, one] + force[1] * inverse[1, one]
                for _ in range(4):
                    for one in range(2):
                        others = free[one] + braked[1 - one] * inverse[one, 1 - one]
                        braked[one] = min(max(-others / inverse[one, one], -most), most)
                for one in range(2):
                    after = free[one] + braked[0] * inverse[0, one] + braked[1] * inverse[1, one]
                    way[one] += (now[one] + after) / 2 * small_s
                    now[one] = after
            out[trial, i] = way / (small_s * FINE)
    return out


@dataclass
class ScrubFriction(Cause):
    """Motors that push in proportion to what a motion lacks; the floor takes what it can from the turn in each small step."""

    tau_s: float
    turn_ratio: float
    width_rad_s: float

    def body(self, body: Body, moment: Moment) -> Body:
        small_s = moment.step_s / FINE
        turn = _pushed(body.turn, small_s / self.tau_s / self.turn_ratio, self.width_rad_s)
        return body._replace(forward=_pushed(body.forward, small_s / self.tau_s, 0.0), turn=turn)


@njit
def _pushed(told, share, friction):
    """Mean in each step of a speed that goes a share of the way in each small one, less friction, which only brakes."""
    out = np.empty_like(told)
    for trial in range(told.shape[0]):
        now = 0.0
        for i in range(told.shape[1]):
            way = 0.0
            for _ in range(FINE):
                free = now + share * (told[trial, i] - now)
                after = np.sign(free) * max(abs(free) - share * friction, 0.0)
                way += (now + after) / 2
                now = after
            out[trial, i] = way / FINE
    return out


@dataclass
class SlidingContact(Cause):
    """Stiff controllers force each wheel of a body with mass and inertia; one of its points rubs on the floor, within a disc."""

    friction_m_s: float
    distance_share: float
    left_share: float
    gain = 2.0
    tau_s = 0.002
    turn_ratio = 0.5

    def wheels(self, wheels: np.ndarray, moment: Moment) -> np.ndarray:
        mass = 2 * self.gain * self.tau_s
        inertia = self.turn_ratio * mass * BASE_M**2 / 4
        force = 2 * self.gain * self.friction_m_s
        place = self.distance_share * BASE_M, self.left_share * BASE_M
        return _rubbing(wheels, mass, inertia, self.gain, force, place, moment.step_s / FINE)


@njit
def _rubbing(told, mass, inertia, gain, most, place, small_s):
    """In each small step the impulse of friction, within its disc, that leaves the least energy of the sliding point's motion."""
    out = np.empty_like(told)
    behind, aside = place
    gentle = 1 / (1 / mass + (behind**2 + aside**2) / inertia)
    for trial in range(told.shape[0]):
        v, turn = 0.0, 0.0
        for i in range(told.shape[1]):
            way_v, way_turn = 0.0, 0.0
            for _ in range(FINE):
                left = gain * (told[trial, i, 0] - v + turn * BASE_M / 2) * small_s
                right = gain * (told[trial, i, 1] - v - turn * BASE_M / 2) * small_s
                free_v, free_turn = v + (left + right) / mass, turn + (right - left) * BASE_M / 2 / inertia
                push, across = 0.0, 0.0
                after_v, after_turn = free_v, free_turn
                for _ in range(60):
                    before_v, before_turn = after_v, after_turn
                    push -= gentle * (after_v - aside * after_turn)
                    across -= gentle * (-behind * after_turn)
                    over = np.hypot(push, across) / (most * small_s)
                    if over > 1.0:
                        push, across = push / over, across / over
                    after_v, after_turn = free_v + push / mass, free_turn - (aside * push + behind * across) / inertia
                    if abs(after_v - before_v) + BASE_M * abs(after_turn - before_turn) < 1e-12:
                        break
                way_v, way_turn = way_v + (v + after_v) / 2, way_turn + (turn + after_turn) / 2
                v, turn = after_v, after_turn
            out[trial, i, 0] = (way_v - way_turn * BASE_M / 2) / FINE
            out[trial, i, 1] = (way_v + way_turn * BASE_M / 2) / FINE
    return out


@dataclass
class ControllerOvershoot(Cause):
    """A controller with a proportional and an integral part on each wheel of one body, whose motors also brake by themselves."""

    tau_s: float
    lead_s: float
    swing_s: float
    turn_ratio: float = 1.0

    def wheels(self, wheels: np.ndarray, moment: Moment) -> np.ndarray:
        proportional, integral, slow_s = self.lead_s / self.tau_s, 1 / self.tau_s, self.swing_s**2 / self.tau_s
        out, small_s = np.empty_like(wheels), moment.step_s / FINE
        now, summed = np.zeros_like(wheels[:, 0]), np.zeros_like(wheels[:, 0])
        for i in range(wheels.shape[1]):
            way = np.zeros_like(now)
            for _ in range(FINE):
                force = (proportional * (wheels[:, i] - now) + integral * summed - now) / slow_s
                straight, spin = force.mean(axis=1), (force[:, 1] - force[:, 0]) / 2 / self.turn_ratio
                after = now + np.stack([straight - spin, straight + spin], axis=1) * small_s
                summed = summed + (wheels[:, i] - (now + after) / 2) * small_s
                way += (now + after) / 2 * small_s
                now = after
            out[:, i] = way / moment.step_s
        return out


class Pulled(Cause):
    """A force in the plane on the robot of these worlds: each wheel slips backwards by its own load; none slips sideways."""

    depends_on_pose = True
    ahead_m = 0.0
    at_rest = 0.0

    def force(self, x: np.ndarray, y: np.ndarray, heading: np.ndarray) -> np.ndarray:
        """As the velocity to which it drives free wheels: a complex number, east and north."""
        raise NotImplementedError

    def place(self, body: Body, x: np.ndarray, y: np.ndarray, heading: np.ndarray) -> Body:
        along = self.force(x, y, heading) * np.exp(-1j * heading)
        along = np.where(body.moving > 0, along, self.at_rest * along)
        torque = 2 * along.imag * self.ahead_m  # the force on both wheels is twice that on one
        left, right = along.real - torque / BASE_M, along.real + torque / BASE_M
        return body._replace(forward=body.forward + (left + right) / 2, turn=body.turn + (right - left) / BASE_M)


@dataclass
class SlopeLoad(Pulled):
    """Gravity down a slope."""

    x_m_s: float
    y_m_s: float
    behind_share: float
    at_rest: float

    def __post_init__(self) -> None:
        self.ahead_m = -self.behind_share * BASE_M

    def force(self, x: np.ndarray, y: np.ndarray, heading: np.ndarray) -> np.ndarray:
        return np.full(np.shape(x), self.x_m_s + 1j * self.y_m_s)


@dataclass
class TetherLoad(Pulled):
    """A spring from an anchor to a point of the robot."""

    pull_per_s: float
    anchor_x_m: float
    anchor_y_m: float
    free_m: float
    ahead_share: float
    at_rest: float

    def __post_init__(self) -> None:
        self.ahead_m = self.ahead_share * BASE_M

    def force(self, x: np.ndarray, y: np.ndarray, heading: np.ndarray) -> np.ndarray:
        gap = self.anchor_x_m + 1j * self.anchor_y_m - (x + 1j * y + self.ahead_m * np.exp(1j * heading))
        return self.pull_per_s * gap * np.maximum(1 - self.free_m / np.abs(gap), 0.0)
