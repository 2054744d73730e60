"""One of the snake's servos by itself, turning a pendulum: the model of the servo compared with a real one's log."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from bns.extras import extra
from bns.physics.snake.parameters import SnakeParameters

with extra("snake"):
    import mujoco

GRAVITY_M_S2 = 9.81


@dataclass(frozen=True)
class Servo:
    """What `bns.physics.snake.model` knows of a servo, SI."""

    stiffness_n_m_rad: float
    damping_n_m_s_rad: float
    torque_limit_n_m: float
    armature_kg_m2: float
    friction_loss_n_m: float


def servo_of(p: SnakeParameters) -> Servo:
    """The servos of a snake, which are all alike."""
    return Servo(
        p.stiffness_n_m_rad, p.damping_n_m_s_rad, p.torque_limit_n_m, p.armature_kg_m2, p.friction_loss_n_m
    )


def joint_xml(servo: Servo) -> str:
    """Attributes of a joint that such a servo drives."""
    return (
        f'damping="{servo.damping_n_m_s_rad}" armature="{servo.armature_kg_m2}" frictionloss="{servo.friction_loss_n_m}"'
    )


def actuator_xml(servo: Servo, joint: str) -> str:
    """The servo's actuator on a joint: torque in proportion to the error of position, up to its limit."""
    limit = servo.torque_limit_n_m
    return f'<position joint="{joint}" kp="{servo.stiffness_n_m_rad}" forcerange="{-limit} {limit}"/>'


def pendulum_rad(
    servo: Servo, mass_kg: float, length_m: float, t_s: np.ndarray, goal_rad: np.ndarray, begin_rad: float, dt_s: float = 0.001
) -> np.ndarray:
    """Angles (n,) at times t_s (n,) of a point mass on a rod, 0 hanging down, while the servo is told goal_rad (n,)."""
    model = mujoco.MjModel.from_xml_string(f"""
<mujoco><compiler angle="radian"/><option timestep="{dt_s}" integrator="implicitfast" gravity="0 0 {-GRAVITY_M_S2}"/>
  <worldbody><body><joint name="joint" axis="0 1 0" {joint_xml(servo)}/>
    <geom type="sphere" size="0.01" mass="{mass_kg}" pos="0 0 {-length_m}"/></body></worldbody>
  <actuator>{actuator_xml(servo, "joint")}</actuator></mujoco>""")
    data, found = mujoco.MjData(model), np.empty(len(t_s))
    data.qpos[0] = begin_rad
    for i, until in enumerate(t_s):
        while data.time < until - t_s[0] - dt_s / 2:
            mujoco.mj_step(model, data)
        found[i], data.ctrl[0] = data.qpos[0], goal_rad[i]
    return found
