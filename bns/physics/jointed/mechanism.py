"""A body on joints for simulation: its MuJoCo model with what is tracked on it, and how its servos are told to move."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Iterator
from dataclasses import asdict, dataclass
from functools import lru_cache
from typing import Any

import numpy as np
from numpy.typing import NDArray

from bns.errors import ModelError, unknown_name
from bns.extras import deferred
from bns.physics.jointed.payload import carry
from bns.physics.jointed.plant import Plant, sound

mujoco = deferred("snake", "mujoco")


def _heard(_: str) -> None:
    """What MuJoCo warns of: a simulation that is unstable. Its own handler writes a file of any size into the working directory.

    Numbers far from those of the robot are tried, and what cannot be simulated there predicts nothing.
    """


@dataclass(frozen=True)
class Mechanism:
    """A body as text and numbers.

    ``xml``: MJCF with position servos; ``sites``: names of the tracked sites. A servo within ``dead_band_rad`` of where it is
    told to be does nothing, and follows ``delay_s`` late. ``tether``: the link that ``tether_drag_n`` brakes ("": the root).
    ``joint_speed_rad_s``, ``settle_s``, ``resolution_rad``: of a robot that goes from posture to posture, how (0: it is told
    positions at times). ``fastest_set_point_rad_s``: what a servo's speed limit is a share of (0: of the set points at hand).
    """

    xml: str
    sites: tuple[str, ...]
    dead_band_rad: float = 0.0
    delay_s: float = 0.0
    tether: str = ""
    tether_drag_n: float = 0.0
    joint_speed_rad_s: float = 0.0
    settle_s: float = 0.0
    resolution_rad: float = 0.0
    fastest_set_point_rad_s: float = 0.0

    @property
    def sha256(self) -> str:
        """Of everything in it, 64 digits; of what came in later, where it is given."""
        of = asdict(self)
        if not self.fastest_set_point_rad_s:
            del of["fastest_set_point_rad_s"]
        return hashlib.sha256(json.dumps(of, sort_keys=True).encode()).hexdigest()


@dataclass(frozen=True)
class Machine:
    """A compiled mechanism and the addresses of its parts.

    ``joints``: of each actuator, in their order; ``joint_at``: their positions in qpos; ``stiffness_n_m_rad``,
    ``torque_n_m`` (joints,) as the model has them; ``told`` (joints, 2): the range in which a servo follows its set points;
    ``free``: does the body lie free on a floor?
    """

    model: Any
    mechanism: Mechanism
    joints: tuple[str, ...]
    joint_at: NDArray[np.int64]
    stiffness_n_m_rad: NDArray[np.float64]
    torque_n_m: NDArray[np.float64]
    told: NDArray[np.float64]
    free: bool
    tether: int

    @property
    def on_the_floor(self) -> tuple[tuple[str, int], ...]:
        """Links that may touch it: name, and number among the links."""
        return tuple((self._name(link), link) for link in sorted({int(link) - 1 for link in self.pair_links}))

    @property
    def links(self) -> tuple[tuple[str, int], ...]:
        """Those that have mass: name, and number among the links."""
        return tuple((self._name(link), link) for link in np.flatnonzero(self.model.body_mass[1:] > 0).tolist())

    @property
    def limited(self) -> tuple[tuple[str, bool], ...]:
        """Joints with a servo: name, and whether the servo's torque has a limit."""
        return tuple(zip(self.joints, np.isfinite(self.torque_n_m).tolist(), strict=True))

    @property
    def sites(self) -> tuple[tuple[str, bool], ...]:
        """Tracked sites: name, and whether a load may be fixed there.

        Not to the world, nor to a body whose inertia about its joints MuJoCo keeps as constants (``body_simple``).
        """
        bodies = [int(self.model.site(name).bodyid[0]) for name in self.mechanism.sites]
        return tuple((n, b > 0 and not self.model.body_simple[b]) for n, b in zip(self.mechanism.sites, bodies, strict=True))

    def masses_kg(self, plant: Plant) -> NDArray[np.float64]:
        """Of the links with all that they carry, (links,)."""
        out: NDArray[np.float64] = self.changed(plant).body_mass[1:].copy()
        return out

    def _name(self, link: int) -> str:
        return str(self.model.body(link + 1).name) or f"link-{link}"

    @property
    def pyramidal(self) -> bool:
        """Is friction on the floor bounded by a pyramid, MuJoCo's default, which holds 1 - 1/sqrt(2) less along its diagonals?"""
        return self.free and self.model.npair > 0 and int(self.model.opt.cone) == int(mujoco.mjtCone.mjCONE_PYRAMIDAL)

    @property
    def pair_links(self) -> NDArray[np.int64]:
        """The moving body of every contact pair, (pairs,)."""
        bodies = self.model.geom_bodyid
        return np.maximum(bodies[self.model.pair_geom1], bodies[self.model.pair_geom2]).astype(np.int64)

    @property
    def limits_inside(self) -> bool:
        """Does MuJoCo bound the servos' torques, within its steps and after their damping, as the file says?

        Without damping, and with forces worked out once a step, it is the same to bound the servos' errors between steps.
        """
        damped = bool(self.model.actuator_biasprm[:, 2].any())
        return damped or int(self.model.opt.integrator) == int(mujoco.mjtIntegrator.mjINT_RK4)

    @property
    def plant(self) -> Plant:
        """Nothing wrong."""
        return sound(self.joints, self.model.nbody - 1, len(self.mechanism.sites))

    def friction_n_m(self, plant: Plant) -> NDArray[np.float64]:
        """Dry friction in each joint with a servo, (joints,): that of the model and the plant's, not below none."""
        own = self.model.dof_frictionloss[self._dofs]
        out: NDArray[np.float64] = np.maximum(own + plant.friction_rad * self.stiffness_n_m_rad, 0.0)
        return out

    @property
    def _dofs(self) -> NDArray[np.int64]:
        """Degree of freedom of each joint with a servo, (joints,)."""
        return self.model.jnt_dofadr[self.model.actuator_trnid[:, 0]].astype(np.int64)

    def changed(self, plant: Plant) -> Any:
        """The MuJoCo model with the masses, the friction of floor and joints and the servos' damping of a plant.

        And with their stiffness and torque, where it bounds them itself (`limits_inside`).
        """
        same = plant.friction_along == plant.friction_across == 1.0
        servos = (plant.damping, *((plant.stiffness, plant.torque) if self.limits_inside else ()))
        more = plant.friction_rad.any() or plant.payload.any()
        if same and not more and all((factors == 1.0).all() for factors in (plant.mass, plant.grip, *servos)):
            return self.model
        model = _copy(self.model)
        model.actuator_biasprm[:, 2] *= plant.damping
        model.dof_frictionloss[self._dofs] = self.friction_n_m(plant)
        if self.limits_inside:
            model.actuator_gainprm[:, 0] *= plant.stiffness
            model.actuator_biasprm[:, 1] *= plant.stiffness
            model.actuator_forcerange *= plant.torque[:, None]
        model.body_mass[1:] *= plant.mass
        model.body_inertia[1:] *= plant.mass[:, None]
        for site in np.flatnonzero(plant.payload).tolist():
            there = self.model.site(self.mechanism.sites[site])
            carry(model, int(there.bodyid[0]), there.pos, plant.payload[site] * float(self.model.body_mass.sum()))
        grip = np.concatenate([[1.0], plant.grip])[self.pair_links]
        model.pair_friction[:, 0] *= plant.friction_along * grip
        model.pair_friction[:, 1] *= plant.friction_across * grip
        mujoco.mj_setConst(model, mujoco.MjData(model))
        return model


