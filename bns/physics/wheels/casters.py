"""A swivel caster: which way it points, and what it does to the robot while it swings round."""

from __future__ import annotations

import numpy as np

from bns.engine.jit import exact, inline
from bns.physics.signals import CREEP_M_S, Array

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


@exact
def kept(ahead: Array, side: Array, yaw: Array, step_s: Array, trail: float, loss: float) -> Array:
    """The share of all velocities that a dragging caster leaves, 1 - ``loss``·(1 - cos(off))/2, as a mean over each step.

    ``ahead``, ``side``: the velocity of its hinge without that loss, in the robot's frame. ``off``: the angle from the way that
    the caster points to the one that its hinge moves, d(off)/dt = yaw - speed·sin(off)/trail, all of these velocities as they are
    with the loss; from a caster that trails straight behind. One that points exactly backwards would stay so on straight lines,
    if floors were even: it counts as 2·`_ASIDE` aside. Over the way off obeys a linear equation (`swivelled`), exactly;
    the way itself, which the loss shortens, follows by Simpson's rule in parts of `_PART` trails.
    """
    out = np.ones_like(ahead)
    for row in range(ahead.shape[0]):
        psi = 0.0
        for k in range(ahead.shape[1]):
            speed, omega, h = np.hypot(ahead[row, k], side[row, k]), yaw[row, k], step_s[row, k]
            if h == 0.0 or speed <= CREEP_M_S:
                continue
            beta, rate = np.arctan2(side[row, k], ahead[row, k]), speed / trail
            y, x = np.sin((beta - psi) / 2.0), np.cos((beta - psi) / 2.0)
            if abs(x) < _ASIDE:
                y, x = _unit(y, _ASIDE if x >= 0.0 else -_ASIDE)
            square = rate * rate - omega * omega
            parts = min(max(int(np.ceil(rate * h / _PART)), 1), _PARTS)
            if abs(omega - 2.0 * rate * y * x) < _SETTLED * rate and x > abs(y):  # points where it will go on pointing
                parts = 1
            step, share = h / parts, 0.0
            for _ in range(parts):
                now = 1.0 - loss * y * y
                mean = now
                for _ in range(_ROUNDS):
                    same, mixed = _half_step(square, mean * step / 2.0)
                    yy, yx, xx = same - mixed * rate / 2.0, mixed * omega / 2.0, same + mixed * rate / 2.0
                    y1, x1 = _unit(yy * y + yx * x, xx * x - yx * y)
                    y2, x2 = _unit(yy * y1 + yx * x1, xx * x1 - yx * y1)
                    mean = 6.0 / (1.0 / now + 4.0 / (1.0 - loss * y1 * y1) + 1.0 / (1.0 - loss * y2 * y2))
                y, x = y2, x2
                share += mean / parts
            out[row, k] = share
            psi = beta - 2.0 * np.arctan2(y, x)
    return out


_ASIDE = 0.005
"""Half of the least angle (rad) between a caster and straight backwards: half a degree, as wheels that scatter turn a robot."""
_PART = 0.5
"""Parts of a step in trails of the caster. With a half, and a loss of 0.8, metres of way are 0.02 mm wrong."""
_PARTS = 64
_SETTLED = 0.02
"""A caster is off the angle that it ends at by so little (rad) that the loss hardly changes within a step."""
_ROUNDS = 3
"""The loss in a part and the way in it depend on each other. With two rounds, the same way is 0.4 mm wrong."""


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
