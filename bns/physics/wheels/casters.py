"""A swivel caster: which way it points, and what its hinge's torque does to the robot."""

from __future__ import annotations

import numpy as np

from bns.engine.jit import exact, inline
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
    share, n = 1.0 / len(starts), len(starts)
    half_s, half_c, push, turn = np.empty(n), np.empty(n), np.empty(n), np.empty(n)
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
            dry, viscous = friction * share / 6.0, damping * share / h
            for i in range(n):  # no branch and no call: done for several at once
                y0, x0 = half_s[i], half_c[i]
                y1, x1 = _unit(ss * y0 + sc * x0, cs * y0 + cc * x0)
                y2, x2 = _unit(ss * y1 + sc * x1, cs * y1 + cc * x1)
                c0, c1, c2 = x0 * x0 - y0 * y0, x1 * x1 - y1 * y1, x2 * x2 - y2 * y2
                s0, s1, s2 = 2.0 * x0 * y0, 2.0 * x1 * y1, 2.0 * x2 * y2
                q0 = dry * _dry(aside * c0 - ahead * s0 - omega)
                q1 = dry * _dry(aside * c1 - ahead * s1 - omega) * 4.0
                q2 = dry * _dry(aside * c2 - ahead * s2 - omega)
                swing = 2.0 * _turned_by(x0 * y2 - y0 * x2, x0 * x2 + y0 * y2)
                push[i] = q0 * s0 + q1 * s1 + q2 * s2 + viscous * (c0 - c2)
                dragged = q0 * (trail - pivot * c0) + q1 * (trail - pivot * c1) + q2 * (trail - pivot * c2)
                turn[i] = dragged + viscous * (trail * swing - pivot * (s2 - s0))
                half_s[i], half_c[i] = y2, x2
            for i in range(n):
                pushed[row, k] += push[i]
                turned[row, k] += turn[i]
    return pushed, turned


@inline
def _unit(y: float, x: float) -> tuple[float, float]:
    size = 1.0 / np.sqrt(y * y + x * x)
    return y * size, x * size


@inline
def _dry(rate: float) -> float:
    return rate / (abs(rate) + SLOW_RAD_S)


@inline
def _turned_by(sine: float, cosine: float) -> float:
    """The angle (rad, from -pi to pi) of a sine and cosine: halved three times, and then the series of the arc tangent."""
    t = sine / max(1.0 + cosine, 1e-12)
    t /= 1.0 + np.sqrt(1.0 + t * t)
    t /= 1.0 + np.sqrt(1.0 + t * t)
    q = t * t
    series = 1 / 17 - q * (1 / 19 - q * (1 / 21 - q / 23))
    series = 1 / 9 - q * (1 / 11 - q * (1 / 13 - q * (1 / 15 - q * series)))
    return 8.0 * t * (1 - q * (1 / 3 - q * (1 / 5 - q * (1 / 7 - q * series))))


@exact
def _half_step(square: float, h: float) -> tuple[float, float]:
    """cosh(r·h) and sinh(r·h)/r, r = sqrt(``square``)/2, or cos and sin where the square is negative; both times e^(-r·h)."""
    r = np.sqrt(abs(square)) / 2.0
    if square < 0.0:
        return np.cos(r * h), np.sin(r * h) / r
    fallen = np.exp(-2.0 * r * h)
    return (1.0 + fallen) / 2.0, (-np.expm1(-2.0 * r * h) / (2.0 * r) if r > 0.0 else h)
