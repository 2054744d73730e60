"""A command reaches the wheels some time after it was given."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from bns.physics.effect import Effect, Parameter
from bns.physics.signals import Array, Wheels


def apply(wheels: Wheels, delay_s: float) -> Wheels:
    """Each wheel's speed, ``delay_s`` later, averaged over each step: the distance driven is exact."""
    nodes = np.pad(np.cumsum(wheels.step_s, axis=1), ((0, 0), (1, 0)))
    return replace(
        wheels,
        left_m_s=_late(wheels.left_m_s, wheels.step_s, nodes, delay_s),
        right_m_s=_late(wheels.right_m_s, wheels.step_s, nodes, delay_s),
    )


def _late(speed: Array, step_s: Array, nodes_s: Array, delay_s: float) -> Array:
    way = np.pad(np.cumsum(speed * step_s, axis=1), ((0, 0), (1, 0)))
    late = np.stack([np.interp(t - delay_s, t, w) for t, w in zip(nodes_s, way, strict=True)])
    return np.divide(np.diff(late, axis=1), step_s, out=np.zeros_like(speed), where=step_s > 0)


EFFECT = Effect(
    name="command-delay",
    stage="wheel",
    parameters=(Parameter("delay_s", "s", 0.0, 5.0, (0.0, 1.0), 0.0, "time from giving a command to its effect"),),
    equation="u'(t) = u(t - delay), 0 before the first command",
    residuals="Every command drives the end of the one before first: errors follow the change of "
    "speed between commands, and are the same for commands of any duration above the "
    "delay.",
    lookalikes=("motor-lag", "acceleration-limit"),
    apply=apply,
    rank=70,
)
