"""The tyres slip: friction with the floor limits the acceleration of the robot, however fast its wheels turn.

A wheel that carries the load N pushes the robot with at most mu·N. On a straight line both wheels move the mass m, in a turn on
the spot the moment of inertia J. With the wheelbase b the limits of what the robot moves at a wheel are 2·mu·N/m, which is mu·g
where the wheels carry the whole robot, and mu·N·b^2/(2·J). What is limited are the speeds that the wheels have after their lag:
they are there already while the robot still follows. Before a lag the same limit is one of the motors: `force-limit`.
"""

from __future__ import annotations

import math

import numpy as np

from bns.physics.effect import Effect
from bns.physics.effects.force_limit import EFFECT as FORCE_LIMIT
from bns.physics.signals import Array, Wheels
from bns.physics.wheels.scans import limited_together

PARTS = 4
"""Of a step, in each of which the wheels' speed is taken as constant."""


def apply(wheels: Wheels, max_m_s2: float, turn_ratio: float) -> Wheels:
    """The robot gains at most ``max_m_s2`` on its wheels in one direction, ``turn_ratio`` times that in opposite ones."""
    if not math.isfinite(max_m_s2):
        return wheels
    limits = max_m_s2, turn_ratio * max_m_s2
    if wheels.followed is None:  # nothing lags: commands, which are constant in a step
        return wheels.turning(*limited_together(wheels.left_m_s, wheels.right_m_s, wheels.step_s, *limits))
    step_s = np.repeat(wheels.step_s / PARTS, PARTS, axis=-1)
    both = [_in_parts(side, wheels.step_s) for side in (wheels.left_m_s, wheels.right_m_s)]
    (_, left_m_s2), (_, right_m_s2) = both
    allowed = _allowed(left_m_s2 * right_m_s2, *limits)
    told = (side + _ahead(rise, allowed, step_s) for side, rise in both)
    return wheels.turning(*(_mean(side) for side in limited_together(*told, step_s, *limits)))


def _in_parts(speed_m_s: Array, step_s: Array) -> tuple[Array, Array]:
    """Speeds in the parts of steps, (batch, PARTS·steps), along a line through each step, with its mean; and how steep each is.

    As steep as from one neighbour to the other, at most twice as steep as towards either, and level where one lies above and one
    below (van Leer 1977, J. Comput. Phys. 23:276, doi:10.1016/0021-9991(77)90095-X): a jump stays a jump, and a ramp a ramp.
    """
    share = (np.arange(PARTS) + 0.5) / PARTS - 0.5
    between_s = np.maximum(step_s[..., 1:] + step_s[..., :-1], 1e-12) / 2.0
    begun = speed_m_s[..., :1] / np.maximum(step_s[..., :1], 1e-12)  # from rest
    rise = np.concatenate([begun, np.diff(speed_m_s, axis=-1) / between_s, np.zeros_like(begun)], axis=-1)
    before, after = rise[..., :-1], rise[..., 1:]
    steep = np.minimum(2.0 * np.minimum(np.abs(before), np.abs(after)), np.abs(before + after) / 2.0)
    slope = np.where(before * after > 0.0, np.sign(before) * steep, 0.0)
    parts: Array = speed_m_s[..., None] + (slope * step_s)[..., None] * share
    return parts.reshape(*speed_m_s.shape[:-1], -1), np.repeat(slope, PARTS, axis=-1)


def _allowed(together: Array, straight: float, turning: float) -> Array:
    """The limit of a wheel's acceleration, by the product of those of both (m/s^2), as `limited_together` has it."""
    alone = 2.0 * straight * turning / (straight + turning)
    out: Array = np.where(together > 0.0, straight, np.where(together < 0.0, turning, alone))
    return out


def _ahead(rise_m_s2: Array, allowed_m_s2: Array, step_s: Array) -> Array:
    """By how much a part is told more than its mean: what is told at once is reached as late as the limit has it."""
    out: Array = rise_m_s2 * np.minimum(np.abs(rise_m_s2) / allowed_m_s2, 1.0) * step_s / 2.0
    return out


def _mean(parts: Array) -> Array:
    """Of the parts of each step."""
    out: Array = parts.reshape(*parts.shape[:-1], -1, PARTS).mean(axis=-1)
    return out


EFFECT = Effect(
    name="traction-limit",
    stage="wheel",
    parameters=FORCE_LIMIT.parameters,
    equation="as force-limit, of the speeds w that the wheels have after their lag: |dv/dt| <= a where both change in one "
    "direction, r·a in opposite ones",
    residuals="As with a limit of the motors' force, and a start from rest is later by the motors' lag, but the end of each ramp "
    "is not.",
    lookalikes=("force-limit", "acceleration-limit", "motor-lag"),
    sentence="the tyres slip while the robot speeds up or brakes: friction with the floor limits its acceleration",
    sized="the tyres slip while the robot speeds up or brakes: friction with the floor limits its acceleration to {max_m_s2} on "
    "straight lines; in turns the limit is {turn_ratio:higher|lower}",
    measurement="log the wheels' own speeds (encoders) while a command changes: wheels that slip turn faster than the robot "
    "drives",
    apply=apply,
    needs="track",
    extends=FORCE_LIMIT.name,
    contains=("acceleration-limit",),
)
