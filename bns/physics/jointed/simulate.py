"""Many stretches of many trials simulated side by side: MuJoCo's own threads, one step of all at a time.

What a servo does within a step (dead band, delay, limits, sag) is worked out for all rows at once between two steps.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, fields
from typing import Any

import numpy as np
from numpy.typing import NDArray

from bns.extras import deferred
from bns.physics.jointed.drives import Drive, told_speed_rad_s
from bns.physics.jointed.mechanism import Machine
from bns.physics.jointed.plant import Array, Plant, Sighting

mujoco = deferred("snake", "mujoco")
rollout = deferred("snake", "mujoco.rollout")

SETTLE_S = 0.4
"""How long a body that was put down is left to come to rest."""
_CLEAR_M = 5e-4
"""How far above the floor it is put down."""
_CREEP_M_S = 0.02
"""Below it the tether's drag fades."""
_BOX_STEPS = 5
"""How often it is noted where links are: in so many steps they move by less than a link's radius."""


@dataclass(frozen=True)
class Rest:
    """Where drives begin: states (drives, n) of bodies at rest, and how far each is turned and moved into the world's frame.

    ``turn_rad`` (drives,), ``origin_m`` and ``begin_m`` (drives, 2): a point p of the simulation is at
    begin + R(turn) (p - origin) in the world.
    """

    state: Array
    turn_rad: Array
    origin_m: Array
    begin_m: Array

    def only(self, chosen: NDArray[np.int64]) -> Rest:
        """Some of the drives."""
        return Rest(self.state[chosen], self.turn_rad[chosen], self.origin_m[chosen], self.begin_m[chosen])


