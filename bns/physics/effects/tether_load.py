"""A cable or a spring pulls on the robot's wheels: they grip, so that only the pull along the heading moves it.

The pull grows with the distance from the anchor. It acts at a point c ahead of the axle: what the wheels' grip takes up
across the heading turns the robot there. At rest a motor without friction yields as well; one with a gear that locks does
not.
"""

from __future__ import annotations

import numpy as np

from bns.physics.effect import Effect, Parameter
from bns.physics.signals import Body, Wheels
from bns.physics.wheels.loads import ANCHOR, AT_REST, guessed, pulled


def apply(
    body: Body,
    pull_per_s: float,
    anchor_x_m: float,
    anchor_y_m: float,
    free_m: float,
    ahead_share: float,
    at_rest: float,
) -> Body:
    """The part along the heading of a velocity towards the anchor, and a turn in proportion to the part across it."""
    if body.place is None:
        return body  # first round of a simulation: nobody knows yet where the robot goes
    x, y, heading = (body.place[..., i] for i in range(3))
    ahead_m = ahead_share * body.wheelbase_m
    east, north = anchor_x_m - x - ahead_m * np.cos(heading), anchor_y_m - y - ahead_m * np.sin(heading)
    length = np.maximum(np.hypot(east, north), 1e-9)
    pull = pull_per_s * np.maximum(length - free_m, 0.0) / length
    return pulled(body, body.place, pull * east, pull * north, ahead_share, at_rest)


def starts_from(wheels: Wheels) -> tuple[tuple[float, ...], ...]:
    """A pull fitted to pieces of the tracked trials, with motors that yield at rest and with such that do not."""
    found = guessed(wheels, anchored=True)
    if not found or found[2] <= 0.0:
        return ()
    east, north, fall, ahead_share = found
    return tuple((fall, east / fall, north / fall, 0.0, ahead_share, rest) for rest in (0.0, 1.0))


EFFECT = Effect(
    name="tether-load",
    stage="body",
    parameters=(
        Parameter(
            "pull_per_s", "1/s", 0.0, 5.0, (0.0, 0.5), 0.0, "speed per metre of distance from the anchor", resolution=1e-5
        ),
        *ANCHOR,
        Parameter(
            "free_m",
            "m",
            -100.0,
            100.0,
            (-100.0, 10.0),
            0.0,
            "length below which the cable is slack (negative: it pulls at the anchor, too, as a weight or a reel does)",
        ),
        Parameter(
            "ahead_share",
            "1",
            -3.0,
            3.0,
            (-1.5, 1.5),
            0.0,
            "how far ahead of the axle it is fixed (negative: behind), in wheelbases",
        ),
        AT_REST,
    ),
    equation="v += e·cos(theta) + n·sin(theta), omega += 4·(c/b)/b·(n·cos(theta) - e·sin(theta)), "
    "(e, n) = k·(1 - free/length)·(anchor - point c ahead of the axle)",
    residuals="The robot is faster towards one point of the floor and slower away from it; it is not carried sideways.",
    lookalikes=("tether-pull", "slope-load"),
    sentence="something pulls on the robot's wheels towards one point, as a cable or a spring does",
    measurement="repeat some trials with the cable unplugged or held up",
    beside={
        "slope-load": "A slope is a cable from far away: to tell them apart, drive over as much of the floor as there is, along "
        "the pull: the nearer its anchor, the less a cable pulls."
    },
    apply=apply,
    revision=2,
    needs="track",
    needs_place=True,
    starts_from=starts_from,
)
