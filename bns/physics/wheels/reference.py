"""The slow twin of `differential_drive`: the same physics as one differential equation for a general solver.

It shares no formula with the fast path: wheels are states instead of recurrences, commands switch at exact
times instead of on a grid, and positions come from integrating velocities instead of from arcs.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from itertools import pairwise
from typing import Any

import numpy as np
from scipy.integrate import solve_ivp

from bns.errors import ModelError
from bns.physics.model import Model
from bns.physics.signals import CREEP_M_S, Array

ORDER = (
    "speed-gain",
    "wheel-mismatch",
    "dead-zone",
    "speed-limit",
    "acceleration-limit",
    "command-delay",
    "motor-lag",
    "wheelbase",
    "turn-slip",
    "side-slip",
    "yaw-bias",
    "floor-slope",
    "tether-pull",
)
"""The one order of effects for which these equations are written."""

_CATCH_UP_S = 1e-5  # a rate limit has a corner where it catches up; the solver gets this short lag instead
_STIFF = {"method": "LSODA", "rtol": 1e-8, "atol": 1e-10, "max_step": 0.01}
_SMOOTH = {"method": "DOP853", "rtol": 1e-9, "atol": 1e-11, "max_step": 0.02}


def simulate_slowly(
    model: Model,
    left_m_s: Sequence[float],
    right_m_s: Sequence[float],
    duration_s: Sequence[float],
    start: Sequence[float] = (0.0, 0.0, 0.0),
) -> Array:
    """Pose at the end of each command of one trial, (commands, 3), without jitter.

    ModelError if the model has effects that are not in `ORDER`, or has them in another order.
    """
    _check_order(model)
    ends = np.cumsum(duration_s)
    delay = model.values_of("command-delay")["delay_s"]
    corners = sorted({0.0, *ends, *(t + delay for t in (0.0, *ends) if t + delay < ends[-1])})
    state, poses = np.array([*start, *np.zeros(5)]), {0.0: np.array(start)}
    for t0, t1 in pairwise(corners):
        index = int(np.searchsorted(ends, (t0 + t1) / 2 - delay))
        begun = (t0 + t1) / 2 > delay
        left, right = (left_m_s[index], right_m_s[index]) if begun else (0.0, 0.0)
        state = _piece(model, state, left, right, t1 - t0)
        poses[t1] = state[:3]
    return np.array([poses[t] for t in ends])


def _check_order(model: Model) -> None:
    names = [a.effect.name for a in model.effects if a.effect.stage != "measure"]
    if names != [name for name in ORDER if name in names]:
        raise ModelError(
            f"The slow twin cannot solve the effects {', '.join(names)} in this order; "
            f"it knows {', '.join(ORDER)}, in this order."
        )


def _piece(model: Model, state: Array, left: float, right: float, duration: float) -> Array:
    """Integrate over a time in which the delayed command does not change."""
    target, lagged = _told(model, left, right), model.values_of("motor-lag")["tau_s"] > 0
    limited = math.isfinite(model.values_of("acceleration-limit")["max_m_s2"])
    if not limited:
        state = np.array([*state[:3], *target, *state[5:]])
    turning = slice(5, 7) if lagged else slice(3, 5)
    how: dict[str, Any] = _STIFF if limited else _SMOOTH
    solution = solve_ivp(lambda _, s: _rates(model, s, target, s[turning]), (0.0, duration), state, **how)
    return np.asarray(solution.y[:, -1])


def _told(model: Model, left: float, right: float) -> tuple[float, float]:
    """What the motors are told: gains, mismatch, dead zone and limit of one command."""
    gain, ratio = model.values_of("speed-gain")["gain"], model.values_of("wheel-mismatch")["ratio"]
    width, top = model.values_of("dead-zone")["width_m_s"], model.values_of("speed-limit")["max_m_s"]
    told = []
    for speed in (left * gain * 2 / (1 + ratio), right * gain * 2 * ratio / (1 + ratio)):
        size = min(abs(speed) - width, top) if abs(speed) > width else 0.0
        told.append(math.copysign(size, speed))
    return told[0], told[1]


def _rates(model: Model, state: Array, target: tuple[float, float], wheels: Array) -> list[float]:
    """Time derivative of x, y, heading, what a rate limit lets through (2), lagging wheels (2), whether they move, as late."""
    tau, limit = model.values_of("motor-lag")["tau_s"], model.values_of("acceleration-limit")["max_m_s2"]
    limited = [max(-limit, min(limit, (u - w) / _CATCH_UP_S)) for u, w in zip(target, state[3:5], strict=True)]
    lagging = [(u - w) / tau if tau > 0 else 0.0 for u, w in zip(state[3:5], state[5:7], strict=True)]
    moves = (_moving(*state[3:5]) - state[7]) / tau if tau > 0 else 0.0
    followed = float(state[7]) if tau > 0 else 1.0
    return [*_velocity(model, state, wheels[0], wheels[1], followed), *limited, *lagging, moves]


def _moving(left: float, right: float) -> float:
    """From 0 (at rest) to 1."""
    return min(max(abs(left), abs(right)) / CREEP_M_S, 1.0)


def _velocity(model: Model, state: Array, left: float, right: float, followed: float) -> tuple[float, float, float]:
    x, y, heading = state[:3]
    slope, tether = model.values_of("floor-slope"), model.values_of("tether-pull")
    moving = min(_moving(left, right), followed)
    omega = (right - left) / (model.wheelbase_m * model.values_of("wheelbase")["factor"])
    v = (left + right) / 2 * max(1 - model.values_of("turn-slip")["slip_s"] * abs(omega), 0.0)
    rightwards = model.values_of("side-slip")["slip_s"] * v * omega
    pull = tether["pull_per_s"]
    drift_x = slope["x_m_s"] + pull * (tether["anchor_x_m"] - x)
    drift_y = slope["y_m_s"] + pull * (tether["anchor_y_m"] - y)
    return (
        v * math.cos(heading) + rightwards * math.sin(heading) + moving * drift_x,
        v * math.sin(heading) - rightwards * math.cos(heading) + moving * drift_y,
        omega + moving * model.values_of("yaw-bias")["rate_rad_s"],
    )
