"""Two-wheeled robots as MuJoCo models: chassis, driven wheels, balls or a swivel caster, and a floor to touch."""

from __future__ import annotations

from dataclasses import dataclass, replace

import mujoco

TIMESTEP_S = 0.001
GRAVITY = 9.81
# Dry friction that holds a wheel still, where MuJoCo's default lets it creep.
STICKING = 'solreffriction="0.004 1" solimpfriction="0.99 0.999 0.001"'


@dataclass(frozen=True)
class Caster:
    """A swivel caster behind the axle: its trail and the friction of its hinge."""

    trail_m: float
    damping_nms: float = 0.0
    friction_nm: float = 0.0


@dataclass(frozen=True)
class Robot:
    """One body: sizes, masses, contact and the stiffness of its two speed controllers."""

    wheelbase_m: float
    wheel_radius_m: float
    mass_kg: float
    top_speed_ms: float
    tyre_friction: float = 1.5
    # The speed controllers are proportional; this is the time constant they give on a straight line.
    servo_time_s: float = 0.012
    torque_limit_nm: float | None = None
    # Dry friction in both wheel bearings.
    wheel_friction_nm: float = 0.0
    # The left wheel's geometric centre lies this far from its shaft.
    eccentricity_m: float = 0.0
    payload_kg: float = 0.0
    caster: Caster | None = None
    # A rubber band from the floor's point (x, y) to the robot's tail: stiffness and free length.
    tether_n_m: float = 0.0
    tether_free_m: float = 0.0
    tether_at: tuple[float, float] = (0.0, 0.0)
    # Half the height of the bar that some trials meet; 0: there is none.
    obstacle_height_m: float = 0.0

    @property
    def wheel_mass_kg(self) -> float:
        return 0.04 * self.mass_kg

    @property
    def servo_gain(self) -> float:
        """The controllers' torque for an error of 1 rad/s (without payload: a turn in place is a little quicker)."""
        per_wheel = self.mass_kg / 2 + 0.4 * self.wheel_mass_kg
        return per_wheel * self.wheel_radius_m**2 / self.servo_time_s


SMALL = Robot(wheelbase_m=0.09, wheel_radius_m=0.02, mass_kg=0.3, top_speed_ms=0.12)
MEDIUM = Robot(wheelbase_m=0.25, wheel_radius_m=0.05, mass_kg=2.5, top_speed_ms=0.18)
LARGE = Robot(
    wheelbase_m=0.6,
    wheel_radius_m=0.1,
    mass_kg=18.0,
    top_speed_ms=0.22,
    caster=Caster(trail_m=0.04, damping_nms=0.001),
)


def weak(robot: Robot, servo_time_s: float = 0.04) -> Robot:
    """The same robot with controllers that give way under load."""
    return replace(robot, servo_time_s=servo_time_s)


def _wheel(robot: Robot, side: str) -> str:
    r = robot.wheel_radius_m
    half = 0.006 if robot.wheelbase_m < 0.2 else 0.03 * robot.wheelbase_m
    y = (0.5 if side == "left" else -0.5) * robot.wheelbase_m
    e = robot.eccentricity_m if side == "left" else 0.0
    shape = f'type="ellipsoid" size="{r} {half} {r}"'
    return f"""
      <body name="{side}" pos="0 {y} 0">
        <joint name="{side}" type="hinge" axis="0 1 0" frictionloss="{robot.wheel_friction_nm}" {STICKING}/>
        <geom name="{side}" {shape} pos="{e} 0 0" mass="{robot.wheel_mass_kg}" friction="{robot.tyre_friction} 0 0"/>
      </body>"""


def _ball(robot: Robot, name: str, x: float, lift: float) -> str:
    """A ball that rolls freely in its cup, ``lift`` above the floor."""
    r = 0.4 * robot.wheel_radius_m
    z = r - robot.wheel_radius_m + lift
    return f"""
      <body name="{name}" pos="{x} 0 {z}">
        <joint name="{name}" type="ball"/>
        <geom name="{name}" type="sphere" size="{r}" mass="{0.01 * robot.mass_kg}" friction="0.3 0 0"/>
      </body>"""


