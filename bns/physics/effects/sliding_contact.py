"""One point of the robot slides over the floor: a ball caster, a skid, something that it drags.

Friction F acts against that point's own velocity. With speed controllers of the gain k it takes f = F/(2·k) from the speed on a
straight line, and turns the robot towards the side on which it drags. In a curve the forward and the sideways part share one
force: a robot that turns is held less on its way ahead. A lag of the motors comes before: friction acts on what they drive.
"""

from __future__ import annotations

from itertools import product

from bns.physics.effect import Effect, Parameter
from bns.physics.signals import Wheels
from bns.physics.wheels.sliding import dragged


def apply(wheels: Wheels, friction_m_s: float, distance_share: float, left_share: float) -> Wheels:
    """The wheels' speeds with the friction of one sliding point."""
    return wheels.turning(*dragged(wheels.left_m_s, wheels.right_m_s, friction_m_s, distance_share, left_share))


EFFECT = Effect(
    name="sliding-contact",
    stage="wheel",
    parameters=(
        Parameter("friction_m_s", "m/s", 0.0, 1.0, (0.0, 0.1), 0.0, "speed lost on a straight line", size_power=1.0),
        Parameter(
            "distance_share",
            "1",
            0.1,  # two wheels and a point nearer to their axle do not carry a robot; there it would be a dead zone of both
            3.0,
            (0.15, 1.5),
            0.5,
            "how far behind or ahead of the axle the point slides, in wheelbases: friction is the same for both",
        ),
        Parameter(
            "left_share", "1", -3.0, 3.0, (-1.0, 1.0), 0.0, "how far to the left of the middle, in wheelbases (negative: right)"
        ),
    ),
    equation="v' = v - f·n1, omega' = omega + 4·f/b^2·(q·n1 + p·n2), n = c/|c| for the velocity c = (v' - q·omega', -p·omega') "
    "of a point p behind the axle and q to its left; it rests while less than f is needed",
    residuals="Slow motions fall short by a larger fraction than fast ones; straight lines less while the robot turns on its "
    "way, turns less while it drives ahead.",
    lookalikes=("dead-zone", "dead-zone-mismatch", "turn-dead-zone", "gear-friction"),
    sentence="something slides over the floor (a ball caster, a skid, what the robot drags) and holds the robot back",
    sized="one point of the robot slides over the floor and takes {friction_m_s} from the speed on a straight line",
    measurement="pull the robot over the floor with a spring balance, wheels lifted; or grease the point that slides and repeat "
    "some trials",
    apply=apply,
    starts=tuple(product((0.001, 0.005), (0.3, 0.8), (-0.2, 0.0, 0.2))),
)
