"""Motors stop when no new command has come for a while: a watchdog of the drive or of its driver.

`diff_drive_controller` of ROS has one (``cmd_vel_timeout``), and so have many motor boards. It counts from the last change of
a wheel's command in the log. A program that repeats its command keeps the robot going, and such repetitions are not logged:
then nothing of this shows.
"""

from __future__ import annotations

import math

from bns.physics.effect import Effect, Parameter
from bns.physics.signals import Wheels
from bns.physics.wheels.standing import timed_out


def apply(wheels: Wheels, timeout_s: float) -> Wheels:
    """Both wheels stand from ``timeout_s`` after the last change of either command to the next change."""
    if not math.isfinite(timeout_s):
        return wheels
    return wheels.turning(*timed_out(wheels.left_m_s, wheels.right_m_s, wheels.step_s, timeout_s))


EFFECT = Effect(
    name="command-timeout",
    stage="wheel",
    parameters=(
        Parameter("timeout_s", "s", 1e-2, math.inf, (0.1, 10.0), math.inf, "time after a command at which the motors stop"),
    ),
    equation="u' = u until T after the last change of u_l or u_r, then 0",
    residuals="Commands that last longer than a certain time are driven for that time only; shorter ones fit.",
    lookalikes=("acceleration-limit", "command-rate"),
    sentence="the robot stops when it gets no new command for a while",
    sized="the robot stops {timeout_s} after its last new command",
    measurement="give one command and time how long the robot drives; look for a timeout in the settings of its driver",
    apply=apply,
    needs="track",
)
