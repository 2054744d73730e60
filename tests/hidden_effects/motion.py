"""Equations of motion of a robot with two wheels: exact arcs, or RK4 where an effect depends on the pose; steps of 1 ms.

Velocities forward v, to the right s and turn w at heading th: dx = v cos th + s sin th, dy = v sin th - s cos th, dth = w.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from tests.hidden_effects.cause import MOVING_M_S, Body, Cause, Moment
from tests.hidden_effects.driving import Driving

STEP_S = 1e-3
MARGIN_S = 0.5
"""Poses are known so long before the first and after the last command: clocks may be late or early."""


@dataclass(frozen=True)
class Paths:
    """True poses (n, t, 3) of every trial at the common times (t,)."""

    t_s: np.ndarray
    poses: np.ndarray

    def at(self, trial: int, t_s: np.ndarray) -> np.ndarray:
        """Poses (len(t_s), 3) of one trial; the steps are fine enough for straight lines between them."""
        return np.stack([np.interp(t_s, self.t_s, self.poses[trial, :, i]) for i in range(3)], axis=-1)

    def stamped(self, trial: int, t_s: np.ndarray, causes: Sequence[Cause]) -> np.ndarray:
        """Poses (len(t_s), 3) of one trial that bear these stamps, whatever makes positions or headings late."""
        taken_s = t_s - sum(cause.late_s for cause in causes)
        poses = self.at(trial, taken_s)
        if late_s := sum(cause.heading_late_s for cause in causes):
            poses[..., 2] = self.at(trial, taken_s - late_s)[..., 2]
        return poses


def move(
    driving: Driving,
    wheelbase_m: float,
    causes: Sequence[Cause],
    jitter: np.ndarray,
    rng: np.random.Generator,
    tail_s: float = 0.0,
    step_s: float = STEP_S,
) -> Paths:
    """Drive all trials. `jitter` (n, k, 2): the share by which each wheel departs from each command."""
    steps = int(np.ceil((driving.ends_s.max() + tail_s + 2 * MARGIN_S) / step_s))
    t = -MARGIN_S + step_s * np.arange(steps + 1)
    moment = Moment(step_s, (t[:-1] + t[1:]) / 2, driving.session_s[:, None], rng)
    wheels = _wheels(driving, causes, jitter, t, moment)
    base = wheelbase_m * np.prod([cause.wheelbase for cause in causes])
    body = _body(wheels, base)
    for cause in causes:
        body = cause.body(body, moment)
    if any(cause.depends_on_pose for cause in causes):
        return Paths(t, runge_kutta(body, driving.start, step_s, causes))
    return Paths(t, arcs(body, driving.start, step_s))


def _wheels(
    driving: Driving, causes: Sequence[Cause], jitter: np.ndarray, t: np.ndarray, moment: Moment
) -> np.ndarray:
    commands = driving.wheels_m_s
    for cause in causes:
        commands = cause.command(commands)
    delay = sum(cause.delay_s for cause in causes)
    edges = driving.edges_s
    for cause in causes:
        edges = cause.edges(edges)
    wheels = mean_commands(edges + delay, commands * (1 + jitter), t)
    for cause in causes:
        wheels = cause.demand(wheels, moment)
    for cause in causes:
        wheels = cause.wheels(wheels, moment)
    return wheels


def mean_commands(edges_s: np.ndarray, commands: np.ndarray, t: np.ndarray) -> np.ndarray:
    """Mean command (n, len(t) - 1, 2) during each step, so that a change within a step is not moved to its end."""
    sums = np.cumsum(commands * np.diff(edges_s, axis=1)[..., None], axis=1)
    sums = np.concatenate([np.zeros_like(sums[:, :1]), sums], axis=1)
    out = np.empty((len(commands), len(t) - 1, 2))
    for trial in range(len(commands)):
        for wheel in range(2):
            out[trial, :, wheel] = np.diff(np.interp(t, edges_s[trial], sums[trial, :, wheel])) / np.diff(t)
    return out


def _body(wheels: np.ndarray, wheelbase_m: float) -> Body:
    left, right = wheels[..., 0], wheels[..., 1]
    still = np.zeros_like(left)
    moving = (np.maximum(np.abs(left), np.abs(right)) > MOVING_M_S).astype(float)
    return Body((left + right) / 2, (right - left) / wheelbase_m, still, still, still, moving)


def arcs(body: Body, start: np.ndarray, step_s: float) -> np.ndarray:
    """Poses (n, t + 1, 3): each step an exact arc of constant velocities."""
    heading = np.cumsum(body.turn * step_s, axis=1)
    heading = start[:, 2:] + np.concatenate([np.zeros_like(heading[:, :1]), heading], axis=1)
    middle, chord = (heading[:, :-1] + heading[:, 1:]) / 2, np.sinc(body.turn * step_s / (2 * np.pi))
    cos, sin = chord * np.cos(middle), chord * np.sin(middle)
    x = start[:, :1] + step_s * np.cumsum(body.forward * cos + body.right * sin + body.east, axis=1)
    y = start[:, 1:2] + step_s * np.cumsum(body.forward * sin - body.right * cos + body.north, axis=1)
    out = np.repeat(start[:, None], heading.shape[1], axis=1)
    out[:, 1:, 0], out[:, 1:, 1], out[..., 2] = x, y, heading
    return out


def runge_kutta(body: Body, start: np.ndarray, step_s: float, causes: Sequence[Cause]) -> np.ndarray:
    """The same by the classical fourth-order rule, with what depends on the pose."""
    placed = [cause for cause in causes if cause.depends_on_pose]
    pose = start.T.copy()
    out = np.empty((len(start), body.forward.shape[1] + 1, 3))
    out[:, 0] = start
    for i in range(body.forward.shape[1]):
        now = Body(*(part[:, i] for part in body))
        if now.moving.any() or now.turn.any():
            pose = _step(now, pose, step_s, placed)
        out[:, i + 1] = pose.T
    return out


def _step(body: Body, pose: np.ndarray, h: float, causes: Sequence[Cause]) -> np.ndarray:
    a = _velocity(body, pose, causes)
    b = _velocity(body, pose + h / 2 * a, causes)
    c = _velocity(body, pose + h / 2 * b, causes)
    d = _velocity(body, pose + h * c, causes)
    return pose + h / 6 * (a + 2 * b + 2 * c + d)


def _velocity(body: Body, pose: np.ndarray, causes: Sequence[Cause]) -> np.ndarray:
    for cause in causes:
        body = cause.place(body, *pose)
    cos, sin = np.cos(pose[2]), np.sin(pose[2])
    return np.stack(
        [
            body.forward * cos + body.right * sin + body.east,
            body.forward * sin - body.right * cos + body.north,
            body.turn,
        ]
    )