def _copy(model: Any) -> Any:
    return model.__copy__()


@lru_cache(maxsize=32)
def machine(mechanism: Mechanism, dt_s: float | None = None) -> Machine:
    """The compiled mechanism, with steps of ``dt_s`` instead of its own; ModelError for a body that cannot be used here."""
    mujoco.set_mju_user_warning(_heard)
    try:
        spec = mujoco.MjSpec.from_string(mechanism.xml)
        _name(spec)
        plain = spec.compile()
    except ValueError as error:
        raise ModelError(f"MuJoCo does not read the body: {error}; give an MJCF file that its viewer opens.") from error
    _track(spec, mechanism)
    _pair_with_floor(spec, plain)
    if dt_s is not None:
        spec.option.timestep = dt_s
    model = spec.compile()
    # set points are bounded before a servo makes a torque of them: what it is given here may lie anywhere
    model.opt.disableflags |= mujoco.mjtDisableBit.mjDSBL_CLAMPCTRL
    _check(model)
    at = model.actuator_trnid[:, 0]
    limits = np.abs(model.actuator_forcerange).max(axis=1)
    free = bool((model.jnt_type == mujoco.mjtJoint.mjJNT_FREE).any())
    return Machine(
        model,
        mechanism,
        tuple(model.joint(int(j)).name for j in at),
        model.jnt_qposadr[at].astype(np.int64),
        model.actuator_gainprm[:, 0].copy(),
        np.where(model.actuator_forcelimited.astype(bool), limits, np.inf),
        np.where(model.actuator_ctrllimited.astype(bool)[:, None], model.actuator_ctrlrange, [-np.inf, np.inf]),
        free,
        model.body(_tether(spec, mechanism)).id,
    )


