"""A swivel caster: which way it points, and what its hinge's torque does to the robot."""

from __future__ import annotations

import numpy as np

from bns.engine.jit import exact, inline
from bns.physics.signals import Array

SLOW_RAD_S = 0.1
"""A hinge that turns more slowly counts as partly at rest: a jump of its friction would be hard to fit."""


_ONE_RAD = 1e-9
"""Casters that point the same way within this go on as one."""


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
    half_base: float,
) -> tuple[Array, Array]:
    """Mean over each step of q·sin(psi) and q·(trail - pivot·cos(psi)) of a caster at psi from straight behind its hinge.

    It rolls where it points, from each of the angles ``starts``, of which the mean is returned: s = dpsi/dt =
    (w·pivot·cos(psi) - v·sin(psi))/trail - w, with v = ``forward`` + q·sin(psi), w = ``yaw`` + q·(trail - pivot·cos(psi)) /
    ``half_base``² and q = ``friction``·s/(abs(s) + `SLOW_RAD_S`) + ``damping``·s. In half a step of constant v and w
    tan(psi/2) solves a Riccati equation, so (sin(psi/2), cos(psi/2)) a linear one up to its length; what q adds to v and w is
    the mean of both ends of the half. The work of the damping is exact, that of dry friction integrated by Simpson's rule.
    """
    pushed, turned = np.zeros_like(forward), np.zeros_like(forward)
    all_of = len(starts)
    ys, xs, values = np.empty(all_of), np.empty(all_of), (friction, damping, trail, pivot, half_base)
    for row in range(forward.shape[0]):
        ys[:], xs[:] = np.sin(starts / 2.0), np.cos(starts / 2.0)
        n = all_of
        for k in range(forward.shape[1]):
            h, v, w = step_s[row, k], forward[row, k], yaw[row, k]
            if h == 0.0:
                continue
            push = turn = 0.0
            for i in range(n):
                y0, x0 = ys[i], xs[i]
                y1, x1 = _half(y0, x0, v, w, h / 2.0, values)
                y2, x2 = _half(y1, x1, v, w, h / 2.0, values)
                c0, s0, q0 = _held(y0, x0, v, w, values)
                c1, s1, q1 = _held(y1, x1, v, w, values)
                c2, s2, q2 = _held(y2, x2, v, w, values)
                swing = 2.0 * _turned_by(x0 * y2 - y0 * x2, x0 * x2 + y0 * y2)
                push += (q0 * s0 + 4.0 * q1 * s1 + q2 * s2) / 6.0 + damping * (c0 - c2) / h
                lever = q0 * (trail - pivot * c0) + 4.0 * q1 * (trail - pivot * c1) + q2 * (trail - pivot * c2)
                turn += lever / 6.0 + damping * (trail * swing - pivot * (s2 - s0)) / h
                ys[i], xs[i] = y2, x2
            pushed[row, k], turned[row, k] = push / n, turn / n
            if n > 1 and _as_one(ys, xs):
                n = 1
    return pushed, turned


@exact
def _as_one(ys: Array, xs: Array) -> bool:
    """Whether all point the same way: by the sine of half the angle between each and the first."""
    return bool(np.abs(ys * xs[0] - xs * ys[0]).max() < _ONE_RAD)


@inline
def _held(y: float, x: float, v: float, w: float, values: tuple[float, ...]) -> tuple[float, float, float]:
    """Cosine and sine of psi, and the part of q that is dry friction."""
    cos, sin = x * x - y * y, 2.0 * x * y
    rate = _rate(cos, sin, v, w, values)
    return cos, sin, values[0] * rate / (abs(rate) + SLOW_RAD_S)


@inline
def _rate(cos: float, sin: float, v: float, w: float, values: tuple[float, ...]) -> float:
    """s, which is less than that of a free caster: what the hinge does to the robot turns the caster less. A square's root."""
    friction, damping, trail, pivot, half_base = values
    free = (w * pivot * cos - v * sin) / trail - w
    lever = (trail - pivot * cos) / half_base
    gives = (lever * lever + sin * sin) / trail
    whole = 1.0 + gives * damping
    less = whole * SLOW_RAD_S + gives * friction - abs(free)
    root = np.sqrt(less * less + 4.0 * whole * abs(free) * SLOW_RAD_S)
    size = 2.0 * abs(free) * SLOW_RAD_S / (less + root) if less > 0.0 else (root - less) / (2.0 * whole)
    return size if free > 0.0 else -size


@inline
def _half(y: float, x: float, v: float, w: float, h: float, values: tuple[float, ...]) -> tuple[float, float]:
    """Sine and cosine of psi/2 after half a step: with what q adds at its beginning, and again with the mean of both ends."""
    trail, pivot = values[2], values[3]
    ahead, turn = _added(y, x, v, w, values)
    y1, x1 = _rolled(y, x, v + ahead, w + turn, h, trail, pivot)
    then_ahead, then_turn = _added(y1, x1, v, w, values)
    return _rolled(y, x, v + (ahead + then_ahead) / 2.0, w + (turn + then_turn) / 2.0, h, trail, pivot)


@inline
def _added(y: float, x: float, v: float, w: float, values: tuple[float, ...]) -> tuple[float, float]:
    friction, damping, trail, pivot, half_base = values
    cos, sin = x * x - y * y, 2.0 * x * y
    rate = _rate(cos, sin, v, w, values)
    q = friction * rate / (abs(rate) + SLOW_RAD_S) + damping * rate
    return q * sin, q * (trail - pivot * cos) / (half_base * half_base)


@inline
def _rolled(y: float, x: float, v: float, w: float, h: float, trail: float, pivot: float) -> tuple[float, float]:
    """Sine and cosine of psi/2 after a time of constant velocities: combinations of themselves, but for a common factor."""
    ahead, aside = v / trail, w * pivot / trail
    same, mixed = _half_step(ahead * ahead + aside * aside - w * w, h)
    return _unit(
        (same - mixed * ahead / 2.0) * y + mixed * (aside - w) / 2.0 * x,
        mixed * (aside + w) / 2.0 * y + (same + mixed * ahead / 2.0) * x,
    )


@inline
def _unit(y: float, x: float) -> tuple[float, float]:
    size = 1.0 / np.sqrt(y * y + x * x)
    return y * size, x * size


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
