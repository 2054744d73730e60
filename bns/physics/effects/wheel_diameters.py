"""The two wheels differ in diameter: the motors' limits act on how fast they turn, and the diameters on what comes of it.

`wheel-mismatch` scales the commands instead. Without limits, dead zones and the like both are the same.
"""

from __future__ import annotations

from bns.physics.effect import Effect
from bns.physics.effects.wheel_mismatch import EFFECT as OF_COMMANDS

EFFECT = Effect(
    name="wheel-diameters",
    stage="wheel",
    parameters=OF_COMMANDS.parameters,
    equation="l' = l·2/(1 + m), r' = r·2·m/(1 + m), behind the limits of the motors",
    residuals="As with wheel-mismatch, and the robot also drifts to one side while both motors are at a limit.",
    lookalikes=("wheel-mismatch", "yaw-bias"),
    sentence="the wheels differ in diameter, and their motors are limited alike",
    sized="the right wheel's diameter is {ratio:larger|smaller} than the left one's, and their motors are limited alike",
    measurement="measure both wheels' circumferences",
    apply=OF_COMMANDS.apply,
    extends="wheel-mismatch",
)
