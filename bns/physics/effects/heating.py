"""A motor warms up with the distance that it drives, becomes slower, and cools while it rests.

The heat is counted in metres driven and decays exponentially. Where the session's time is logged, it carries over from
trial to trial; otherwise each trial begins cold.
"""

from __future__ import annotations

import numpy as np

from bns.physics.effect import Effect, Parameter
from bns.physics.signals import Array, Wheels
from bns.physics.wheels.scans import carried_on


def apply(wheels: Wheels, loss_per_m: float, cool_s: float) -> Wheels:
    """Each wheel's speed falls by the fraction ``loss_per_m`` per metre of heat, which decays with ``cool_s``."""
    left, right = (_kept(wheels, speed, loss_per_m, cool_s) for speed in (wheels.left_m_s, wheels.right_m_s))
    return wheels.turning(wheels.left_m_s * left, wheels.right_m_s * right)


def _kept(wheels: Wheels, speed: Array, loss_per_m: float, cool_s: float) -> Array:
    warmth = carried_on(np.abs(speed), wheels.step_s, wheels.conditions.session_s, cool_s)
    kept: Array = np.maximum(1.0 - loss_per_m * warmth, 0.0)
    return kept


EFFECT = Effect(
    name="heating",
    stage="wheel",
    parameters=(
        Parameter(
            "loss_per_m", "1/m", 0.0, 2.0, (0.0, 0.3), 0.0, "fraction of speed lost per metre driven", size_power=-1.0
        ),
        Parameter("cool_s", "s", 1.0, 1e5, (3.0, 3000.0), 60.0, "time constant of cooling", resolution=0.1),
    ),
    equation="dh/dt = |w| - h/cool, w' = w·(1 - k·h) for each wheel, h carried over between trials",
    residuals="Speeds fall with the distance driven shortly before and recover in pauses; the wheel that drove more loses more.",
    lookalikes=("battery-sag", "warm-up", "speed-gain"),
    sentence="the motors become slower as they warm up",
    measurement="log the motors' temperature, or repeat a trial after a pause of a few minutes",
    explained_by=("session_s",),
    caveat="No session_s was logged: the pauses between trials, in which the motors cool, are assumed to be zero.",
    apply=apply,
    needs="track",
    starts=tuple((loss, cool) for cool in (5.0, 20.0, 60.0, 200.0) for loss in (0.005, 0.05)),
)
