"""A quadruped as public collections of MJCF have them: default classes, capsules without names, servos with kp and kv."""

from __future__ import annotations

import mujoco
import numpy as np
import pandas as pd

LEGS = {"FR": (1, -1), "FL": (1, 1), "RR": (-1, -1), "RL": (-1, 1)}
PARTS = ("hip", "thigh", "calf")
JOINTS = tuple(f"{leg}_{part}_joint" for leg in LEGS for part in PARTS)
SITES = ("head", "tail")
STAND = (0.0, 0.8, -1.6)
_FEET = 'class="foot" size="0.02" pos="0 0 -0.2"'
XML = """<mujoco model="dog">
<compiler angle="radian" autolimits="true"/><option cone="elliptic" impratio="100" timestep="0.002" integrator="implicitfast"/>
<default>
  <default class="dog">
    <geom friction="0.6" margin="0.001" condim="1"/>
    <joint axis="0 1 0" damping="0.3" armature="0.01" frictionloss="0.1"/>
    <position kp="60" kv="1.5" forcerange="-23 23" inheritrange="1"/>
    <default class="abduction"><joint axis="1 0 0" range="-0.8 0.8"/></default>
    <default class="hip"><joint range="-0.7 3.5"/></default>
    <default class="knee"><joint range="-2.7 -0.6"/><position forcerange="-35 35"/></default>
    <default class="visual"><geom type="box" contype="0" conaffinity="0" group="2"/></default>
    <default class="collision"><geom type="capsule" group="3"/>
      <default class="foot"><geom type="sphere" priority="1" condim="6" friction="0.8 0.02 0.01"/></default></default>
  </default>
</default>
<worldbody><light pos="0 0 2"/><geom name="ground" size="0 0 0.05" type="plane" friction="1"/>
<body name="trunk" pos="0 0 0.3" childclass="dog"><freejoint/>
  <inertial mass="5.2" pos="0 0 0" diaginertia="0.02 0.08 0.09"/>
  <geom class="visual" size="0.18 0.05 0.05"/><geom class="collision" size="0.05" fromto="-0.15 0 0 0.15 0 0"/>
  <site name="head" pos="0.2 0 0.05"/><site name="tail" pos="-0.2 0 0.05"/><site name="imu"/>{legs}</body></worldbody>
<actuator>{servos}</actuator>
<keyframe><key name="home" qpos="0 0 0.27 1 0 0 0 {stand}" ctrl="{stand}"/></keyframe></mujoco>"""


def xml() -> str:
    """The robot in MJCF."""
    legs = "".join(
        f'<body name="{leg}_hip" pos="{0.18 * ahead} {0.05 * left} 0">'
        '<inertial mass="0.6" pos="0 0 0" diaginertia="1e-3 1e-3 1e-3"/>'
        f'<joint class="abduction" name="{leg}_hip_joint"/>'
        f'<body name="{leg}_thigh" pos="0 {0.08 * left} 0"><inertial mass="0.9" pos="0 0 -0.05" diaginertia="4e-3 4e-3 1e-3"/>'
        f'<joint class="hip" name="{leg}_thigh_joint"/><geom class="collision" size="0.015" fromto="0 0 0 0 0 -0.2"/>'
        f'<body name="{leg}_calf" pos="0 0 -0.2"><inertial mass="0.2" pos="0 0 -0.1" diaginertia="2e-3 2e-3 1e-4"/>'
        f'<joint class="knee" name="{leg}_calf_joint"/><geom class="collision" size="0.012" fromto="0 0 0 0 0 -0.19"/>'
        f"<geom {_FEET}/></body></body></body>"
        for leg, (ahead, left) in LEGS.items()
    )
    classes = dict(zip(PARTS, ("abduction", "hip", "knee"), strict=True))
    servos = "".join(
        f'<position class="{classes[part]}" name="{leg}_{part}" joint="{leg}_{part}_joint"/>' for leg in LEGS for part in PARTS
    )
    return XML.format(legs=legs, servos=servos, stand=" ".join(map(str, STAND * len(LEGS))))


def log(trials: int, seed: int = 0, strength: float = 1.0, seconds: float = 7.0, noise_m: float = 0.001) -> pd.DataFrame:
    """Standing on four feet it sways, bows and squats, seen at 10 Hz; the knee of the right front leg may be weak."""
    rng, rows = np.random.default_rng(seed), []
    model = mujoco.MjModel.from_xml_string(xml())
    weak = JOINTS.index("FR_calf_joint")
    for values in (model.actuator_gainprm, model.actuator_biasprm, model.actuator_forcerange):
        values[weak] *= strength
    for trial in range(trials):
        data, before, after = mujoco.MjData(model), _stance(rng, 0.0), _stance(rng)
        mujoco.mj_resetDataKeyframe(model, data, 0)
        for step in range(round(seconds / 0.002)):
            if step % 300 == 0 and step:
                before, after = after, _stance(rng)
            if step % 10 == 0:
                share = (1 - np.cos(np.pi * (step % 300) / 300)) / 2
                told = before + share * (after - before)
                seen = np.full(4, np.nan)
                if step % 50 == 0:
                    mujoco.mj_kinematics(model, data)
                    seen = np.concatenate([data.site(name).xpos[:2] for name in SITES]) + noise_m * rng.normal(size=4)
                rows.append((trial, step * 0.002, *told, *seen))
            data.ctrl[:] = told
            mujoco.mj_step(model, data)
    columns = [*(f"{j}_set_rad" for j in JOINTS), *(f"{s}_{a}_m" for s in SITES for a in "xy")]
    return pd.DataFrame(rows, columns=["trial", "t_s", *columns])


def _stance(rng: np.random.Generator, size: float = 1.0) -> np.ndarray:
    """Set points (12,) of a stance: sideways, forwards and down, the front legs further than the hind ones or less far."""
    side, ahead, down, bow = size * rng.uniform(-1, 1, 4) * [0.2, 0.15, 0.15, 0.1]
    legs = [[side, ahead + down + front * bow, -2 * down - front * bow] for front, _ in LEGS.values()]
    return np.array(STAND * len(LEGS)) + np.ravel(legs)
