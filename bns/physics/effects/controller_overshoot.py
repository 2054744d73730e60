"""The wheels' speed controllers overshoot: a speed swings about a new command before it settles.

A controller with a proportional and an integral part (gains P and I), on a motor with the gain K and the time constant T, obeys
swing²·w'' + (tau + lead)·w' + w = u + lead·u' with lead = P/I, tau = 1/(K·I) and swing² = T/(K·I). The undamped swing has the
frequency 1/(2·pi·swing), its damping ratio is (tau + lead)/(2·swing); without a lead it is any drive of the second order.
T, and so swing², grows with the mass that the wheels move. That is the robot's mass on a straight line and a part of its moment
of inertia in a turn on the spot (as in `inertia-lag`): the mean of the wheels and their difference swing by themselves.
Without a swing and a lead it is `motor-lag`.
"""

from __future__ import annotations

import math
from collections.abc import Mapping

import numpy as np

from bns.physics.effect import Effect, Parameter
from bns.physics.signals import Array, Wheels
from bns.physics.wheels.scans import second_order


def apply(wheels: Wheels, tau_s: float, lead_s: float, swing_s: float, turn_ratio: float) -> Wheels:
    """The answer of the second order of the wheels' mean and of half their difference, from rest."""

    def answer(values: Array, swinging_s: float = swing_s) -> Array:
        return second_order(values, wheels.step_s, tau_s, lead_s, swinging_s)

    def late(values: Array) -> Array:
        return np.clip(answer(values), 0.0, 1.0)  # a robot that overshoots moves no more than one that moves

    mean = answer((wheels.left_m_s + wheels.right_m_s) / 2)
    half = answer((wheels.right_m_s - wheels.left_m_s) / 2, swing_s * math.sqrt(turn_ratio))
    return wheels.following(mean - half, mean + half, late)


def sized_by(values: Mapping[str, float]) -> str:
    """On a swing, that is a resonance (damping ratio below 1/sqrt(2)), of straight lines, turns, or both."""
    said, on_lines_s = [], values["swing_s"]
    for where, swing_s in (("on straight lines", on_lines_s), ("in turns", on_lines_s * math.sqrt(values["turn_ratio"]))):
        damping = (values["tau_s"] + values["lead_s"]) / (2.0 * swing_s) if swing_s > 0.0 else math.inf
        if damping < math.sqrt(0.5):
            hertz = 1.0 / (2.0 * math.pi * swing_s)
            said.append(f"{where} with a natural frequency of {hertz:.2g} Hz and a damping ratio of {damping:.2g}")
    if not said:
        return ""
    return f"the wheels answer a command as a drive of the second order does, and swing before they settle: {', '.join(said)}"


EFFECT = Effect(
    name="controller-overshoot",
    stage="wheel",
    parameters=(
        Parameter(
            "tau_s", "s", 0.0, 5.0, (0.0, 1.0), 0.0, "how late the way is at a steady command, in the end", reached=(0.0,)
        ),
        Parameter(
            "lead_s", "s", 0.0, 5.0, (0.0, 1.0), 0.0, "proportional gain, divided by the integral gain", reached=(0.0,)
        ),
        Parameter("swing_s", "s", 0.0, 5.0, (0.0, 0.5), 0.0, "period of the undamped swing on lines, divided by 2·pi"),
        Parameter(
            "turn_ratio", "1", 0.02, 20.0, (0.1, 5.0), 1.0, "inertia that the wheels move in turns, divided by that on lines"
        ),
    ),
    equation="swing²·m'' + (tau + lead)·m' + m = M + lead·M' for the mean m of the wheels (M: of their commands), and with "
    "r·swing² for their difference",
    residuals="After a change of the command the speed goes beyond the new one and comes back; what was lost at first is partly "
    "made up for.",
    lookalikes=("motor-lag", "clock-offset", "command-delay"),
    sentence="the wheels answer a command in two stages, as a drive of the second order does, and may swing before they settle",
    sized_by=sized_by,
    measurement="log the wheels' own speeds (encoders) at a high rate while a command changes, ahead and on the spot",
    explained_by=("wheel_left_m_s", "wheel_right_m_s"),
    caveat="controller-overshoot: a marker on a mast that swings answers in the same way, and without a swing firmware that "
    "averages its commands does. Hold the mast, or log the wheels' own speeds (columns wheel_left_m_s and wheel_right_m_s), to "
    "find out which of them it is.",
    apply=apply,
    starts=tuple((0.0, lead, swing, 1.0) for swing in (0.04, 0.1, 0.25) for lead in (swing, 2.0 * swing)),
    needs="track",
    extends="motor-lag",
)
