"""A motor warms up with the way that it drives, gives less, and cools while it rests.

Warmth is counted in metres driven and not yet forgotten. It is carried on from trial to trial where the session's time is
known, by the trials at hand; else each trial begins cold.
"""

from __future__ import annotations

import numpy as np

from bns.physics.effect import Effect, Parameter
from bns.physics.signals import Array, Wheels
from bns.physics.wheels.scans import carried_on


def apply(wheels: Wheels, loss_per_m: float, cool_s: float) -> Wheels:
    """Each wheel's speed falls by ``loss_per_m`` of itself a metre of its warmth, which fades within ``cool_s``."""
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
            "loss_per_m", "1/m", 0.0, 2.0, (0.0, 0.3), 0.0, "share of speed lost a metre driven", size_power=-1.0
        ),
        Parameter("cool_s", "s", 1.0, 1e5, (3.0, 3000.0), 60.0, "time in which a motor cools", resolution=0.1),
    ),
    equation="dh/dt = |w| - h/cool, w' = w·(1 - k·h) for each wheel, h from trial to trial",
    residuals="Speeds fall with the way driven shortly before and recover in pauses; the busier wheel loses more.",
    lookalikes=("battery-sag", "warm-up", "speed-gain"),
    sentence="the motors become slower as they warm up with work",
    measurement="feel or log the motors' temperature, or repeat a trial after a rest of a few minutes",
    explained_by=("session_s",),
    caveat="No session_s was logged: how long the motors cooled between trials is taken as no time at all.",
    apply=apply,
    needs="track",
    starts=tuple((loss, cool) for cool in (5.0, 20.0, 60.0, 200.0) for loss in (0.005, 0.05)),
)
