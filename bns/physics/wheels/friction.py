"""Two wheels of one body, each braked by dry friction: a linear system between the moments when a wheel stops or starts."""

from __future__ import annotations

import numpy as np

from bns.engine.jit import exact
from bns.physics.signals import Array

_EVENTS = 16
"""Stops and starts in one step, at most: each wheel's speed has two zeros between two of the other's."""
_HALVINGS = 60
"""A zero is known to the last digit of its time then."""
_SOON = 1e-9
"""In time constants, how much later a wheel begins to turn than friction lets it: by then the force exceeds it in every digit."""


@exact
def braked_together(
    left: Array, right: Array, step_s: Array, tau_s: float, turn_ratio: float, friction: float, loss: float
) -> tuple[Array, Array]:
    """Mean over each step of the speeds v of two wheels, from rest; exact. ``friction`` and ``loss`` are speeds.

    Their mean m and half their difference d obey tau·dm/dt = M - m and turn_ratio·tau·dd/dt = D - d; M and D are mean and half
    difference of target + (friction - loss)·sign(target) - F. F is friction·sign(v) of a wheel that turns; one at rest is held
    while less than ``friction`` is needed for that.
    """
    mean_left, mean_right = np.zeros_like(left), np.zeros_like(right)
    alone_s, other_s = tau_s * (1.0 + turn_ratio) / 2.0, tau_s * (1.0 - turn_ratio) / 2.0
    for row in range(left.shape[0]):
        v, w = 0.0, 0.0
        for k in range(left.shape[1]):
            h = step_s[row, k]
            if h == 0.0:
                continue
            a = left[row, k] + (friction - loss) * np.sign(left[row, k])
            b = right[row, k] + (friction - loss) * np.sign(right[row, k])
            begin_s, way_v, way_w = 0.0, 0.0, 0.0
            for _ in range(_EVENTS):
                rest_s = h - begin_s
                side_v, side_w = _sides(v, w, a, b, friction, other_s / alone_s if tau_s > 0.0 else 0.0)
                if side_v == 0.0 and side_w == 0.0:
                    break
                end_v, end_w = a - friction * side_v, b - friction * side_w
                if side_v != 0.0 and side_w != 0.0:
                    t, mean_v, mean_w, v_t, w_t = _both(v, w, end_v, end_w, side_v, side_w, tau_s, turn_ratio, rest_s)
                elif side_v != 0.0:
                    t, mean_v, v_t = _one(v, end_v, side_v, b, other_s, alone_s, friction, rest_s)
                    mean_w = w_t = 0.0
                else:
                    t, mean_w, w_t = _one(w, end_w, side_w, a, other_s, alone_s, friction, rest_s)
                    mean_v = v_t = 0.0
                if begin_s == 0.0 and t == h:
                    mean_left[row, k], mean_right[row, k] = mean_v, mean_w
                way_v, way_w = way_v + mean_v * t, way_w + mean_w * t
                v, w = v_t, w_t
                if t >= rest_s:
                    break
                begin_s += t
            if begin_s > 0.0:
                mean_left[row, k], mean_right[row, k] = way_v / h, way_w / h
    return mean_left, mean_right


@exact
def _sides(v: float, w: float, a: float, b: float, friction: float, coupling: float) -> tuple[float, float]:
    """Which way each wheel turns next; 0 if friction holds it. ``coupling``: force on one wheel by what drives the other."""
    side_v, side_w = np.sign(v), np.sign(w)
    if side_v == 0.0 and side_w == 0.0:  # the one that is driven more moves for certain
        if max(abs(a), abs(b)) <= friction:
            return 0.0, 0.0
        side_v, side_w = (np.sign(a), 0.0) if abs(a) >= abs(b) else (0.0, np.sign(b))
    if side_v == 0.0:
        needed = a - coupling * (b - friction * side_w - w)
        return (np.sign(needed) if abs(needed) > friction else 0.0), side_w
    if side_w == 0.0:
        needed = b - coupling * (a - friction * side_v - v)
        return side_v, (np.sign(needed) if abs(needed) > friction else 0.0)
    return side_v, side_w


