"""A second snake: balls for contacts, motors for servos, other steps and another integrator."""

from __future__ import annotations

from dataclasses import dataclass, field

import mujoco
import numpy as np

LINKS, PITCH_M, RADIUS_M = 13, 0.0877, 0.025
MASS_KG, BOARD_KG = 0.8, 0.2237
STIFFNESS, DAMPING, LIMIT, ARMATURE, GEAR_LOSS = 4.657, 0.243, 1.5, 0.002, 0.05
BAND_RAD, STEP_RAD, DELAY_S, SPEED, PAUSE_S = 0.00511, 0.00511, 0.02, 2.944, 0.05
FRICTION, DRAG_N, MARKERS_M = 0.25, 0.05, 0.65
DT_S = 0.0025
SPREAD, LINK_SPREAD, TILT_RAD, CAMERA_M = 0.10, 0.10, 0.008176, 0.002


@dataclass
class Hidden:
    """What this snake has and the model does not know; as it stands: nothing."""

    friction: float = 1.0
    link_friction: dict[int, float] = field(default_factory=dict)
    across: float = 1.0
    slope_rad: tuple[float, float] = (0.0, 0.0)
    pull_n: tuple[float, float] = (0.0, 0.0)
    pull_n_m: float = 0.0
    drag_n: float = 0.0
    speed: float = 1.0
    torque: float = 1.0
    band_rad: float = 0.0
    delay_s: float = 0.0
    stiffness: float = 1.0
    strength: dict[int, float] = field(default_factory=dict)
    zero_rad: dict[int, float] = field(default_factory=dict)
    gradient: float = 0.0
    load_kg: dict[int, float] = field(default_factory=dict)
    """On single links, at their middles."""
    friction_n_m: float = 0.0
    """Dry friction in every joint, beyond what it has."""
    friction_of_n_m: dict[int, float] = field(default_factory=dict)
    """The same in single joints."""
    gain: dict[int, float] = field(default_factory=dict)
    """Of single servos, which have all of their torque."""
    carried_kg: dict[str, float] = field(default_factory=dict)
    """At the markers."""
    sag: float = 0.0
    marker_m: dict[str, tuple[float, float]] = field(default_factory=dict)
    scale: float = 0.0
    tilt_1_m: tuple[float, float] = (0.0, 0.0)
    patch: tuple[float, float] | None = None
    """East of x = the first number the floor has so many times the friction."""
    pitch: float = 1.0
    """Links that are longer, as a factor."""
    tired_per_cycle: float = 0.0
    """Share of the stiffness that every cycle of a trial costs."""


def _xml(h: Hidden) -> str:
    share = 1.0 + h.gradient * np.linspace(-1, 1, LINKS)
    inner, pitch_m = "", PITCH_M * h.pitch
    for n in reversed(range(LINKS)):
        mass = (MASS_KG / LINKS + (BOARD_KG if n == 0 else 0.0)) * share[n] + h.load_kg.get(n, 0.0)
        half = pitch_m / 2
        across = mass * (3 * RADIUS_M**2 + (pitch_m * 0.8) ** 2) / 12
        inertia = f"{mass * RADIUS_M**2 / 2} {across} {across}"
        balls = "".join(
            f'<geom name="ball{n}{side}" type="sphere" size="{RADIUS_M}" mass="0" pos="{x} 0 0"/>'
            for side, x in (("a", RADIUS_M), ("b", pitch_m - RADIUS_M))
        )
        marks = ""
        for name, sign in (("yellow", -1), ("green", 1)):
            along = (LINKS * pitch_m + sign * MARKERS_M) / 2
            if int(along / pitch_m) == n:
                off = h.marker_m.get(name, (0.0, 0.0))
                marks += f'<site name="{name}" pos="{along - n * pitch_m + off[0]} {off[1]} {RADIUS_M}"/>'
                if name in h.carried_kg:
                    marks += f'<body pos="{along - n * pitch_m} 0 {RADIUS_M}"><inertial pos="0 0 0" mass="{h.carried_kg[name]}"'
                    marks += ' diaginertia="1e-8 1e-8 1e-8"/></body>'
        axis = "0 0 1" if n % 2 else "0 1 0"
        friction = GEAR_LOSS + h.friction_n_m + h.friction_of_n_m.get(n - 1, 0.0)
        joint = (
            "<freejoint/>"
            if n == 0
            else f'<joint name="j{n - 1}" axis="{axis}" damping="{DAMPING}" armature="{ARMATURE}" frictionloss="{friction}"/>'
        )
        place = "0 0 0" if n == 0 else f"{pitch_m} 0 0"
        inner = (
            f'<body name="l{n}" pos="{place}">{joint}<inertial pos="{half} 0 0" mass="{mass}" diaginertia="{inertia}"/>'
            f"{balls}{marks}{inner}</body>"
        )
    motors = "".join(f'<motor joint="j{n}"/>' for n in range(LINKS - 1))
    return f"""<mujoco><compiler angle="radian"/><option timestep="{DT_S}" integrator="implicit" cone="elliptic" impratio="10"/>
<default><geom friction="1 0.005 0.0001" condim="3"/></default>
<worldbody><geom name="ground" type="plane" size="9 9 1" friction="0.0001 0.005 0.0001"/>{inner}</worldbody>
<actuator>{motors}</actuator></mujoco>"""


