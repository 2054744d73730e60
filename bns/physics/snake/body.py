"""The snake's body in motion: laid out, driven cycle by cycle, seen from above."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from bns.extras import extra
from bns.physics.snake.gait import cycle_angles
from bns.physics.snake.model import GREEN, YELLOW, build_model
from bns.physics.snake.parameters import SnakeParameters
from bns.physics.snake.stability import BLEW_UP, TIPPED, Watch, mean_roll_rad

with extra("snake"):
    import mujoco

LOOK_EVERY = 5
"""Integration steps between two looks at stability."""
OnStep = Callable[[mujoco.MjModel, mujoco.MjData], None]


@dataclass(frozen=True)
class Driven:
    """One cycle as it went: markers (2, 2) [yellow, green][x, y], m, before and after; causes of instability; duration;
    whether the robot was on its side or back at any moment, and whether it lies so at the end."""

    before_m: np.ndarray
    after_m: np.ndarray
    causes: tuple[str, ...]
    duration_s: float
    tipped: bool
    lies: bool


class Body:
    """One robot on the floor. Nothing is drawn here: spreads come in as factors from the caller."""

    def __init__(self, parameters: SnakeParameters) -> None:
        self.parameters = parameters
        self.model = build_model(parameters)
        self.data = mujoco.MjData(self.model)
        self.sites = [self.model.site(name).id for name in (YELLOW, GREEN)]
        self._angles = np.zeros(parameters.joints)
        self._waiting: list[np.ndarray] = []
        self._heavy = self.model.body(f"link{parameters.heavy_link}").id

    def lay_straight(self, middle_m: ArrayLike = (0.0, 0.0), heading_rad: float = 0.0) -> None:
        """Put the robot down at rest, straight, the middle between its markers at ``middle_m``, yellow to green along heading."""
        p = self.parameters
        mujoco.mj_resetData(self.model, self.data)
        along = np.array([np.cos(heading_rad), np.sin(heading_rad)])
        self.data.qpos[:2] = np.asarray(middle_m) - along * p.length_m / 2
        self.data.qpos[2] = p.radius_m
        self.data.qpos[3:7] = [np.cos(heading_rad / 2), 0.0, 0.0, np.sin(heading_rad / 2)]
        self._angles = np.zeros(p.joints)
        self._waiting = [self._angles] * max(1, round(p.delay_s / p.dt_s))
        mujoco.mj_forward(self.model, self.data)

    def markers_m(self) -> np.ndarray:
        """Where a camera above sees the markers: (2, 2), yellow and green, x and y."""
        return self.data.site_xpos[self.sites, :2].copy()

    def set_friction(self, factor: ArrayLike) -> None:
        """Floor friction as a multiple of the parameter's: one for all links, or one each (links,)."""
        self.model.geom_friction[1:, 0] = self.parameters.floor_friction * np.asarray(factor, np.float64)

    def set_tilt(self, towards_x_rad: float, towards_y_rad: float) -> None:
        """Let the floor fall by these angles along x and y; small ones."""
        down = self.model.opt.gravity[2]
        self.model.opt.gravity[:2] = -down * np.array([towards_x_rad, towards_y_rad])

    def roll_rad(self) -> float:
        """Mean roll of the links: 0 upright, ±π on the back."""
        return mean_roll_rad(self.data.xmat[1:].reshape(-1, 3, 3))

    def drive_cycle(self, cycle: ArrayLike, on_step: OnStep | None = None) -> Driven:
        """Take up the first posture of a cycle (4,), then go through it; ModelError for a cycle that is none.

        The way to the first posture belongs to the change between cycles: it counts for stability, but not for the
        displacement, which runs from the first posture to the last.
        """
        angles = cycle_angles(cycle, self.parameters.joints, self._switched())
        watch, began_s = Watch(self.parameters, self.model), self.data.time
        self._go_to(angles[0], watch, on_step)
        before = self.markers_m()
        for target in angles[1:]:
            self._go_to(target, watch, on_step)
        return self._driven(before, watch, self.data.time - began_s)

    def _driven(self, before_m: np.ndarray, watch: Watch, duration_s: float) -> Driven:
        lies, tipped = abs(self.roll_rad()) > self.parameters.tipped_rad, TIPPED in watch.seen
        if tipped and not lies and not self.parameters.tipped_on_the_way_fails:
            watch.seen.remove(TIPPED)
        return Driven(before_m, self.markers_m(), watch.causes, duration_s, tipped, lies)

    def _switched(self) -> bool:
        """Whether the joints' roles are exchanged: those that are lateral on an upright robot lift one that lies on its side."""
        return bool(self.parameters.roles_switch_on_side) and abs(np.sin(self.roll_rad())) > np.sqrt(0.5)

    def _go_to(self, target: np.ndarray, watch: Watch, on_step: OnStep | None) -> None:
        """Move every servo at the constant speed until all are there, and wait for the slowest to settle."""
        p = self.parameters
        if p.resolution_rad:
            target = np.round(target / p.resolution_rad) * p.resolution_rad
        way = target - self._angles
        steps = int(np.ceil((np.abs(way).max() / p.joint_speed_rad_s + p.settle_s) / p.dt_s))
        furthest = p.joint_speed_rad_s * p.dt_s
        start = self._angles
        for step in range(1, steps + 1):
            self._angles = start + np.clip(way, -furthest * step, furthest * step)
            self.step(self._angles)
            if step % LOOK_EVERY == 0:
                watch.look(self.data, LOOK_EVERY * p.dt_s)
                if BLEW_UP in watch.seen:
                    return
            if on_step is not None:
                on_step(self.model, self.data)

    def step(self, angles: np.ndarray) -> None:
        """One step of time with these set points of the servos (joints,), rad."""
        self._waiting.append(angles)
        wanted, there = self._waiting.pop(0), self.data.qpos[7:]
        within = np.abs(wanted - there) < self.parameters.dead_band_rad
        self.data.ctrl[:] = np.where(within, there, wanted)
        self._drag_tether()
        mujoco.mj_step(self.model, self.data)

    def _drag_tether(self) -> None:
        """The tether pulls against the motion of its end; below a creeping speed in proportion to it."""
        velocity = self.data.cvel[self._heavy, 3:5]
        pull = self.parameters.tether_drag_n / max(float(np.hypot(*velocity)), 0.02)
        self.data.xfrc_applied[self._heavy, :2] = -pull * velocity
