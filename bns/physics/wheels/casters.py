"""A swivel caster: which way it points, and what its hinge's torque does to the robot."""

from __future__ import annotations

import numpy as np

from bns.engine.jit import exact
from bns.physics.signals import Array

SLOW_RAD_S = 0.1
"""A hinge that turns more slowly counts as partly at rest: a jump of its friction would be hard to fit."""


@exact
def swivelled(
    forward: Array,
    yaw: Array,
    step_s: Array,
    starts: Array,
    friction: float,
    damping: float,
    trail: float,
    pivot: float,
) -> tuple[Array, Array]:
    """Mean over each step of q·sin(psi) and q·(trail - pivot·cos(psi)) of a caster at psi from straight behind its hinge.

    It rolls where it points, from each of the angles ``starts``, of which the mean is returned: s = dpsi/dt =
    (yaw·pivot·cos(psi) - forward·sin(psi))/trail - yaw. q = ``friction``·s/(abs(s) + `SLOW_RAD_S`) + ``damping``·s. In a step
    of constant velocities tan(psi/2) solves a Riccati equation, so (sin(psi/2), cos(psi/2)) a linear one up to its length:
    the angle is exact, and so is the work of the damping. Dry friction is integrated by Simpson's rule.
    """
    pushed, turned = np.zeros_like(forward), np.zeros_like(forward)
    share = 1.0 / len(starts)
    half_s, half_c = np.empty(len(starts)), np.empty(len(starts))
    for row in range(forward.shape[0]):
        half_s[:], half_c[:] = np.sin(starts / 2.0), np.cos(starts / 2.0)
        for k in range(forward.shape[1]):
            h = step_s[row, k]
            if h == 0.0:
                continue
            omega, ahead, aside = yaw[row, k], forward[row, k] / trail, yaw[row, k] * pivot / trail
            same, mixed = _half_step(ahead * ahead + aside * aside - omega * omega, h / 2.0)
            # over half a step, sin and cos of psi/2 become these combinations of themselves, but for a common factor
            ss, sc = same - mixed * ahead / 2.0, mixed * (aside - omega) / 2.0
            cs, cc = mixed * (aside + omega) / 2.0, same + mixed * ahead / 2.0
            for i in range(len(starts)):
                y, x = half_s[i], half_c[i]
                for part in range(3):  # at the start, in the middle, at the end
                    if part > 0:
                        y, x = ss * y + sc * x, cs * y + cc * x
                        size = np.sqrt(y * y + x * x)
                        y, x = y / size, x / size
                    c, s = x * x - y * y, 2.0 * x * y
                    rate = aside * c - ahead * s - omega
                    dry = friction * rate / (abs(rate) + SLOW_RAD_S) * share * (4.0 if part == 1 else 1.0) / 6.0
                    pushed[row, k] += dry * s
                    turned[row, k] += dry * (trail - pivot * c)
                swing = 2.0 * np.arctan2(half_c[i] * y - half_s[i] * x, half_c[i] * x + half_s[i] * y)
                before_c, before_s = half_c[i] ** 2 - half_s[i] ** 2, 2.0 * half_c[i] * half_s[i]
                viscous = damping * share / h
                pushed[row, k] += viscous * (before_c - (x * x - y * y))
                turned[row, k] += viscous * (trail * swing - pivot * (2.0 * x * y - before_s))
                half_s[i], half_c[i] = y, x
    return pushed, turned


@exact
def _half_step(square: float, h: float) -> tuple[float, float]:
    """cosh(r·h) and sinh(r·h)/r, r = sqrt(``square``)/2, or cos and sin where the square is negative; both times e^(-r·h)."""
    r = np.sqrt(abs(square)) / 2.0
    if square < 0.0:
        return np.cos(r * h), np.sin(r * h) / r
    fallen = np.exp(-2.0 * r * h)
    return (1.0 + fallen) / 2.0, (-np.expm1(-2.0 * r * h) / (2.0 * r) if r > 0.0 else h)
