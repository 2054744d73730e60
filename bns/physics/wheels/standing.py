"""Wheels that stand though they are told to turn, compiled. Arrays are (batch, steps)."""

from __future__ import annotations

import numpy as np

from bns.engine.jit import exact
from bns.physics.signals import Array


@exact
def paused(target: Array, step_s: Array, pause_s: float) -> Array:
    """Mean over each step of a speed that is 0 within ``pause_s`` after the last step of the other direction."""
    mean = np.zeros_like(target)
    for row in range(target.shape[0]):
        direction, since_s = 0.0, 0.0
        for k in range(target.shape[1]):
            h, u = step_s[row, k], target[row, k]
            if h == 0.0:
                continue
            stands_s = min(max(pause_s - since_s, 0.0), h) if u * direction < 0.0 else 0.0
            if u != 0.0 and stands_s < h:
                direction, since_s = np.sign(u), 0.0
            else:
                since_s += h
            mean[row, k] = u * (1.0 - stands_s / h)
    return mean


@exact
def started_late(target: Array, step_s: Array, wait_s: float) -> Array:
    """Mean over each step of a speed that is 0 for the first ``wait_s`` after it was 0; at rest at first."""
    mean = np.zeros_like(target)
    for row in range(target.shape[0]):
        since_s = 0.0
        for k in range(target.shape[1]):
            h, u = step_s[row, k], target[row, k]
            if h == 0.0:
                continue
            if u == 0.0:
                since_s = 0.0
                continue
            mean[row, k] = u * (1.0 - min(max(wait_s - since_s, 0.0), h) / h)
            since_s += h
    return mean


@exact
def broken_away(target: Array, step_s: Array, start: float, stop: float) -> Array:
    """The target from ``start`` on until it is below ``stop``, in size, or of the other direction, else 0; at rest at first."""
    out = np.zeros_like(target)
    for row in range(target.shape[0]):
        direction = 0.0
        for k in range(target.shape[1]):
            u = target[row, k]
            if step_s[row, k] == 0.0:
                continue
            if abs(u) >= start or (u * direction > 0.0 and abs(u) >= stop):
                direction, out[row, k] = np.sign(u), u
            else:
                direction = 0.0
    return out


@exact
def summed_while_on(target: Array, values: Array, starts: Array, stops: Array) -> Array:
    """Of each pair of start and stop, (pairs,): the sum of ``values`` where `broken_away` is not 0."""
    out = np.zeros(len(starts))
    for pair in range(len(starts)):
        start, stop = starts[pair], stops[pair]
        for row in range(target.shape[0]):
            direction = 0.0
            for k in range(target.shape[1]):
                u = target[row, k]
                if abs(u) >= start or (u * direction > 0.0 and abs(u) >= stop):
                    direction = np.sign(u)
                    out[pair] += values[row, k]
                else:
                    direction = 0.0
    return out


@exact
def timed_out(left: Array, right: Array, step_s: Array, timeout_s: float) -> tuple[Array, Array]:
    """Mean over each step of two speeds that are 0 from ``timeout_s`` after the last change of either; exact."""
    mean_left, mean_right = np.zeros_like(left), np.zeros_like(right)
    for row in range(left.shape[0]):
        before_left, before_right, since_s = 0.0, 0.0, 0.0
        for k in range(left.shape[1]):
            h, u, v = step_s[row, k], left[row, k], right[row, k]
            if h == 0.0:
                continue
            if u != before_left or v != before_right:
                before_left, before_right, since_s = u, v, 0.0
            share = min(max(timeout_s - since_s, 0.0) / h, 1.0)
            mean_left[row, k], mean_right[row, k] = share * u, share * v
            since_s += h
    return mean_left, mean_right


@exact
def tripped(left: Array, right: Array, step_s: Array, limit: float, off_s: float, together: bool) -> tuple[Array, Array]:
    """Mean over each step of two speeds that are 0 for ``off_s`` after a change beyond a limit, in size; exact.

    Of each by itself, or of both ``together`` after changes that exceed it when added up. Each such change restarts the timer.
    """
    mean_left, mean_right = np.zeros_like(left), np.zeros_like(right)
    for row in range(left.shape[0]):
        before_left = before_right = off_left = off_right = 0.0
        for k in range(left.shape[1]):
            h, u, v = step_s[row, k], left[row, k], right[row, k]
            if h == 0.0:
                continue
            by_left, by_right = abs(u - before_left), abs(v - before_right)
            before_left, before_right = u, v
            if together:
                by_left += by_right
                by_right = by_left
            if by_left > limit:
                off_left = off_s
            if by_right > limit:
                off_right = off_s
            mean_left[row, k] = u * (1.0 - min(off_left, h) / h)
            mean_right[row, k] = v * (1.0 - min(off_right, h) / h)
            off_left, off_right = max(off_left - h, 0.0), max(off_right - h, 0.0)
    return mean_left, mean_right