class Simulator:
    """Drives of one mechanism. Rows are simulated longest first, so that those that go on stand together.

    ``told_rad_s``: the fastest that servos are told to move; where neither it nor the mechanism's is given, in these drives.
    """

    def __init__(
        self, machine: Machine, drives: Sequence[Drive], threads: int, told_rad_s: float | None = None
    ) -> None:
        self.machine, self._threads = machine, threads
        self.drives = tuple(drives)
        self._lasts = np.array([int(d.frames[-1]) for d in drives])
        self._order = np.argsort(-self._lasts, kind="stable")
        self._dt_s = float(machine.model.opt.timestep)
        known = machine.mechanism.fastest_set_point_rad_s or machine.mechanism.joint_speed_rad_s or told_rad_s
        self.told_rad_s = told_speed_rad_s(drives, self._dt_s) if known is None else known
        """What the speed limit of a servo is a share of."""
        self.counts = np.array([len(d.frames) for d in drives])
        self.simulated = 0
        """Rows simulated so far."""
        self.box_m = np.tile([np.inf, np.inf, -np.inf, -np.inf], (len(self.drives), 1))
        """Where the links of each drive have been on a level floor, (drives, 4): least x and y, largest x and y."""

    def only(self, chosen: NDArray[np.int64]) -> Simulator:
        """Some of the drives, by servos as fast as those of all."""
        return Simulator(self.machine, [self.drives[i] for i in chosen], self._threads, self.told_rad_s)

    def at_rest(self) -> Rest:
        """Every body come to rest in the first posture of its drive; then driven once for where it is first seen."""
        settled = self.settled(self.machine.plant)
        rest = self._unmoved(settled)
        begin = np.array([d.begin for d in self.drives])
        if not self.machine.free:
            return rest
        first = Simulator(
            self.machine, [Drive(d.set_points, d.frames[:1], d.begin) for d in self.drives], self._threads
        )
        seen = first.sightings(self.machine.plant, rest).point_m
        middle, heading = _poses(seen)
        return Rest(settled, begin[:, 2] - heading, middle, begin[:, :2])

    def settled(self, plant: Plant) -> Array:
        """States (drives, n) of every body put down in the first posture of its drive and come to rest.

        A joint is put down as near its set point as its servo brings it against its own friction: one that gives no torque has
        not moved there.
        """
        hold = round(SETTLE_S / self._dt_s)
        held = [Drive(np.repeat(d.set_points[:1], hold, axis=0), np.array([hold]), d.begin) for d in self.drives]
        _, settled = Simulator(self.machine, held, self._threads)._stepped(plant, self._unmoved(self._put_down(plant)))
        return settled

    def _unmoved(self, state: Array) -> Rest:
        return Rest(state, np.zeros(len(state)), np.zeros((len(state), 2)), np.zeros((len(state), 2)))

    def sightings(self, plant: Plant, rest: Rest) -> Sighting:
        """What is seen in every frame of every drive, one after the other; (frames, sites, 2) each."""
        sensed, _ = self._stepped(plant, rest)
        sites = len(self.machine.mechanism.sites)
        of_sites = sensed[:, : 9 * sites].reshape(-1, sites, 3, 3)[..., :2]
        which = np.repeat(np.arange(len(self.drives)), self.counts)
        cos, sin = np.cos(rest.turn_rad[which])[:, None, None], np.sin(rest.turn_rad[which])[:, None, None]
        moved = of_sites.copy()
        moved[:, :, 0] -= rest.origin_m[which][:, None]
        x, y = moved[..., 0].copy(), moved[..., 1].copy()
        moved[..., 0], moved[..., 1] = cos * x - sin * y, sin * x + cos * y
        moved[:, :, 0] += rest.begin_m[which][:, None]
        return Sighting(moved[:, :, 0], moved[:, :, 1], moved[:, :, 2])

    def _put_down(self, plant: Plant) -> Array:
        """States with every joint as near its first set point as its servo brings it; the lowest geom just above the floor."""
        m, short = self.machine, self._short_rad(plant)
        data, model = mujoco.MjData(m.model), m.model
        rows = np.zeros((len(self.drives), mujoco.mj_stateSize(model, mujoco.mjtState.mjSTATE_FULLPHYSICS)))
        for row, drive in zip(rows, self.drives, strict=True):
            qpos = model.qpos0.copy()
            way = drive.set_points[0] - qpos[m.joint_at]
            qpos[m.joint_at] += np.sign(way) * np.maximum(np.abs(way) - short, 0.0)
            if m.free:
                data.qpos[:] = qpos
                mujoco.mj_kinematics(model, data)
                qpos[2] -= _lowest_m(model, data) - _CLEAR_M
            row[1 : 1 + model.nq] = qpos
        return rows

    def _short_rad(self, plant: Plant) -> Array:
        """How far short of its set point friction stops each joint, (joints,), beyond where it stops one with a sound servo."""
        m, strength = self.machine, np.clip(np.minimum(plant.stiffness, plant.torque), 0.0, 1.0)
        sound, held = (m.friction_n_m(p) / m.stiffness_n_m_rad for p in (m.plant, plant))
        short: Array = np.full(len(strength), np.inf)
        moves = strength > 0
        short[moves] = np.maximum(held[moves] / strength[moves] - sound[moves], 0.0)
        return short

    def _stepped(self, plant: Plant, rest: Rest) -> tuple[Array, Array]:
        """Sensors in every frame (frames, n), and the states at the ends of the drives (drives, n)."""
        machine, model = self.machine, self.machine.changed(plant)
        order, lasts = self._order, self._lasts[self._order]
        self.simulated += len(order)
        state = np.ascontiguousarray(rest.state[order])
        servos = _Servos(machine, plant, [self.drives[i].set_points for i in order], self._dt_s, self.told_rad_s)
        floor = _Outside(machine, plant, rest.only(order))
        spec = mujoco.mjtState.mjSTATE_CTRL.value | mujoco.mjtState.mjSTATE_XFRC_APPLIED.value
        control = np.zeros((len(order), 1, mujoco.mj_stateSize(model, spec)))
        warm, sensed = np.zeros((len(order), model.nv)), np.zeros((len(order), model.nsensordata))
        stepped, felt = np.zeros((len(order), 1, state.shape[1])), np.zeros((len(order), 1, model.nsensordata))
        seen = [np.empty((0, model.nsensordata))] * len(order)
        wanted_frames = [{int(f) for f in self.drives[i].frames} for i in order]
        speeds = slice(1 + model.nq, 1 + model.nq + model.nv)
        kept: list[list[Array]] = [[] for _ in order]
        datas = [mujoco.MjData(model) for _ in range(self._threads)]
        floors = _Floors(machine, plant, model, floor)
        box_m = self.box_m[order]
        with rollout.Rollout(nthread=self._threads) as threads:
            for step in range(int(lasts[0]) + 1):
                n = int(np.searchsorted(-lasts, -step, side="right"))  # rows that last so many steps or longer
                q = state[:n, 1 + machine.joint_at]
                control[:n, 0, : model.nu] = servos.control(step, q)
                floor.push(control[:n, 0, model.nu :], sensed[:n])
                models = [model] * n if not plant.rough else floors.under(sensed[:n])
                after, now = threads.rollout(
                    models,
                    datas,
                    state[:n],
                    control[:n],
                    control_spec=spec,
                    nstep=1,
                    initial_warmstart=warm[:n],
                    state=stepped[:n],
                    sensordata=felt[:n],
                    skip_checks=True,  # where every row has a model of its own they cost seven times as much as the steps
                )
                warm[:n] = (after[:, 0, speeds] - state[:n, speeds]) / self._dt_s
                state[:n], sensed[:n] = after[:, 0], now[:, 0]
                if step % _BOX_STEPS == 0 and not plant.rough:
                    links = floors.links_m(sensed[:n])
                    box_m[:n, :2] = np.minimum(box_m[:n, :2], links.min(axis=1))
                    box_m[:n, 2:] = np.maximum(box_m[:n, 2:], links.max(axis=1))
                for row in range(n):
                    if step in wanted_frames[row]:  # what is sensed is where the step began
                        repeats = int((self.drives[order[row]].frames == step).sum())
                        kept[row] += [sensed[row].copy()] * repeats
        for row, frames in enumerate(kept):
            seen[row] = np.array(frames)
        back = np.argsort(order)
        self.box_m = box_m[back]
        return np.concatenate([seen[i] for i in back]), state[back]


