"""A swivel caster: which way it points, and what its hinge's torque does to the robot."""

from __future__ import annotations

import numpy as np

from bns.engine.jit import exact, inline, smaller
from bns.physics.signals import Array

SLOW_RAD_S = 0.1
"""A hinge that turns more slowly counts as partly at rest: a jump of its friction would be hard to fit."""


_ONE_RAD = 1e-9
"""Casters that point the same way within this go on as one."""


_SETTLED = 100.0
"""Square of half the time constants that pass in a step, above which the caster has come to rest."""


@exact
def swivelled(
    forward: Array,
    yaw: Array,
    step_s: Array,
    starts: Array,
    shares: Array,
    friction: float,
    damping: float,
    trail: float,
    pivot: float,
    half_base: float,
) -> tuple[Array, Array]:
    """Mean over each step of q·sin(psi) and q·(trail - pivot·cos(psi)) of a caster at psi from straight behind its hinge.

    It rolls where it points, from each of the angles ``starts``, of which a mean is returned (``shares`` sum to 1): s = dpsi/dt =
    (w·pivot·cos(psi) - v·sin(psi))/trail - w, with v = ``forward`` + q·sin(psi), w = ``yaw`` + q·(trail - pivot·cos(psi)) /
    ``half_base``² and q = ``friction``·s/(abs(s) + `SLOW_RAD_S`) + ``damping``·s. In half a step of constant v and w
    tan(psi/2) solves a Riccati equation, so (sin(psi/2), cos(psi/2)) a linear one up to its length; what q adds to v and w is
    the mean of both ends of the half. The work of the damping is exact, that of dry friction integrated by Simpson's rule.
    """
    pushed, turned = np.zeros_like(forward), np.zeros_like(forward)
    all_of, values = len(starts), (friction, damping, trail, pivot, 1.0 / trail, 1.0 / half_base)
    ys, xs, push, turn = np.empty(all_of), np.empty(all_of), np.empty(all_of), np.empty(all_of)
    for row in range(forward.shape[0]):
        ys[:], xs[:] = np.sin(starts / 2.0), np.cos(starts / 2.0)
        n = all_of
        for k in range(forward.shape[1]):
            h, v, w = step_s[row, k], forward[row, k], yaw[row, k]
            if h == 0.0:
                continue
            for i in range(n):  # no branch and no call: done for several at once
                y0, x0 = ys[i], xs[i]
                y1, x1 = _half(y0, x0, v, w, h / 2.0, values)
                y2, x2 = _half(y1, x1, v, w, h / 2.0, values)
                c0, s0, q0 = _held(y0, x0, v, w, values)
                c1, s1, q1 = _held(y1, x1, v, w, values)
                c2, s2, q2 = _held(y2, x2, v, w, values)
                swing = 2.0 * _turned_by(x0 * y2 - y0 * x2, x0 * x2 + y0 * y2)
                push[i] = (q0 * s0 + 4.0 * q1 * s1 + q2 * s2) / 6.0 + damping * (c0 - c2) / h
                lever = q0 * (trail - pivot * c0) + 4.0 * q1 * (trail - pivot * c1) + q2 * (trail - pivot * c2)
                turn[i] = lever / 6.0 + damping * (trail * swing - pivot * (s2 - s0)) / h
                ys[i], xs[i] = y2, x2
            for i in range(n):
                share = shares[i] if n > 1 else 1.0
                pushed[row, k] += share * push[i]
                turned[row, k] += share * turn[i]
            if n > 1 and _as_one(ys, xs):
                n = 1
    return pushed, turned


@exact
def _as_one(ys: Array, xs: Array) -> bool:
    """Whether all point the same way: by the sine of half the angle between each and the first."""
    for i in range(1, len(ys)):  # noqa: SIM110  # compiled
        if abs(ys[i] * xs[0] - xs[i] * ys[0]) > _ONE_RAD:
            return False
    return True


