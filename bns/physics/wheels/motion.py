"""From commands on a grid to motion: what the wheels do, what the robot's body does, and the path of arcs it drives."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from bns.physics.applied import applied
from bns.physics.model import Model
from bns.physics.signals import NO_CONDITIONS, Array, Body, Conditions, Flow, Wheels
from bns.physics.wheels.grid import Grid


@dataclass(frozen=True)
class Arcs:
    """Every step as an arc of constant velocities.

    heading_rad (batch, steps + 1); east_m, north_m (batch, steps): what the wheels drive in each step, in the world's
    frame; moving_s (batch, steps): how long the floor acts on the robot in each step.
    """

    heading_rad: Array
    east_m: Array
    north_m: Array
    moving_s: Array


def body_motion(model: Model, grid: Grid, conditions: Conditions = NO_CONDITIONS, place: Array | None = None) -> Body:
    """Velocities of the body under the model's ``wheel`` and ``body`` effects; ``place`` as in `Body`."""
    return with_body_effects(model, replace(wheel_motion(model, grid, conditions), place=place))


def wheel_motion(model: Model, grid: Grid, conditions: Conditions = NO_CONDITIONS) -> Body:
    """Velocities of a body whose wheels turn under the model's ``wheel`` effects and do not slip."""
    wheels = Wheels(grid.step_s, grid.left_m_s, grid.right_m_s, model.wheelbase_m, conditions)
    for active in model.at("wheel"):
        wheels = applied(active.effect, wheels, active.by_name)
    return _body(wheels)


def with_body_effects(model: Model, body: Body) -> Body:
    """What the model's ``body`` effects make of it."""
    for active in model.at("body"):
        body = applied(active.effect, body, active.by_name)
    return body


def flow_of(model: Model) -> Flow:
    """What the model's ``world`` effects add to every velocity while the robot moves."""
    flow = Flow()
    for active in model.at("world"):
        flow = applied(active.effect, flow, active.by_name)
    return flow


def arcs(body: Body, step_s: Array, heading_rad: Array) -> Arcs:
    """The arcs of a body's motion from ``heading_rad`` (batch,) at the start."""
    turned = body.yaw_rad_s * step_s
    heading = np.cumsum(np.concatenate([heading_rad[:, None], turned], axis=1), axis=1)
    middle = heading[:, :-1] + turned / 2.0
    chord = np.sinc(turned / (2.0 * np.pi)) * step_s  # an arc's chord: sin(a/2)/(a/2) of its length
    cos, sin = np.cos(middle) * chord, np.sin(middle) * chord
    return Arcs(
        heading,
        body.forward_m_s * cos + body.sideways_m_s * sin,
        body.forward_m_s * sin - body.sideways_m_s * cos,
        body.moving * step_s,
    )


def _body(wheels: Wheels) -> Body:
    left, right = wheels.left_m_s, wheels.right_m_s
    return Body(
        forward_m_s=(left + right) / 2.0,
        sideways_m_s=np.zeros_like(left),
        yaw_rad_s=(right - left) / wheels.wheelbase_m,
        moving=wheels.moving,
        left_m_s=left,
        right_m_s=right,
        session_s=wheels.session_s,
        wheelbase_m=wheels.wheelbase_m,
        step_s=wheels.step_s,
        conditions=wheels.conditions,
    )