def joined(rests: Sequence[Rest]) -> Rest:
    """Drives one after the other."""
    return Rest(*(np.concatenate([getattr(rest, f.name) for rest in rests]) for f in fields(Rest)))


def replace_state(rest: Rest, state: Array) -> Rest:
    """The same places with other states."""
    return Rest(state, rest.turn_rad, rest.origin_m, rest.begin_m)


class _Servos:
    """The position that each servo's actuator is given in each step, so that it pulls as the plant says."""

    def __init__(
        self, machine: Machine, plant: Plant, set_points: Sequence[Array], dt_s: float, told_rad_s: float
    ) -> None:
        p, m = plant, machine
        heard = [np.clip(told, *m.told.T) for told in set_points]
        self._wanted = _delayed(heard, max(0.0, (m.mechanism.delay_s + p.delay_s) / dt_s)) + p.zero_rad
        self._band = m.mechanism.dead_band_rad + p.dead_band_rad
        self._stiffness = p.stiffness
        self._furthest = m.torque_n_m * p.torque / m.stiffness_n_m_rad
        self._sag = p.sag
        self._inside = m.limits_inside
        self._reach = p.speed * told_rad_s * dt_s if (p.speed < 1).any() else None
        self._now = self._wanted[:, 0].copy()

    def control(self, step: int, q: Array) -> Array:
        """Positions (rows, joints) for the rows that go on, whose joints are at ``q``."""
        n = len(q)
        wanted = self._wanted[:n, min(step, self._wanted.shape[1] - 1)]
        if self._reach is not None:
            self._now[:n] += np.clip(wanted - self._now[:n], -self._reach, self._reach)
            wanted = self._now[:n]
        error = wanted - q
        error[np.abs(error) < self._band] = 0.0
        bounded = np.clip(self._stiffness * error, -self._furthest, self._furthest)
        if self._sag:
            load = np.abs(bounded / np.maximum(self._furthest, 1e-12)).mean(axis=1, keepdims=True)
            bounded = bounded * (1.0 - self._sag * load)
        if self._inside:  # the model itself has the plant's stiffness and torque
            bounded = error if not self._sag else bounded / np.maximum(self._stiffness, 1e-12)
        out: Array = q + bounded
        return out


def _delayed(set_points: Sequence[Array], steps: float) -> Array:
    """Set points (rows, steps, joints) so many steps later, each row padded with its last."""
    width = max(map(len, set_points))
    padded = np.stack([np.pad(s, ((0, width - len(s)), (0, 0)), mode="edge") for s in set_points])
    whole, part = int(np.floor(steps)), steps - np.floor(steps)
    at = np.maximum(np.arange(width) - whole, 0)
    out: Array = (1 - part) * padded[:, at] + part * padded[:, np.maximum(at - 1, 0)]
    return out


