"""A controller cuts its command off to a whole number of steps, as a program that stores a speed as an integer does.

Where it rounds to the nearest one instead: `command-quantisation`.
"""

from __future__ import annotations

import numpy as np

from bns.physics.effect import Effect, Parameter
from bns.physics.effects.command_quantisation import STEP, best_steps
from bns.physics.signals import Array, Wheels


def apply(wheels: Wheels, step_m_s: float, share: float) -> Wheels:
    """Each wheel's speed moved by the fraction ``share`` towards the next multiple of ``step_m_s`` that is nearer to 0."""
    return wheels.turning(_moved(wheels.left_m_s, step_m_s, share), _moved(wheels.right_m_s, step_m_s, share))


def _moved(speed: Array, step: float, share: float) -> Array:
    return speed + share * (_cut(speed, step) - speed)


def _cut(speed: Array, step: Array | float) -> Array:
    out: Array = step * np.trunc(speed / step * (1.0 + _EXACT))
    return out


def starts_from(wheels: Wheels) -> tuple[tuple[float, ...], ...]:
    """The steps that explain most of what was tracked."""
    return best_steps(wheels, _cut)


_EXACT = 1e-9
"""A speed of a whole number of steps is that number, though the quotient is rounded."""

EFFECT = Effect(
    name="command-truncation",
    stage="wheel",
    parameters=(
        STEP,
        Parameter("share", "1", 0.0, 2.0, (0.5, 1.5), 0.0, "fraction of what is cut off that acts (1: all)"),
    ),
    equation="u' = u + a·(step·trunc(u/step) - u) for each wheel, a = 1",
    residuals="The robot is too slow by up to a step, by half a step on average; equally for equal commands.",
    lookalikes=("dead-zone", "command-quantisation"),
    sentence="the controller cuts wheel speeds off to multiples of a coarse step",
    sized="the controller cuts wheel speeds off to multiples of {step_m_s}",
    measurement="lift the robot, raise one wheel's command slowly, log its encoder: its speed rises in steps, each where the "
    "command reaches it",
    apply=apply,
    needs="track",
    starts_from=starts_from,
)