def _name(spec: Any) -> None:
    """Give bodies, geoms and servos without a name one: models of robots seldom name the geoms that touch the floor."""
    for number, geom in enumerate(spec.geoms):
        geom.name = geom.name or f"bns-geom-{number}"
    for number, body in enumerate(body for body in spec.bodies if body is not spec.worldbody):
        body.name = body.name or f"bns-body-{number}"


def _track(spec: Any, mechanism: Mechanism) -> None:
    """Sensors of every tracked site (where it is, its link's first two axes), of the tether's end, and of where every link is."""
    names = [site.name for site in spec.sites]
    for name in mechanism.sites:
        if name not in names:
            raise ModelError(f"The body has no site {name!r} to be tracked; it has {', '.join(names) or 'none'}.")
        for kind in (
            mujoco.mjtSensor.mjSENS_FRAMEPOS,
            mujoco.mjtSensor.mjSENS_FRAMEXAXIS,
            mujoco.mjtSensor.mjSENS_FRAMEYAXIS,
        ):
            spec.add_sensor(type=kind, objtype=mujoco.mjtObj.mjOBJ_SITE, objname=name)
    for kind in (mujoco.mjtSensor.mjSENS_FRAMEPOS, mujoco.mjtSensor.mjSENS_FRAMELINVEL):
        spec.add_sensor(type=kind, objtype=mujoco.mjtObj.mjOBJ_BODY, objname=_tether(spec, mechanism))
    for body in spec.bodies[1:]:  # the first is the world
        spec.add_sensor(type=mujoco.mjtSensor.mjSENS_FRAMEPOS, objtype=mujoco.mjtObj.mjOBJ_BODY, objname=body.name)


def _tether(spec: Any, mechanism: Mechanism) -> str:
    """The body that the tether is tied to; the root where none is named."""
    bodies = [body for body in spec.bodies if body is not spec.worldbody and body.name != "world"]
    if not bodies:
        raise ModelError("The body has no links; give an MJCF file of a robot.")
    if mechanism.tether and mechanism.tether not in [body.name for body in bodies]:
        raise ModelError(unknown_name("link of the body", mechanism.tether, [body.name for body in bodies]))
    return mechanism.tether or str(bodies[0].name)


