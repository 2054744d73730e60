"""A carpet's pile leans to one side and carries a driving robot that way, in proportion to the distance driven.

Cleaning robots estimate it as a vector of the floor (D. Goel, E. Eade, P. Fong and M. E. Munich, "Carpet drift estimation using
differential sensors or visual measurements", US patent 9,427,875, 2016). Turns on the spot are taken to do nothing.
"""

from __future__ import annotations

import numpy as np

from bns.physics.effect import Effect, Parameter
from bns.physics.signals import Body


def apply(body: Body, x_share: float, y_share: float) -> Body:
    """A velocity in the world's frame that is a fraction of the forward speed, forwards or backwards."""
    if body.place is None:
        return body  # first round of a simulation: nobody knows yet where the robot heads
    speed, heading = np.abs(body.forward_m_s), body.place[..., 2]
    return body.with_drift("east", x_share * speed, heading).with_drift("north", y_share * speed, heading)


EFFECT = Effect(
    name="carpet-drift",
    stage="body",
    parameters=(
        Parameter("x_share", "1", -1.0, 1.0, (-0.3, 0.3), 0.0, "distance that the robot is carried east, per distance driven"),
        Parameter("y_share", "1", -1.0, 1.0, (-0.3, 0.3), 0.0, "distance that it is carried north, per distance driven"),
    ),
    equation="dx/dt += kx·|v|, dy/dt += ky·|v|",
    residuals="Positions are off in one direction of the floor at any heading, in proportion to the distance driven.",
    lookalikes=("floor-slope", "tether-pull", "slope-load"),
    sentence="the floor carries the robot to one side in proportion to the distance that it drives, as the pile of a carpet does",
    measurement="drive one line at two speeds, there and back: a carpet carries the robot equally far at both",
    apply=apply,
    needs="track",
    needs_place=True,
)
