"""A cable pulls the driving robot towards its anchor."""

from __future__ import annotations

import math
from dataclasses import replace

from bns.physics.effect import Effect, Parameter
from bns.physics.signals import Flow
from bns.physics.wheels.loads import ANCHOR


def apply(flow: Flow, pull_per_s: float, anchor_x_m: float, anchor_y_m: float) -> Flow:
    """A velocity towards the anchor in proportion to the distance, while the wheels turn."""
    return replace(
        flow,
        x_m_s=flow.x_m_s + pull_per_s * anchor_x_m,
        y_m_s=flow.y_m_s + pull_per_s * anchor_y_m,
        return_per_s=flow.return_per_s + pull_per_s,
    )


def _starts() -> tuple[tuple[float, ...], ...]:
    """Anchors near and far in all directions, each pulling a robot at the origin at a few millimetres per second."""
    return tuple(
        (speed / far, far * math.cos(eighth * math.pi / 4), far * math.sin(eighth * math.pi / 4))
        for far in (1.0, 3.0, 10.0, 40.0)
        for eighth in range(8)
        for speed in (1e-3, 5e-3)
    )


EFFECT = Effect(
    name="tether-pull",
    stage="world",
    parameters=(
        Parameter(
            "pull_per_s",
            "1/s",
            0.0,
            5.0,
            (0.0, 0.5),
            0.0,
            "drift velocity per metre of distance from the anchor",
            resolution=2e-6,  # from 100 m away it moves the robot by 0.2 mm/s, as a step of a slope does
        ),
        *ANCHOR,
    ),
    equation="dx/dt += k·(ax - x), dy/dt += k·(ay - y) while moving",
    residuals="Positions are off towards one point; the error grows with the distance from it.",
    lookalikes=("floor-slope",),
    sentence="something pulls the robot towards one point, as a cable does",
    measurement="repeat some trials with the cable unplugged or held up",
    revision=2,
    apply=apply,
    needs="track",
    starts=_starts(),
)
