"""Wheels that slow down otherwise than they speed up: each motion is cut where the wheel stands. Arrays are (batch, steps)."""

from __future__ import annotations

import numpy as np

from bns.engine.jit import exact
from bns.physics.signals import Array


@exact
def lagging(target: Array, step_s: Array, tau_s: float, brake_s: float) -> Array:
    """Mean over each step of w from rest, where dw/dt = (target - w)/tau, with ``brake_s`` for tau while |w| falls; exact."""
    mean = np.zeros_like(target)
    for row in range(target.shape[0]):
        w = 0.0
        for k in range(target.shape[1]):
            h, u = step_s[row, k], target[row, k]
            if h == 0.0:
                continue
            rest_s, way = h, 0.0
            if u * w < 0.0:  # it comes to rest first
                stop_s = brake_s * np.log1p(-w / u)
                if stop_s < h:
                    rest_s, way, w = h - stop_s, u * stop_s + w * brake_s, 0.0
            lag_s = brake_s if (u - w) * w < 0.0 else tau_s
            settled = -np.expm1(-rest_s / lag_s)
            mean[row, k] = (way + u * rest_s + (w - u) * settled * lag_s) / h
            w += (u - w) * settled
    return mean


@exact
def limited(target: Array, step_s: Array, limit: float, brake: float) -> Array:
    """Mean over each step of w, which follows the target from 0 with |dw/dt| <= limit, <= ``brake`` while |w| falls; exact."""
    mean = np.zeros_like(target)
    for row in range(target.shape[0]):
        w = 0.0
        for k in range(target.shape[1]):
            h, u = step_s[row, k], target[row, k]
            if h == 0.0:
                continue
            rest_s, way = h, 0.0
            if u * w < 0.0 and abs(w) < brake * h:  # it comes to rest first
                stop_s = abs(w) / brake
                rest_s, way, w = h - stop_s, w * stop_s / 2.0, 0.0
            gap = u - w
            most = brake if gap * w < 0.0 else limit
            ramp_s = abs(gap) / most
            if ramp_s <= rest_s:
                mean[row, k] = (way + u * rest_s - gap * ramp_s / 2.0) / h
                w = u
            else:
                change = np.sign(gap) * most * rest_s
                mean[row, k] = (way + (w + change / 2.0) * rest_s) / h
                w += change
    return mean
