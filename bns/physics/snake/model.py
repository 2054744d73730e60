"""The snake as a MuJoCo model, generated from its parameters."""

from __future__ import annotations

from bns.extras import extra
from bns.physics.snake.parameters import SnakeParameters
from bns.physics.snake.servo import actuator_xml, joint_xml, servo_of

with extra("snake"):
    import mujoco

YELLOW, GREEN = "yellow", "green"
"""Names of the marker sites."""
_LESS_THAN_ANY = 1e-4
"""Friction of the floor itself: of two that touch the larger friction counts, so that each link's own decides."""


def build_model(parameters: SnakeParameters) -> mujoco.MjModel:
    """Compiled model: bodies ``link0`` (yellow end) to ``link12``, joints ``joint0`` to ``joint11``, sites of the markers."""
    return mujoco.MjModel.from_xml_string(model_xml(parameters))


def model_xml(p: SnakeParameters) -> str:
    """The model in MuJoCo's own language: links are capsules along x, y to the left, z up."""
    servo = servo_of(p)
    motors = "".join(actuator_xml(servo, f"joint{n}") for n in range(p.joints))
    return f"""
<mujoco model="snake">
  <compiler angle="radian"/>
  <option timestep="{p.dt_s}" integrator="implicitfast" cone="elliptic" impratio="10"/>
  <visual><global offwidth="960" offheight="544"/><headlight ambient="0.4 0.4 0.4"/><quality shadowsize="0"/></visual>
  <default>
    <joint {joint_xml(servo)}
      range="-1.745 1.745" limited="true"/>
    <geom friction="{p.floor_friction} 0.005 0.0001" condim="3"/>
  </default>
  <asset>
    <texture name="tiles" type="2d" builtin="checker" rgb1="0.92 0.92 0.92" rgb2="0.84 0.84 0.84" width="200" height="200"/>
    <material name="floor" texture="tiles" texrepeat="10 10" texuniform="true"/>
  </asset>
  <worldbody>
    <light pos="0 0 4" dir="0 0 -1" diffuse="0.5 0.5 0.5"/>
    <geom name="floor" type="plane" size="10 10 0.1" material="floor" friction="{_LESS_THAN_ANY} 0.005 0.0001"/>
    {_link(p, 0)}
  </worldbody>
  <actuator>{motors}</actuator>
</mujoco>"""


def _link(p: SnakeParameters, n: int) -> str:
    """Link ``n`` and, inside it, all that follow: its frame is at the joint that carries it."""
    last = int(p.links) - 1
    half, end = p.pitch_m / 2, p.pitch_m - p.radius_m
    mass = p.body_mass_kg / p.links + (p.tail_mass_kg if n == p.heavy_link else 0.0)
    place = f'pos="0 0 {p.radius_m}"' if n == 0 else f'pos="{p.pitch_m} 0 0"'
    axis = "0 0 1" if (n - 1) % 2 == 0 else "0 1 0"
    joint = '<freejoint name="root"/>' if n == 0 else f'<joint name="joint{n - 1}" axis="{axis}"/>'
    colour = "0.25 0.27 0.3 1" if n % 2 else "0.35 0.38 0.42 1"
    inner = _link(p, n + 1) if n < last else ""
    # Shorter than the pitch by the radius, so that the round ends meet half-way in the joint.
    return (
        f'<body name="link{n}" {place}>{joint}<geom name="link{n}" type="capsule" size="{p.radius_m}" mass="{mass}" '
        f'fromto="{p.radius_m} 0 0 {end} 0 0" rgba="{colour}"/>{_marker(p, n, half)}{inner}</body>'
    )


def _marker(p: SnakeParameters, n: int, half: float) -> str:
    """The marker's site, if it is on this link: on its top."""
    for name, sign, colour in ((YELLOW, -1, "1 0.85 0 1"), (GREEN, 1, "0.1 0.7 0.2 1")):
        along = (p.length_m + sign * p.marker_gap_m) / 2
        if int(along / p.pitch_m) == n:
            return f'<site name="{name}" pos="{along - n * p.pitch_m} 0 {p.radius_m}" size="0.02" rgba="{colour}"/>'
    return ""
