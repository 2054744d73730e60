"""The two wheels differ in diameter, so that the robot drifts to one side when it should drive straight."""

from __future__ import annotations

from dataclasses import replace

from bns.physics.effect import Effect, Parameter
from bns.physics.signals import Wheels


def apply(wheels: Wheels, ratio: float) -> Wheels:
    """Left times 2/(1 + ratio), right times 2·ratio/(1 + ratio): equal commands keep their mean speed."""
    share = 2.0 / (1.0 + ratio)
    return replace(wheels, left_m_s=wheels.left_m_s * share, right_m_s=wheels.right_m_s * share * ratio)


EFFECT = Effect(
    name="wheel-mismatch",
    stage="wheel",
    parameters=(Parameter("ratio", "1", 0.5, 2.0, (0.8, 1.25), 1.0, "right wheel diameter divided by left"),),
    equation="l' = l·2/(1 + m), r' = r·2·m/(1 + m)",
    residuals="The heading drifts to one side in proportion to the distance driven, also in "
    "straight commands; it drifts back in reverse.",
    lookalikes=("yaw-bias",),
    sentence="the wheels differ in diameter",
    sized="the right wheel's diameter is {ratio:larger|smaller} than the left one's",
    measurement="measure both wheels' circumferences",
    apply=apply,
)