class Snake:
    """One snake on its floor; ``rng`` draws what chance does."""

    def __init__(self, hidden: Hidden, rng: np.random.Generator) -> None:
        self.hidden, self._rng = hidden, rng
        self.model = mujoco.MjModel.from_xml_string(_xml(hidden))
        self.data = mujoco.MjData(self.model)
        self._strength, self._zero, self._gain = np.ones(LINKS - 1), np.zeros(LINKS - 1), np.ones(LINKS - 1)
        for joint, value in hidden.strength.items():
            self._strength[joint] = value
        for joint, value in hidden.zero_rad.items():
            self._zero[joint] = value
        for joint, value in hidden.gain.items():
            self._gain[joint] = value
        self._balls = [i for i in range(self.model.ngeom) if self.model.geom(i).name.startswith("ball")]
        self._link = np.array([int(self.model.geom(i).name[4:-1]) for i in self._balls])

    def put_down(self) -> None:
        """Straight, at rest, the markers' middle 30 cm east of the origin."""
        mujoco.mj_resetData(self.model, self.data)
        self.data.qpos[:3] = [0.30 - LINKS * PITCH_M / 2, 0.0, RADIUS_M]
        self._told = np.zeros(LINKS - 1)
        self._believed = np.zeros(LINKS - 1)
        self._line = [np.zeros(LINKS - 1)] * max(1, round((DELAY_S + self.hidden.delay_s) / DT_S))
        self._cycles = 0
        mujoco.mj_forward(self.model, self.data)

    def cycle(self, postures: np.ndarray) -> tuple[np.ndarray, np.ndarray, bool, float, list[tuple[float, np.ndarray]]]:
        """Markers (2, 2) in the first posture and in the last, whether it stayed upright and free of itself, how long it took;
        and (time since the first posture, markers) every 80 ms."""
        self._chance()
        self._upright = True
        self._go(postures[0])
        before, began, self._seen = self.markers(), self.data.time, []
        for posture in postures[1:]:
            self._go(posture, began)
        self._cycles += 1
        return before, self.markers(), self._upright, self.data.time - began, self._seen

    def lies(self) -> bool:
        """On its side or back."""
        return abs(self._roll()) > 1.4

    def markers(self) -> np.ndarray:
        """As the camera sees them, with its noise."""
        h = self.hidden
        p = np.array([self.data.site(name).xpos[:2] for name in ("yellow", "green")])
        p = p * (1 + h.scale) * (1 + p @ np.array(h.tilt_1_m))[:, None]
        return p + CAMERA_M * self._rng.normal(size=(2, 2))

    def _chance(self) -> None:
        """The floor of this cycle."""
        place = np.clip(1 + SPREAD * self._rng.normal(), 0.2, 3)
        own = np.clip(1 + LINK_SPREAD * self._rng.normal(size=LINKS), 0.1, 4)
        for link, value in self.hidden.link_friction.items():
            own[link] *= value
        self._mu = FRICTION * self.hidden.friction * place * own
        self.model.geom_friction[self._balls, 0] = self._mu[self._link]
        tilt = TILT_RAD * self._rng.normal(size=2) + np.array(self.hidden.slope_rad)
        self.model.opt.gravity[:2] = 9.81 * np.sin(tilt)

    def _go(self, target: np.ndarray, began: float | None = None) -> None:
        target = np.round(target / STEP_RAD) * STEP_RAD
        start, way = self._told, target - self._told
        steps = int(np.ceil((np.abs(way).max() / SPEED + PAUSE_S) / DT_S))
        for k in range(1, steps + 1):
            self._told = start + np.clip(way, -SPEED * DT_S * k, SPEED * DT_S * k)
            self._step()
            if k % 8 == 0 and (abs(self._roll()) > 1.4 or self._hits_itself()):
                self._upright = False
            if began is not None and round((self.data.time - began) / DT_S) % round(0.08 / DT_S) == 0:
                self._seen.append((self.data.time - began, self.markers()))

    def _step(self) -> None:
        h, d = self.hidden, self.data
        self._line.append(self._told)
        wanted = self._line.pop(0)
        if h.speed < 1:
            far = h.speed * SPEED * DT_S
            wanted = self._believed = self._believed + np.clip(wanted - self._believed, -far, far)
        error = wanted + self._zero - d.qpos[7:]
        error[np.abs(error) < BAND_RAD + h.band_rad] = 0
        tired = 1 - h.tired_per_cycle * self._cycles
        limit = LIMIT * h.torque * self._strength
        torque = np.clip(STIFFNESS * h.stiffness * tired * self._strength * self._gain * error, -limit, limit)
        if h.sag:
            torque *= 1 - h.sag * np.mean(np.abs(torque) / np.maximum(limit, 1e-9))
        d.ctrl[:] = torque
        self._tether()
        if h.patch is not None:
            east = d.xpos[1:][:, 0] > h.patch[0]
            self.model.geom_friction[self._balls, 0] = (self._mu * np.where(east, h.patch[1], 1.0))[self._link]
        d.xfrc_applied[1, 2:], d.xfrc_applied[2:] = 0, 0
        if h.across != 1:
            self._scales()
        mujoco.mj_step(self.model, d)

    def _tether(self) -> None:
        """Tied to the board, which is in the middle of the first link: the drag resists the motion of the point where it acts.

        The source has both at one end of the robot (section 5.5.3) and does not say where on that link.
        """
        h, d = self.hidden, self.data
        speed = np.zeros(6)
        mujoco.mj_objectVelocity(self.model, d, mujoco.mjtObj.mjOBJ_BODY, 1, speed, 0)
        v = speed[3:5]
        pull = -(DRAG_N + h.drag_n) * v / max(float(np.hypot(*v)), 0.02)
        pull = pull + np.array(h.pull_n) - h.pull_n_m * d.xipos[1, :2]
        d.xfrc_applied[1, :2] = pull

    def _scales(self) -> None:
        """Friction across a link that it does not have along it, at every contact with the floor; at a creep in proportion.

        Each contact has its own load and its own sliding speed: a lifted link drags nothing, one that rolls does not slide.
        """
        d, force, speed = self.data, np.zeros(6), np.zeros(6)
        for i in np.flatnonzero((d.contact.geom == 0).any(axis=1)):
            link = int(self.model.geom_bodyid[d.contact.geom[i].max()])
            axis = d.xmat[link].reshape(3, 3)[:2, 0]
            long = np.hypot(*axis)
            if long < 0.5:
                continue
            side = np.array([-axis[1], axis[0], 0.0]) / long
            mujoco.mj_contactForce(self.model, d, int(i), force)
            mujoco.mj_objectVelocity(self.model, d, mujoco.mjtObj.mjOBJ_BODY, link, speed, 0)
            arm = d.contact.pos[i] - d.xipos[link]
            slides = float(side @ (speed[3:] + np.cross(speed[:3], arm)))
            pull = -(self.hidden.across - 1) * self._mu[link - 1] * force[0] * slides / max(abs(slides), 0.02) * side
            d.xfrc_applied[link] += np.concatenate([pull, np.cross(arm, pull)])

    def _hits_itself(self) -> bool:
        """Links press against each other."""
        force = np.zeros(6)
        for i in np.flatnonzero((self.data.contact.geom != 0).all(axis=1)):
            mujoco.mj_contactForce(self.model, self.data, int(i), force)
            if force[0] > 0.5:
                return True
        return False

    def _roll(self) -> float:
        m = self.data.xmat[1:].reshape(-1, 3, 3)
        return float(np.arctan2(m[:, 2, 1].sum(), m[:, 2, 2].sum()))
