"""Drive commands on a differential drive with effects, and look at the result as a tracker would.

Nothing is drawn here: jitter and noise come in as standard normal numbers from the caller.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from bns.errors import ModelError
from bns.physics.applied import applied
from bns.physics.model import Model
from bns.physics.signals import Array, Stamps, View
from bns.physics.wheels.grid import Grid, step_grid
from bns.physics.wheels.motion import arcs, body_motion, flow_of
from bns.physics.wheels.scans import flow_along

_PLACE_ROUNDS, _SETTLED = 100, 1e-7
"""An effect that depends on the place is first driven without it, then again where that led to, until no pose of a trial moves by
more (m, rad). What a patch that takes half of the speed does needs about 15 rounds, some percent 4."""
_CHUNK = 32  # trials at a time: their signals stay in the cache


@dataclass(frozen=True)
class Track:
    """True poses at a fixed rate.

    t_s (batch, samples) since the trial began, and poses (batch, samples, 3); NaN where a trial has ended.
    """

    t_s: Array
    poses: Array


def simulate(
    model: Model,
    left_m_s: ArrayLike,
    right_m_s: ArrayLike,
    duration_s: ArrayLike,
    *,
    start: ArrayLike = (0.0, 0.0, 0.0),
    normals: ArrayLike | None = None,
    growth: float = 1.0,
) -> Array:
    """True poses at the end of every command, (batch, commands, 3): x_m, y_m, heading_rad (unwrapped).

    Each trial's commands are driven back to back, from rest. Speeds and durations are (batch, commands);
    a duration of 0 pads a short trial. ``start`` is one pose or (batch, 3). ``normals`` (batch, commands,
    2) scale the jitter of left and right; without them there is none. Lag and delay run on from command
    to command; a pose is taken when its command's time is over, and coasting after the last is not seen.
    ``growth``: of the steps within a command (`step_grid`). ModelError if shapes do not agree or a number is not finite.
    """
    left, right, duration = _jittered(model, _commands(left_m_s, right_m_s, duration_s), normals)
    poses0 = _start(start, len(left))
    poses = np.empty((*left.shape, 3))
    for rows in _chunks(len(left)):
        grid = step_grid(left[rows], right[rows], duration[rows], model.dt_s, growth)
        nodes = _integrate(model, grid, poses0[rows])
        if any(model.at("clock")):
            _sample(poses[rows], stamps_of(model, np.cumsum(duration[rows], axis=1)), grid.node_s, nodes)
        else:
            poses[rows] = np.take_along_axis(nodes, grid.ends[:, :, None], axis=1)
    return poses


def track(
    model: Model,
    left_m_s: ArrayLike,
    right_m_s: ArrayLike,
    duration_s: ArrayLike,
    *,
    dense_dt_s: float,
    start: ArrayLike = (0.0, 0.0, 0.0),
    normals: ArrayLike | None = None,
) -> Track:
    """The same drive as `simulate`, seen every ``dense_dt_s`` from the start to the end of each trial."""
    left, right, duration = _jittered(model, _commands(left_m_s, right_m_s, duration_s), normals)
    poses0 = _start(start, len(left))
    times = _sample_times(duration, dense_dt_s)
    poses = np.empty((*times.shape, 3))
    for rows in _chunks(len(left)):
        grid = step_grid(left[rows], right[rows], duration[rows], model.dt_s)
        _sample(poses[rows], stamps_of(model, times[rows]), grid.node_s, _integrate(model, grid, poses0[rows]))
    return Track(times, poses)


def observe(poses: ArrayLike, normals: ArrayLike | None, model: Model) -> Array:
    """Poses (..., 3) as the tracker reports them: the measure effects, then noise.

    ``normals`` (..., 3) scale the noise; without them there is none. NaN stays NaN.
    """
    seen = View(np.array(poses, dtype=np.float64))
    if seen.poses.shape[-1:] != (3,):
        raise ModelError(f"poses have shape {seen.poses.shape}; the last axis must be x_m, y_m, heading_rad.")
    for active in model.at("measure"):
        seen = applied(active.effect, seen, active.by_name)
    if normals is None:
        return seen.poses
    sigma = np.array([model.noise_position_m, model.noise_position_m, model.noise_heading_rad])
    return seen.poses + sigma * _shaped("normals", normals, seen.poses.shape)


def _integrate(model: Model, grid: Grid, start: Array) -> Array:
    """Poses at every node, (batch, steps + 1, 3): each step is the arc of its mean velocities."""
    nodes = _nodes(model, grid, start, None)
    if any(active.effect.needs_place for active in model.at("body")):
        moving = np.ones(len(nodes), dtype=bool)  # each trial ends by itself: it does not depend on those beside it
        for _ in range(_PLACE_ROUNDS):
            then = _nodes(model, grid, start, (nodes[:, 1:] + nodes[:, :-1]) / 2.0)
            moved = np.abs(then - nodes).max(axis=(1, 2))
            nodes[moving] = then[moving]
            moving &= moved > _SETTLED
            if not moving.any():
                break
    return nodes


def _nodes(model: Model, grid: Grid, start: Array, place: Array | None) -> Array:
    driven = arcs(body_motion(model, grid, place=place), grid.step_s, start[:, 2])
    flow = flow_of(model)
    x = flow_along(start[:, 0], driven.east_m, driven.moving_s, flow.x_m_s, flow.return_per_s)
    y = flow_along(start[:, 1], driven.north_m, driven.moving_s, flow.y_m_s, flow.return_per_s)
    return np.stack([x, y, driven.heading_rad], axis=2)


def stamps_of(model: Model, stamped_s: Array, trial: NDArray[np.int64] | None = None) -> Stamps:
    """When poses stamped so, and their headings, were really taken: the ``clock`` effects.

    ``trial``: of which trial each stamp is, where the trials' own clocks are to count.
    """
    stamps = Stamps(stamped_s)
    for active in model.at("clock"):
        values: dict[str, Any] = dict(active.by_name)
        if active.trial_values and trial is not None:
            values = dict.fromkeys(values, np.array(active.trial_values)[trial])
        stamps = applied(active.effect, stamps, values)
    return stamps


def taken_at(model: Model, stamped_s: Array, trial: NDArray[np.int64] | None = None) -> Array:
    """When the positions of poses stamped so were really taken; ``trial`` as in `stamps_of`."""
    return stamps_of(model, stamped_s, trial).t_s


def _chunks(trials: int) -> list[slice]:
    return [slice(first, first + _CHUNK) for first in range(0, trials, _CHUNK)]


def _commands(left_m_s: ArrayLike, right_m_s: ArrayLike, duration_s: ArrayLike) -> tuple[Array, Array, Array]:
    left, right, duration = (np.asarray(a, dtype=np.float64) for a in (left_m_s, right_m_s, duration_s))
    if left.ndim != 2 or left.shape != right.shape or left.shape != duration.shape:
        raise ModelError(
            f"left_m_s, right_m_s and duration_s have the shapes {left.shape}, {right.shape} "
            f"and {duration.shape}; give all three as (trials, commands)."
        )
    for name, values in (("left_m_s", left), ("right_m_s", right), ("duration_s", duration)):
        if not np.isfinite(values).all():
            raise ModelError(f"{name} holds {values[~np.isfinite(values)][0]}; pad short trials with 0.")
    if (duration < 0).any():
        raise ModelError(f"duration_s holds {duration.min()}; a command lasts 0 s or longer.")
    return left, right, duration


def _jittered(
    model: Model, commands: tuple[Array, Array, Array], normals: ArrayLike | None
) -> tuple[Array, Array, Array]:
    left, right, duration = commands
    if normals is None:
        return commands
    factors = 1.0 + model.jitter_relative * _shaped("normals", normals, (*left.shape, 2))
    return left * factors[..., 0], right * factors[..., 1], duration


def _start(start: ArrayLike, trials: int) -> Array:
    pose = np.asarray(start, dtype=np.float64)
    if pose.shape not in {(3,), (trials, 3)}:
        raise ModelError(f"start has the shape {pose.shape}; it must be (3,) or {(trials, 3)}.")
    return np.ascontiguousarray(np.broadcast_to(pose, (trials, 3)))


def _shaped(name: str, values: ArrayLike, shape: tuple[int, ...]) -> Array:
    given = np.asarray(values, dtype=np.float64)
    if given.shape != shape:
        raise ModelError(f"{name} have the shape {given.shape}; they must be {shape}.")
    return given


def _sample_times(duration: Array, dense_dt_s: float) -> Array:
    if not dense_dt_s > 0:
        raise ModelError(f"dense_dt_s is {dense_dt_s}; it must be above 0 s (0.02 for 50 poses a second).")
    total = duration.sum(axis=1, keepdims=True)
    times = np.arange(int(np.floor(total.max(initial=0.0) / dense_dt_s + 1e-9)) + 1) * dense_dt_s
    return np.where(times <= total + 1e-9, np.minimum(times, total), np.nan)


def _sample(out: Array, stamps: Stamps, node_s: Array, nodes: Array) -> None:
    """Poses between nodes lie on the chord: at 5 ms steps that is within micrometres of the arc."""
    for row, taken_s in enumerate(stamps.t_s):
        for axis, times in enumerate((taken_s, taken_s, taken_s - stamps.heading_late_s)):
            out[row, :, axis] = np.interp(times, node_s[row], nodes[row, :, axis])