@exact
def _one(
    v: float, end: float, side: float, held: float, other_s: float, alone_s: float, friction: float, rest_s: float
) -> tuple[float, float, float]:
    """How long one wheel turns while the other is held, its mean and last speed. ``held``: what drives that one."""
    t, stops = rest_s, False
    if end * side < 0.0:
        stop_s = alone_s * np.log1p(-v / end)
        t, stops = (stop_s, True) if stop_s < t else (t, False)
    pull = other_s * (end - v) / alone_s if alone_s > 0.0 else 0.0  # on the other wheel; it fades
    if pull != 0.0:
        for most in (-friction, friction):
            share = (held - most) / pull
            release_s = -alone_s * np.log(share) + _SOON * alone_s if 0.0 < share < 1.0 else t
            if release_s < t:
                t, stops = release_s, False
    if alone_s == 0.0:
        return t, end, 0.0
    nearer = -np.expm1(-t / alone_s)
    mean = end + (v - end) * nearer * alone_s / t if t > 0.0 else v
    return t, mean, 0.0 if stops else v + (end - v) * nearer


@exact
def _both(
    v: float, w: float, end_v: float, end_w: float, side_v: float, side_w: float, tau_s: float, ratio: float, rest_s: float
) -> tuple[float, float, float, float, float]:
    """How long both wheels turn, their mean speeds, and their speeds in the end."""
    if tau_s == 0.0:
        return rest_s, end_v, end_w, 0.0, 0.0
    end_m, end_d = (end_v + end_w) / 2.0, (end_w - end_v) / 2.0
    off_m, off_d = (v + w) / 2.0 - end_m, (w - v) / 2.0 - end_d
    turn_s = tau_s * ratio
    t_v = _zero(side_v * end_v, side_v * off_m, -side_v * off_d, tau_s, turn_s, rest_s)
    t_w = _zero(side_w * end_w, side_w * off_m, side_w * off_d, tau_s, turn_s, rest_s)
    t = min(t_v, t_w, rest_s)
    fallen_m, fallen_d = -np.expm1(-t / tau_s), -np.expm1(-t / turn_s)
    m, d = end_m + off_m * (1.0 - fallen_m), end_d + off_d * (1.0 - fallen_d)
    if t > 0.0:
        mean_m, mean_d = end_m + off_m * fallen_m * tau_s / t, end_d + off_d * fallen_d * turn_s / t
    else:
        mean_m, mean_d = end_m + off_m, end_d + off_d
    v_t = 0.0 if t_v == t and t < rest_s else m - d
    w_t = 0.0 if t_w == t and t < rest_s else m + d
    return t, mean_m - mean_d, mean_m + mean_d, v_t, w_t


@exact
def _zero(end: float, first: float, second: float, first_s: float, second_s: float, rest_s: float) -> float:
    """When end + first·exp(-t/first_s) + second·exp(-t/second_s) becomes negative; ``rest_s`` or more if not within that.

    It is not negative at 0, and has one turning point at most.
    """
    low, high = 0.0, rest_s
    if first * second < 0.0 and first_s != second_s:
        turning = np.log(-first * second_s / (second * first_s)) / (1.0 / first_s - 1.0 / second_s)
        if 0.0 < turning < rest_s:
            if _sum(end, first, second, first_s, second_s, turning) < 0.0:
                high = turning
            else:
                low = turning
    if _sum(end, first, second, first_s, second_s, high) >= 0.0:
        return rest_s
    for _ in range(_HALVINGS):
        middle = (low + high) / 2.0
        if _sum(end, first, second, first_s, second_s, middle) < 0.0:
            high = middle
        else:
            low = middle
    return high


@exact
def _sum(end: float, first: float, second: float, first_s: float, second_s: float, t: float) -> float:
    return end + first * np.exp(-t / first_s) + second * np.exp(-t / second_s)


@exact
def braked(target: Array, step_s: Array, tau_s: float, friction: float) -> Array:
    """Mean over each step of w from rest, where tau·dw/dt = target - w - friction·sign(w), held at rest up to friction; exact."""
    mean = np.zeros_like(target)
    for row in range(target.shape[0]):
        w = 0.0
        for k in range(target.shape[1]):
            h, u = step_s[row, k], target[row, k]
            if h == 0.0:
                continue
            rest_s, way = h, 0.0
            end = u - friction * np.sign(w)
            if end * w < 0.0:  # it comes to rest first
                stop_s = tau_s * np.log1p(-w / end)
                if stop_s < h:
                    rest_s, way, w = h - stop_s, end * stop_s + w * tau_s, 0.0
            if w == 0.0:
                end = np.sign(u) * max(abs(u) - friction, 0.0)
            settled = -np.expm1(-rest_s / tau_s)
            mean[row, k] = (way + end * rest_s + (w - end) * settled * tau_s) / h
            w += (end - w) * settled
    return mean