class _Outside:
    """Forces on bodies: slope and tether, in the frame of each row's simulation."""

    def __init__(self, machine: Machine, plant: Plant, rest: Rest) -> None:
        self._machine, self._plant, self._rest = machine, plant, rest
        self.rows = len(rest.turn_rad)
        self._cos, self._sin = np.cos(rest.turn_rad), np.sin(rest.turn_rad)
        weights = machine.masses_kg(plant) * -machine.model.opt.gravity[2]
        east, north = self._into(np.tile(plant.slope, (len(rest.turn_rad), 1)))
        self._down = np.zeros((len(rest.turn_rad), machine.model.nbody, 6))
        self._down[:, 1:, 0], self._down[:, 1:, 1] = east[:, None] * weights, north[:, None] * weights
        self._sites = len(machine.mechanism.sites)

    def push(self, forces: Array, sensed: Array) -> None:
        """Write the forces (rows, bodies * 6) of the next step, from what was sensed after the last."""
        n, p, tether = len(forces), self._plant, self._machine.tether
        applied = self._down[:n].copy()
        place, velocity = sensed[:, 9 * self._sites :][:, :2], sensed[:, 9 * self._sites + 3 :][:, :2]
        speed = np.maximum(np.hypot(*velocity.T), _CREEP_M_S)[:, None]
        pull = -(p.drag_n + self._machine.mechanism.tether_drag_n) * velocity / speed
        if p.return_n_m or any(p.pull_n):
            pull = pull + np.stack(self._into(np.array(p.pull_n) - p.return_n_m * self.world(place), n), axis=1)
        applied[:, tether, :2] += pull
        forces[:] = applied.reshape(n, -1)

    def _into(self, vectors: Array, n: int | None = None) -> tuple[Array, Array]:
        """World vectors (rows, 2) in the frames of the simulations."""
        cos, sin = self._cos[:n], self._sin[:n]
        return cos * vectors[:, 0] + sin * vectors[:, 1], cos * vectors[:, 1] - sin * vectors[:, 0]

    def world(self, place: Array) -> Array:
        """Where places (rows, ..., 2) of the simulations are in the world."""
        n, shape = len(place), (-1, *[1] * (place.ndim - 2), 2)
        off = place - self._rest.origin_m[:n].reshape(shape)
        cos, sin = (v[:n].reshape(shape[:-1]) for v in (self._cos, self._sin))
        turned = np.stack([cos * off[..., 0] - sin * off[..., 1], sin * off[..., 0] + cos * off[..., 1]], axis=-1)
        out: Array = turned + self._rest.begin_m[:n].reshape(shape)
        return out


class _Floors:
    """A floor that is rougher in one place than in another: the friction of every link goes by where it is.

    MuJoCo knows one friction for each pair of geoms, so every row has a model of its own, whose pairs are set in each step.
    """

    def __init__(self, machine: Machine, plant: Plant, model: Any, outside: _Outside) -> None:
        self._models = [model.__copy__() for _ in range(outside.rows if plant.rough else 0)]
        self._pairs = [m.pair_friction for m in self._models]
        self._usual, self._links = model.pair_friction.copy(), machine.pair_links
        self._rough, self._outside = plant.rough, outside
        self._from = 9 * len(machine.mechanism.sites) + 6

    def under(self, sensed: Array) -> list[Any]:
        """The models of these rows, from what was sensed after the last step."""
        n, there = len(sensed), self.links_m(sensed)
        factor = np.exp(sum(place.at(there) for place in self._rough))
        sliding = self._usual[:, :2] * factor[:, self._links - 1, None]
        for pairs, now in zip(self._pairs[:n], sliding, strict=True):
            pairs[:, :2] = now
        return self._models[:n]

    def links_m(self, sensed: Array) -> Array:
        """Where every link is in the world, (rows, links, 2)."""
        return self._outside.world(sensed[:, self._from :].reshape(len(sensed), -1, 3)[:, :, :2])


def _poses(points: Array) -> tuple[Array, Array]:
    """Middle (..., 2) of the tracked points (..., sites, 2) and the direction from the first to the last (...,)."""
    line = points[..., -1, :] - points[..., 0, :]
    return points.mean(axis=-2), np.arctan2(line[..., 1], line[..., 0])


def _lowest_m(model: Any, data: Any) -> float:
    """Height of the lowest point of all geoms that are not the world's, by the corners of their boxes."""
    low = np.inf
    for geom in range(model.ngeom):
        if model.geom_bodyid[geom] == 0 or not (model.geom_contype[geom] or model.geom_conaffinity[geom]):
            continue
        up = data.geom_xmat[geom].reshape(3, 3)[2]
        if model.geom_type[geom] == mujoco.mjtGeom.mjGEOM_CAPSULE:
            radius, half = model.geom_size[geom, :2]
            reach = abs(up[2]) * half + radius
        elif model.geom_type[geom] == mujoco.mjtGeom.mjGEOM_SPHERE:
            reach = model.geom_size[geom, 0]
        else:
            centre, half = model.geom_aabb[geom, :3], model.geom_aabb[geom, 3:]
            reach = float(np.abs(up) @ half) - float(up @ centre)
        low = min(low, float(data.geom_xpos[geom, 2] - reach))
    return low
