"""On a slope gravity speeds the wheels up downhill and slows them down uphill; they grip, so the robot does not slip
sideways.

Gravity m·g·sin(alpha) acts at the robot's centre of mass, a distance c behind the axle. Along the heading it changes the
speed that a proportional speed controller, or an uncontrolled motor, holds; across it the wheels' grip takes it up, and c
gives a torque that turns the robot. At rest a motor without friction yields as well; one with a gear that locks does not.
"""

from __future__ import annotations

from bns.physics.effect import Effect, Parameter
from bns.physics.signals import Body, Wheels
from bns.physics.wheels.loads import AT_REST, guessed, pulled


def apply(body: Body, x_m_s: float, y_m_s: float, behind_share: float, at_rest: float) -> Body:
    """The part of the downhill velocity along the heading, and a turn in proportion to the part across it."""
    if body.place is None:
        return body  # first round of a simulation: nobody knows yet where the robot heads
    return pulled(body, body.place, x_m_s, y_m_s, -behind_share, at_rest)


def starts_from(wheels: Wheels) -> tuple[tuple[float, ...], ...]:
    """A slope fitted to pieces of the tracked trials, with motors that yield at rest and with such that do not."""
    found = guessed(wheels, anchored=False)
    return tuple((found[0], found[1], -found[3], rest) for rest in (0.0, 1.0)) if found else ()


EFFECT = Effect(
    name="slope-load",
    stage="body",
    parameters=(
        Parameter("x_m_s", "m/s", -1.0, 1.0, (-0.1, 0.1), 0.0, "downhill speed, part to the east", size_power=1.0),
        Parameter("y_m_s", "m/s", -1.0, 1.0, (-0.1, 0.1), 0.0, "downhill speed, part to the north", size_power=1.0),
        Parameter(
            "behind_share",
            "1",
            -1.5,
            1.5,
            (-1.0, 1.0),
            0.0,
            "centre of mass behind the axle (negative: ahead of it), in wheelbases",
        ),
        AT_REST,
    ),
    equation="v += sx·cos(theta) + sy·sin(theta), omega -= 4·(c/b)/b·(sy·cos(theta) - sx·sin(theta))",
    residuals="The robot is faster in one direction of the floor and slower in the opposite one; it is not carried sideways.",
    lookalikes=("floor-slope", "tether-load"),
    sentence="the robot is faster downhill and slower uphill, on wheels that do not slip sideways",
    measurement="lay a spirit level on the floor, in two directions",
    apply=apply,
    revision=2,
    needs="track",
    needs_place=True,
    starts_from=starts_from,
)