def _pair_with_floor(spec: Any, plain: Any) -> None:
    """Contacts of planes with everything else as explicit pairs: only these know two directions of friction.

    Of a capsule's contacts with a plane the first direction runs along the capsule.
    """
    for floor, other in _floor_pairs(plain):
        sliding, spin, rolling = _of_the_one_that_counts(plain.geom_friction, plain, floor, other)
        spec.add_pair(
            geomname1=plain.geom(floor).name,
            geomname2=plain.geom(other).name,
            condim=int(_of_the_one_that_counts(plain.geom_condim, plain, floor, other)),
            friction=[sliding, sliding, spin, rolling, rolling],
            solref=plain.geom_solref[other],
            solimp=plain.geom_solimp[other],
        )


def _of_the_one_that_counts(values: NDArray[Any], plain: Any, floor: int, other: int) -> Any:
    """Of two geoms that touch, the value of the one with priority; of equals the larger one, as MuJoCo has it."""
    first, second = plain.geom_priority[[floor, other]]
    if first == second:
        return np.maximum(values[floor], values[other])
    return values[floor if first > second else other]


def _floor_pairs(plain: Any) -> Iterator[tuple[int, int]]:
    """Those that MuJoCo would let touch: excluded pairs of links and those that the file pairs itself are left out."""
    planes = np.flatnonzero(plain.geom_type == mujoco.mjtGeom.mjGEOM_PLANE)
    excluded = {(int(one) >> 16, int(one) & 0xFFFF) for one in plain.exclude_signature}
    paired = {frozenset(pair) for pair in zip(plain.pair_geom1.tolist(), plain.pair_geom2.tolist(), strict=True)}
    for floor in map(int, planes):
        for other in range(plain.ngeom):
            meets = plain.geom_contype[floor] & plain.geom_conaffinity[other]
            met = plain.geom_contype[other] & plain.geom_conaffinity[floor]
            links = sorted((int(plain.geom_bodyid[floor]), int(plain.geom_bodyid[other])))
            if tuple(links) in excluded or frozenset((floor, other)) in paired:
                continue
            if plain.geom_bodyid[other] > 0 and (meets or met):
                yield floor, other


def _check(model: Any) -> None:
    """ModelError unless every actuator is a position servo on a hinge or slide."""
    if not model.nu:
        raise ModelError("The body has no actuators; each commanded joint needs a <position> actuator.")
    for k in range(model.nu):
        on_joint = model.actuator_trntype[k] == mujoco.mjtTrn.mjTRN_JOINT
        servo = model.actuator_biasprm[k, 1] < 0 and np.isclose(
            model.actuator_gainprm[k, 0], -model.actuator_biasprm[k, 1]
        )
        if not (on_joint and servo):
            raise ModelError(
                f"Actuator {model.actuator(k).name or k} of the body is no position servo on a joint; "
                "only <position joint=...> actuators can be diagnosed."
            )
        name = model.actuator(k).name or k
        if model.actuator_gear[k, 0] != 1.0:
            raise ModelError(
                f"Actuator {name} of the body has gear {model.actuator_gear[k, 0]:g}; only servos without a gear (gear 1) can be "
                "diagnosed: set points are angles of the joint."
            )
        if model.actuator_dyntype[k] != mujoco.mjtDyn.mjDYN_NONE:
            raise ModelError(
                f"Actuator {name} of the body has dynamics of its own (timeconst or dyntype); only servos without can be "
                "diagnosed. Leave them out: bns adds servo-delay and compliance where measurements show them."
            )
    free = np.flatnonzero(model.jnt_type == mujoco.mjtJoint.mjJNT_FREE)
    if len(free) > 1 or (len(free) and (free[0] != 0 or model.nmocap)):
        raise ModelError(
            "The body has free joints other than its root; one robot, free at its root or fixed, can be diagnosed."
        )
