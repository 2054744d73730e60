"""A sloping floor makes the driving robot drift downhill."""

from __future__ import annotations

from dataclasses import replace

from bns.physics.effect import Effect, Parameter
from bns.physics.signals import Flow


def apply(flow: Flow, x_m_s: float, y_m_s: float) -> Flow:
    """A constant velocity in the world's frame while the wheels turn."""
    return replace(flow, x_m_s=flow.x_m_s + x_m_s, y_m_s=flow.y_m_s + y_m_s)


EFFECT = Effect(
    name="floor-slope",
    stage="world",
    parameters=(
        Parameter("x_m_s", "m/s", -1.0, 1.0, (-0.1, 0.1), 0.0, "drift velocity east", size_power=1.0),
        Parameter("y_m_s", "m/s", -1.0, 1.0, (-0.1, 0.1), 0.0, "drift velocity north", size_power=1.0),
    ),
    equation="dx/dt += sx, dy/dt += sy while moving",
    residuals="Positions are off in one direction of the floor at any heading, in proportion to the time driven.",
    lookalikes=("tether-pull", "carpet-drift"),
    sentence="the robot drifts in one direction of the floor, as on a slope",
    measurement="lay a spirit level on the floor, in two directions",
    beside={
        "tether-pull": "A floor-slope is a tether-pull from far away: to tell them apart, drive over as much of the floor "
        "as there is, along the drift: the nearer its anchor, the less a tether pulls."
    },
    revision=2,
    apply=apply,
    needs="track",
)