def _swivel(robot: Robot, caster: Caster, x: float) -> str:
    """A fork on an upright hinge with a small wheel behind it."""
    r = 0.4 * robot.wheel_radius_m
    z = r - robot.wheel_radius_m
    return f"""
      <body name="fork" pos="{x} 0 {z}">
        <joint name="swivel" type="hinge" axis="0 0 1" damping="{caster.damping_nms}" frictionloss="{caster.friction_nm}"/>
        <geom type="box" size="{r / 3} {r / 3} {r / 3}" pos="0 0 {r}" mass="{0.005 * robot.mass_kg}" contype="0" conaffinity="0"/>
        <body name="roller" pos="{-caster.trail_m} 0 0">
          <joint name="roller" type="hinge" axis="0 1 0"/>
          <geom name="roller" type="ellipsoid" size="{r} {r / 3} {r}" mass="{0.01 * robot.mass_kg}" friction="0.8 0 0"/>
        </body>
      </body>"""


def mjcf(robot: Robot) -> str:
    """The robot on its floor as MuJoCo's XML; the chassis' frame lies at the centre of the axle."""
    b, r = robot.wheelbase_m, robot.wheel_radius_m
    tail, lift = -0.5 * b, 0.002 * b + 1.3 * robot.eccentricity_m
    rear = _swivel(robot, robot.caster, tail) if robot.caster else _ball(robot, "rear", tail, 0.0)
    payload = ""
    if robot.payload_kg:
        size = f"{0.2 * b} {0.2 * b} {0.1 * b}"
        payload = (
            f'<geom type="box" size="{size}" pos="{-0.1 * b} 0 {0.15 * b}" mass="{robot.payload_kg}" conaffinity="2"/>'
        )
    limit = "" if robot.torque_limit_nm is None else f'forcerange="{-robot.torque_limit_nm} {robot.torque_limit_nm}"'
    servo = f'dyntype="filterexact" dynprm="0.001" gainprm="{robot.servo_gain}" biastype="affine" {limit}'
    servo += f' biasprm="0 0 {-robot.servo_gain}"'
    obstacle = ""
    if robot.obstacle_height_m:
        size = f"{0.03 * b} {0.5 * b} {robot.obstacle_height_m / 2}"
        obstacle = f"""
    <body name="obstacle" mocap="true" pos="0 0 -9">
      <geom name="obstacle" type="box" size="{size}" contype="3" conaffinity="0" friction="0.01 0 0"/>
    </body>"""
    tether = ""
    if robot.tether_n_m:
        tether = f"""
  <tendon>
    <spatial stiffness="{robot.tether_n_m}" springlength="0 {robot.tether_free_m}">
      <site site="peg"/><site site="tail"/>
    </spatial>
  </tendon>"""
    return f"""
<mujoco>
  <option timestep="{TIMESTEP_S}" integrator="implicitfast" cone="elliptic" impratio="20" gravity="0 0 {-GRAVITY}"/>
  <default>
    <geom contype="0" conaffinity="1" condim="3" solref="0.004 1" solimp="0.95 0.99 0.0005"/>
  </default>
  <worldbody>
    <geom name="floor" type="plane" size="50 50 1" contype="1" conaffinity="0" friction="0.01 0 0"/>
    <site name="peg" pos="{robot.tether_at[0]} {robot.tether_at[1]} {r}"/>{obstacle}
    <body name="chassis" pos="0 0 {r}">
      <freejoint/>
      <geom type="box" size="{0.35 * b} {0.35 * b} {0.06 * b}" pos="{-0.05 * b} 0 {-0.06 * b}" mass="{robot.mass_kg * 0.9}"
            conaffinity="2"/>
      {payload}
      <site name="tail" pos="{tail} 0 0"/>{_wheel(robot, "left")}{_wheel(robot, "right")}{rear}
      {_ball(robot, "front", -tail, lift)}
    </body>
  </worldbody>{tether}
  <actuator>
    <general joint="left" {servo}/>
    <general joint="right" {servo}/>
  </actuator>
</mujoco>"""


def build(robot: Robot, lag_s: float = 0.0) -> mujoco.MjModel:
    """The compiled model, whose motors follow their set speed with the time constant ``lag_s``."""
    model = mujoco.MjModel.from_xml_string(mjcf(robot))
    model.actuator_dynprm[:, 0] = max(lag_s, 1e-4)
    return model
