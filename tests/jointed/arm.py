"""A robot that is no snake: an arm of three servos on a table, driven and logged by a loop of its own."""

from __future__ import annotations

import mujoco
import numpy as np
import pandas as pd

XML = """<mujoco model="arm"><compiler angle="radian"/><option timestep="0.004" integrator="implicitfast"/>
<worldbody>{links}</worldbody><actuator>{servos}</actuator></mujoco>"""
JOINTS = ("shoulder", "elbow", "wrist")


def xml(stiffness: float = 6.0) -> str:
    """The arm in MJCF: links of 20 cm that turn about vertical axes, sites at the elbow and at the hand."""
    inner = ""
    for n, joint in reversed(list(enumerate(JOINTS))):
        site = {1: '<site name="elbow" pos="0 0 0"/>', 2: '<site name="hand" pos="0.2 0 0"/>'}.get(n, "")
        inner = (
            f'<body name="{joint}-link" pos="{0.2 if n else 0} 0 0">'
            f'<joint name="{joint}" axis="0 0 1" damping="1.0" armature="0.003"/>'
            f'<geom name="{joint}-geom" type="capsule" size="0.02" fromto="0 0 0 0.2 0 0" mass="0.2" contype="0"'
            ' conaffinity="0"/>'
            f"{site}{inner}</body>"
        )
    servos = "".join(f'<position joint="{j}" kp="{stiffness}" forcerange="-3 3"/>' for j in JOINTS)
    return XML.format(links=inner, servos=servos)


def loaded(text: str, site: str, load_kg: float) -> str:
    """The file with a body of its own at a site that stands at ``pos="x y z"`` of its link."""
    spec = mujoco.MjSpec.from_string(text)
    at = next(one for one in spec.sites if one.name == site)
    load = at.parent.add_body(pos=at.pos)
    load.mass, load.ipos, load.iquat, load.inertia, load.explicitinertial = load_kg, [0, 0, 0], [1, 0, 0, 0], [1e-9] * 3, True
    spec.compile()
    return str(spec.to_xml())


def log(
    trials: int,
    seed: int = 0,
    zero_rad: float = 0.0,
    strength: float = 1.0,
    noise_m: float = 0.001,
    gain: float = 1.0,
    friction_n_m: tuple[float, ...] = (0.0, 0.0, 0.0),
    carried_kg: float = 0.0,
    finer: int = 1,
    speed_rad_s: float = np.inf,
    told_rad_s: float = np.inf,
    seen_every: int = 10,
    spring_n_m_rad: float = 0.0,
) -> pd.DataFrame:
    """Random set points every 0.48 s, seen at 25 Hz; the elbow's zero may be off, its servo weak or of a lower gain.

    ``seen_every``: steps of 4 ms from one frame to the next. ``friction_n_m``: dry friction in each joint. ``carried_kg``: at the
    hand. ``finer``: with steps so many times shorter than the model's, and another integrator. ``speed_rad_s``: of the servos,
    which go from set point to set point no faster; ``told_rad_s``: of the set points themselves. ``spring_n_m_rad``: of a hose
    that pulls the shoulder back.
    """
    rng, rows = np.random.default_rng(seed), []
    model = mujoco.MjModel.from_xml_string(loaded(xml(), "hand", carried_kg) if carried_kg else xml())
    model.actuator_gainprm[1, 0] *= strength * gain
    model.actuator_biasprm[1, 1] *= strength * gain
    model.actuator_forcerange[1] *= strength
    model.dof_frictionloss[:] = friction_n_m
    model.jnt_stiffness[0] = spring_n_m_rad
    if finer > 1:
        model.opt.timestep, model.opt.integrator = 0.004 / finer, mujoco.mjtIntegrator.mjINT_EULER
    for trial in range(trials):
        data, goal, told, follows = mujoco.MjData(model), np.zeros(3), np.zeros(3), np.zeros(3)
        for step in range(1500):
            if step % 120 == 0:
                goal = rng.uniform(-1.2, 1.2, 3)
            if step % 10 == 0:
                told = told + np.clip(goal - told, -10 * 0.004 * told_rad_s, 10 * 0.004 * told_rad_s)
            if step % 10 == 0 or step % seen_every == 0:
                mujoco.mj_kinematics(model, data)
                seen = np.concatenate([data.site(name).xpos[:2] for name in ("elbow", "hand")])
                seen = seen + noise_m * rng.normal(size=4) if step % seen_every == 0 else np.full(4, np.nan)
                rows.append((trial, step * 0.004, *told, *seen))
            follows = follows + np.clip(told - follows, -0.004 * speed_rad_s, 0.004 * speed_rad_s)
            data.ctrl[:] = follows + np.array([0, zero_rad, 0])
            mujoco.mj_step(model, data, finer)
    columns = [*(f"{j}_set_rad" for j in JOINTS), *(f"{s}_{a}_m" for s in ("elbow", "hand") for a in "xy")]
    return pd.DataFrame(rows, columns=["trial", "t_s", *columns])
