"""A caster drags until it has swung round behind its hinge, as a wheel does that rolls where it points.

`caster-swing` is simpler: there the caster turns with the way alone, by the same share of its angle in each centimetre.

The direction of the caster at the start of a trial is not logged: it is assumed to be that after driving forward.
"""

from __future__ import annotations

import numpy as np

from bns.physics.effect import Effect, Parameter
from bns.physics.signals import Body
from bns.physics.wheels.casters import kept


def apply(body: Body, loss: float, trail_m: float, pivot_m: float) -> Body:
    """All velocities times 1 - ``loss`` while the caster points backwards; its wheel runs ``trail_m`` behind the hinge.

    The hinge is ``pivot_m`` ahead of the axle, behind it where that is negative.
    """
    ahead, turn = (body.left_m_s + body.right_m_s) / 2.0, (body.right_m_s - body.left_m_s) / body.wheelbase_m
    step_s = np.diff(body.session_s, axis=1, prepend=body.session_s[:, :1]) if body.step_s is None else body.step_s
    return body.scaled(kept(ahead, turn * pivot_m, turn, step_s, trail_m, loss)) if loss else body


EFFECT = Effect(
    name="caster-trail",
    stage="body",
    parameters=(
        Parameter("loss", "1", 0.0, 0.95, (0.0, 0.8), 0.0, "fraction of speed lost while the caster points backwards"),
        Parameter("trail_m", "m", 5e-4, 1.0, (1e-3, 0.3), 0.02, "from the hinge to the caster's wheel", size_power=1.0),
        Parameter("pivot_m", "m", -2.0, 2.0, (-0.2, 0.2), 0.0442, "from the axle forward to the hinge", size_power=1.0),
    ),
    equation="d(psi)/dt = u·sin(beta - psi)/trail - omega, (u, beta): speed and direction of the hinge, (v, omega·p); "
    "all velocities times 1 - k·(1 - cos(beta - psi))/2",
    residuals="After each change between forward, backward and turning on the spot, the robot is too slow for a "
    "few centimetres; long commands of one kind fit.",
    lookalikes=("caster-swing", "caster-drag", "backlash", "motor-lag"),
    sentence="the caster slows the robot until it trails behind its hinge again",
    measurement="film the caster after a reversal, or replace it with a sliding button and repeat some trials",
    apply=apply,
    revision=2,
    needs="track",
    starts=tuple(
        (loss, trail, pivot) for pivot in (0.0442, -0.0442) for loss in (0.1, 0.4) for trail in (0.005, 0.012, 0.03, 0.06)
    ),
)
