"""A controller can set only certain speeds: whole encoder counts per cycle, or whole percents of its voltage."""

from __future__ import annotations

import numpy as np

from bns.physics.effect import Effect, Parameter
from bns.physics.signals import Array, Wheels


def apply(wheels: Wheels, step_m_s: float, share: float) -> Wheels:
    """Each wheel's speed moved by the fraction ``share`` towards the nearest multiple of ``step_m_s``."""
    return wheels.turning(
        _rounded(wheels.left_m_s, step_m_s, share),
        _rounded(wheels.right_m_s, step_m_s, share),
    )


def _rounded(speed: Array, step: float, share: float) -> Array:
    out: Array = speed + share * (step * np.rint(speed / step) - speed)
    return out


EFFECT = Effect(
    name="command-quantisation",
    stage="wheel",
    parameters=(
        Parameter(
            "step_m_s",
            "m/s",
            1e-4,
            2.0,
            (1e-3, 0.5),
            0.02,
            "difference between neighbouring speeds",
            resolution=2e-5,
            jagged=True,
        ),
        Parameter("share", "1", 0.0, 2.0, (0.5, 1.5), 0.0, "fraction of the rounding that acts (1: all)"),
    ),
    equation="u' = u + a·(step·round(u/step) - u) for each wheel, a = 1",
    residuals="The error depends on the command alone: positive or negative, up to half a step, and equal for equal commands.",
    lookalikes=("dead-zone",),
    sentence="the wheels can run only at speeds in coarse steps",
    sized="the wheels can run only at speeds in steps of {step_m_s}",
    measurement="lift the robot, raise one wheel's command slowly, log its encoder: its speed rises in steps",
    apply=apply,
    needs="track",
    # the loss has as many valleys as there are steps below the fastest command: makers choose round numbers
    starts=tuple((step, 1.0) for step in (0.005, 0.008, 0.01, 0.016, 0.02, 0.025, 0.03, 0.04, 0.05, 0.08, 0.1, 0.2)),
)