@inline
def _held(y: float, x: float, v: float, w: float, values: tuple[float, ...]) -> tuple[float, float, float]:
    """Cosine and sine of psi, and the part of q that is dry friction."""
    cos, sin = x * x - y * y, 2.0 * x * y
    rate = _rate(cos, sin, v, w, values)
    return cos, sin, values[0] * rate / (abs(rate) + SLOW_RAD_S)


@inline
def _rate(cos: float, sin: float, v: float, w: float, values: tuple[float, ...]) -> float:
    """s, which is less than that of a free caster: what the hinge does to the robot turns the caster less. A square's root."""
    friction, damping, trail, pivot, per_trail, per_half_base = values
    free = (w * pivot * cos - v * sin) * per_trail - w
    lever = (trail - pivot * cos) * per_half_base
    gives = (lever * lever + sin * sin) * per_trail
    whole = 1.0 + gives * damping
    less = whole * SLOW_RAD_S + gives * friction - abs(free)
    root = np.sqrt(less * less + 4.0 * whole * abs(free) * SLOW_RAD_S)
    both = abs(less) + root
    one, other = 2.0 * abs(free) * SLOW_RAD_S / both, both / (2.0 * whole)  # the smaller one if ``less`` > 0, else the larger
    return np.copysign((one + other - np.copysign(abs(one - other), less)) / 2.0, free)


@inline
def _half(y: float, x: float, v: float, w: float, h: float, values: tuple[float, ...]) -> tuple[float, float]:
    """Sine and cosine of psi/2 after half a step: with what q adds at its beginning, and again with the mean of both ends."""
    ahead, turn = _added(y, x, v, w, values)
    y1, x1 = _rolled(y, x, v + ahead, w + turn, h, values)
    then_ahead, then_turn = _added(y1, x1, v, w, values)
    return _rolled(y, x, v + (ahead + then_ahead) / 2.0, w + (turn + then_turn) / 2.0, h, values)


@inline
def _added(y: float, x: float, v: float, w: float, values: tuple[float, ...]) -> tuple[float, float]:
    friction, damping, trail, pivot, _, per_half_base = values
    cos, sin = x * x - y * y, 2.0 * x * y
    rate = _rate(cos, sin, v, w, values)
    q = friction * rate / (abs(rate) + SLOW_RAD_S) + damping * rate
    return q * sin, q * (trail - pivot * cos) * per_half_base * per_half_base


@inline
def _rolled(y: float, x: float, v: float, w: float, h: float, values: tuple[float, ...]) -> tuple[float, float]:
    """Sine and cosine of psi/2 after a time of constant velocities: combinations of themselves, but for a common factor."""
    ahead, aside = v * values[4], w * values[3] * values[4]
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


@inline
def _half_step(square: float, h: float) -> tuple[float, float]:
    """cosh(r·h) and sinh(r·h)/r, r = sqrt(``square``)/2, or cos and sin where the square is negative.

    Of a quarter of the time, doubled twice. The series' next term is below 1e-6 where r·h is 10, and 1e-10 below 5. Longer, a
    caster has come to rest: h counts less.
    """
    z = square * h * h / 4.0
    kept: float = smaller(1.0, -_SETTLED / smaller(-z, -1.0))  # type: ignore[call-arg]  # mypy sees the typing context
    z, h = z * kept / 16.0, h * np.sqrt(kept)
    c = 1.0 + z * (1 / 90) * (1.0 + z * (1 / 132) * (1.0 + z * (1 / 182) * (1.0 + z * (1 / 240))))
    c = 1.0 + z * (1 / 2) * (1.0 + z * (1 / 12) * (1.0 + z * (1 / 30) * (1.0 + z * (1 / 56) * c)))
    s = 1.0 + z * (1 / 110) * (1.0 + z * (1 / 156) * (1.0 + z * (1 / 210) * (1.0 + z * (1 / 272))))
    s = 1.0 + z * (1 / 6) * (1.0 + z * (1 / 20) * (1.0 + z * (1 / 42) * (1.0 + z * (1 / 72) * s)))
    s *= h / 4.0
    c, s = 2.0 * c * c - 1.0, 2.0 * s * c
    return 2.0 * c * c - 1.0, 2.0 * s * c
