"""The body of an emulated snake: the MuJoCo model of the physics world, its joints turned by emulated servos.

They are as strong as that model's, whichever they are. An XL430 stalls at 1.5 N m, as an AX-12 does (their manuals, at 12 V); an
XM430 is stronger than its emulation.
"""

from __future__ import annotations

import threading
from collections.abc import Sequence

import numpy as np

from bns.hardware.emulators.devices.servo import Motion, Servo
from bns.hardware.servos.servo_table import ServoTable
from bns.physics.snake.body import LOOK_EVERY, Body
from bns.physics.snake.parameters import SnakeParameters
from bns.physics.snake.stability import Watch

_PATCH_S = 6.0
"""The floor's friction changes as often as in the physics world, whose cycles last about so long."""


class SnakeBody:
    """Moved on in time whenever somebody asks; what the servos are told holds from one question to the next.

    `servos` are given when they are made: each has a `Joint` of this body for its shaft.
    """

    def __init__(self, parameters: SnakeParameters, friction_seed: int) -> None:
        self.parameters, self._draw = parameters, np.random.default_rng([friction_seed, 31])
        self._body = Body(parameters)
        self.servos: Sequence[Servo] = ()
        self._strength = self._body.model.actuator_gainprm[:, 0].copy()
        self._lock = threading.Lock()
        self._now_s, self._steps = 0.0, 0
        self._steps_a_patch = round(_PATCH_S / parameters.dt_s)
        self.unstable: list[tuple[float, str]] = []
        """What a person who watches would call unstable: time and cause."""
        self.lay((0.0, 0.0), 0.0, 0.0)

    def lay(self, middle_m: Sequence[float], heading_rad: float, now_s: float) -> None:
        """Somebody lays it down straight: yellow to green along the heading."""
        with self._lock:
            self._body.lay_straight(middle_m, heading_rad)
            self._aims, self._now_s = np.zeros(self.parameters.joints), now_s
            self._watch = Watch(self.parameters, self._body.model)

    def joint(self, number: int) -> Joint:
        """The shaft of servo `number`, from 0."""
        return Joint(self, number)

    def markers(self, now_s: float) -> tuple[np.ndarray, np.ndarray]:
        """Where the yellow and the green ball are (2, 3), m, and how far up their links' tops point (2,), 1 upright."""
        with self._lock:
            self._advance(now_s)
            sites = self._body.sites
            data = self._body.data
            return data.site_xpos[sites].copy(), data.site_xmat[sites, 8].copy()

    def motion(self, number: int, now_s: float) -> Motion:
        """What a joint does."""
        with self._lock:
            self._advance(now_s)
            data, order, kind = self._body.data, self.servos[number].order(), self.servos[number].kind
            angle, speed = data.qpos[7 + number], data.qvel[6 + number]
            load = data.actuator_force[number] / self.parameters.torque_limit_n_m
            under_way = order.torque > 0 and abs(_angle(order.goal, kind) - self._aims[number]) > kind.rad_per_step
            steps, steps_s = kind.centre + angle / kind.rad_per_step, speed / kind.rad_per_step
            return Motion(steps, steps_s, float(load), under_way)

    def _advance(self, now_s: float) -> None:
        steps = int((now_s - self._now_s) / self.parameters.dt_s)
        if steps <= 0 or not self.servos:
            return
        orders = [servo.order() for servo in self.servos]
        torques = np.array([order.torque for order in orders])
        self._powered(torques)
        kinds = [servo.kind for servo in self.servos]
        goals = np.array([_angle(order.goal, kind) for order, kind in zip(orders, kinds, strict=True)])
        speeds_rad_s = np.array([order.speed * kind.rad_per_step for order, kind in zip(orders, kinds, strict=True)])
        furthest = speeds_rad_s * self.parameters.dt_s
        for _ in range(steps):
            there = self._body.data.qpos[7:]
            self._aims = np.where(torques > 0, self._aims + np.clip(goals - self._aims, -furthest, furthest), there)
            self._body.step(self._aims)
            self._steps += 1
            self._now_s += self.parameters.dt_s
            if self._steps % LOOK_EVERY == 0:
                self._judge()
            if self._steps % self._steps_a_patch == 0:
                self._next_patch()

    def _powered(self, torques: np.ndarray) -> None:
        """Without torque a joint is held by its gear's friction alone."""
        model, limit = self._body.model, self.parameters.torque_limit_n_m
        gain = np.where(torques > 0, self._strength, 0.0)
        model.actuator_gainprm[:, 0], model.actuator_biasprm[:, 1] = gain, -gain
        model.actuator_forcerange[:] = np.maximum(torques, 1e-6)[:, None] * limit * np.array([-1.0, 1.0])

    def _next_patch(self) -> None:
        p = self.parameters
        self._body.set_friction(float(np.clip(1.0 + p.friction_spread * self._draw.standard_normal(), 0.2, 3.0)))

    def _judge(self) -> None:
        self._watch.look(self._body.data, LOOK_EVERY * self.parameters.dt_s)
        if self._watch.seen:
            self.unstable += [(self._now_s, cause) for cause in self._watch.causes]
            self._watch.seen.clear()


class Joint:
    """Implements `bns.hardware.emulators.devices.servo.Shaft`."""

    def __init__(self, body: SnakeBody, number: int) -> None:
        self._body, self._number = body, number

    def motion(self, servo: Servo, now_s: float) -> Motion:
        """The whole body moves; this is what the joint makes of it."""
        return self._body.motion(self._number, now_s)


def _angle(steps: float, kind: ServoTable) -> float:
    return (steps - kind.centre) * kind.rad_per_step
