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
from bns.physics.jointed.plant import Plant, sound

mujoco = deferred("snake", "mujoco")


@dataclass(frozen=True)
class Mechanism:
    """A body as text and numbers.

    ``xml``: MJCF with position servos; ``sites``: names of the tracked sites. A servo within ``dead_band_rad`` of where it is
    told to be does nothing, and follows ``delay_s`` late. ``tether``: the link that ``tether_drag_n`` brakes ("": the root).
    ``joint_speed_rad_s``, ``settle_s``, ``resolution_rad``: of a robot that goes from posture to posture, how (0: it is told
    positions at times).
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

    @property
    def sha256(self) -> str:
        """Of everything in it, 64 digits."""
        return hashlib.sha256(json.dumps(asdict(self), sort_keys=True).encode()).hexdigest()


@dataclass(frozen=True)
class Machine:
    """A compiled mechanism and the addresses of its parts.

    ``joints``: of each actuator, in their order; ``joint_at``: their positions in qpos; ``stiffness_n_m_rad``,
    ``torque_n_m`` (joints,) as the model has them; ``free``: does the body lie free on a floor? ``links``: bodies that have mass.
    """

    model: Any
    mechanism: Mechanism
    joints: tuple[str, ...]
    joint_at: NDArray[np.int64]
    stiffness_n_m_rad: NDArray[np.float64]
    torque_n_m: NDArray[np.float64]
    free: bool
    tether: int

    @property
    def plant(self) -> Plant:
        """Nothing wrong."""
        return sound(self.joints, self.model.nbody - 1)

    def changed(self, plant: Plant) -> Any:
        """The MuJoCo model with the masses and the friction of a plant."""
        same = plant.friction_along == plant.friction_across == 1.0
        if same and (plant.mass == 1.0).all() and (plant.grip == 1.0).all():
            return self.model
        model = _copy(self.model)
        model.body_mass[1:] *= plant.mass
        model.body_inertia[1:] *= plant.mass[:, None]
        links = np.maximum(model.geom_bodyid[model.pair_geom1], model.geom_bodyid[model.pair_geom2])
        grip = np.concatenate([[1.0], plant.grip])[links]
        model.pair_friction[:, 0] *= plant.friction_along * grip
        model.pair_friction[:, 1] *= plant.friction_across * grip
        mujoco.mj_setConst(model, mujoco.MjData(model))
        return model


def _copy(model: Any) -> Any:
    return model.__copy__()


@lru_cache(maxsize=32)
def machine(mechanism: Mechanism, dt_s: float | None = None) -> Machine:
    """The compiled mechanism, with steps of ``dt_s`` instead of its own; ModelError for a body that cannot be used here."""
    try:
        spec = mujoco.MjSpec.from_string(mechanism.xml)
        plain = mujoco.MjSpec.from_string(mechanism.xml).compile()
    except ValueError as error:
        raise ModelError(f"MuJoCo does not read the body: {error}; give an MJCF file that its viewer opens.") from error
    _track(spec, mechanism)
    _pair_with_floor(spec, plain)
    if dt_s is not None:
        spec.option.timestep = dt_s
    model = spec.compile()
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
        free,
        model.body(_tether(spec, mechanism)).id,
    )


def _track(spec: Any, mechanism: Mechanism) -> None:
    """Sensors of every tracked site (where it is, its link's first two axes), then of the tether's end."""
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


def _tether(spec: Any, mechanism: Mechanism) -> str:
    """The body that the tether is tied to; the root where none is named."""
    bodies = [body for body in spec.bodies if body is not spec.worldbody and body.name != "world"]
    if not bodies:
        raise ModelError("The body has no links; give an MJCF file of a robot.")
    if not bodies[0].name:
        bodies[0].name = "bns-root"
    if mechanism.tether and mechanism.tether not in [body.name for body in bodies]:
        raise ModelError(unknown_name("link of the body", mechanism.tether, [body.name for body in bodies]))
    return mechanism.tether or str(bodies[0].name)


def _pair_with_floor(spec: Any, plain: Any) -> None:
    """Contacts of planes with everything else as explicit pairs: only these know two directions of friction.

    Of a capsule's contacts with a plane the first direction runs along the capsule.
    """
    for floor, other in _floor_pairs(plain):
        a, b = plain.geom(floor), plain.geom(other)
        if not a.name or not b.name:
            raise ModelError(
                f"Geom {other if a.name else floor} of the body has no name; name every geom that touches the floor."
            )
        sliding, spin, rolling = np.maximum(plain.geom_friction[floor], plain.geom_friction[other])
        spec.add_pair(
            geomname1=a.name,
            geomname2=b.name,
            condim=int(max(plain.geom_condim[floor], plain.geom_condim[other])),
            friction=[sliding, sliding, spin, rolling, rolling],
            solref=plain.geom_solref[other],
            solimp=plain.geom_solimp[other],
        )


def _floor_pairs(plain: Any) -> Iterator[tuple[int, int]]:
    planes = np.flatnonzero(plain.geom_type == mujoco.mjtGeom.mjGEOM_PLANE)
    for floor in map(int, planes):
        for other in range(plain.ngeom):
            meets = plain.geom_contype[floor] & plain.geom_conaffinity[other]
            met = plain.geom_contype[other] & plain.geom_conaffinity[floor]
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
    free = np.flatnonzero(model.jnt_type == mujoco.mjtJoint.mjJNT_FREE)
    if len(free) > 1 or (len(free) and (free[0] != 0 or model.nmocap)):
        raise ModelError(
            "The body has free joints other than its root; one robot, free at its root or fixed, can be diagnosed."
        )
