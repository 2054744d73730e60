"""Two wheels whose body slides on one point: dry friction in the direction against that point's own motion."""

from __future__ import annotations

import numpy as np

from bns.engine.jit import exact, inline
from bns.physics.signals import Array

_ROUNDS = 60
"""Newton steps, at most: the function falls and is convex, so that they come from one side and never pass the root."""
_LEAST = 1e-9
"""What friction takes across, at least, in relation to along: a point in the middle of the axle does not move across."""
_CLOSE = 1e-13
"""Relative change of the speed at which the search for it ends."""


@exact
def dragged(left: Array, right: Array, friction: float, behind: float, aside: float) -> tuple[Array, Array]:
    """Speeds of two wheels that one sliding point holds back. ``friction`` is a speed; the point's place is in wheelbases.

    Their mean v and their difference d are those without friction minus friction·n1 and plus 4·friction·(aside·n1 + behind·n2).
    n is the direction of the point's velocity (v - aside·d, -behind·d) with the friction; a point that needs less rests.
    """
    slowed_left, slowed_right = np.zeros_like(left), np.zeros_like(right)
    # what a unit of friction takes from the point's velocity: a symmetric matrix, seen along its own two axes
    mixed = 4.0 * friction * behind * aside
    whole, less = friction + 4.0 * friction * (aside**2 + behind**2), friction + 4.0 * friction * (aside**2 - behind**2)
    size, angle = np.sqrt(less**2 + 4.0 * mixed**2), 0.5 * np.arctan2(2.0 * mixed, less)
    drop_1 = (whole + size) / 2.0
    drop_2 = max((whole - size) / 2.0, _LEAST * drop_1)
    cosine, sine = np.cos(angle), np.sin(angle)
    for row in range(left.shape[0]):
        for k in range(left.shape[1]):
            v, d = (left[row, k] + right[row, k]) / 2.0, right[row, k] - left[row, k]
            along, across = v - aside * d, -behind * d
            one, two = _direction(along * cosine + across * sine, across * cosine - along * sine, drop_1, drop_2)
            n_1, n_2 = one * cosine - two * sine, one * sine + two * cosine
            v, d = v - friction * n_1, d + 4.0 * friction * (aside * n_1 + behind * n_2)
            slowed_left[row, k], slowed_right[row, k] = v - d / 2.0, v + d / 2.0
    return slowed_left, slowed_right


@inline
def _direction(free_v: float, free_w: float, drop_v: float, drop_w: float) -> tuple[float, float]:
    """Direction (a unit vector) of a velocity that friction along it leaves of a free one; what holds it, if it comes to rest.

    The speed s that is left solves (free_v/(s + drop_v))^2 + (free_w/(s + drop_w))^2 = 1.
    """
    if drop_v == 0.0:
        return 0.0, 0.0
    held_v, held_w = free_v / drop_v, free_w / drop_w
    if held_v * held_v + held_w * held_w <= 1.0:
        return held_v, held_w
    s = max(np.sqrt(free_v * free_v + free_w * free_w) - max(drop_v, drop_w), 0.0)
    for _ in range(_ROUNDS):
        a, b = s + drop_v, s + drop_w
        x, y = (free_v / a) ** 2, (free_w / b) ** 2
        step = (x + y - 1.0) / (2.0 * (x / a + y / b))
        s += step
        if abs(step) <= _CLOSE * s:
            break
    return free_v / (s + drop_v), free_w / (s + drop_w)
