"""Worlds by a second generator, which shares nothing with the first: Euler steps, errors of the tracker with a memory, driving
both ways, and causes of its own, some of them in no list. ``python -m tests.hidden_effects.second_generator DIR`` writes a log a
cause; ``bns diagnose DIR/CAUSE.csv --model khepera`` is then the question, and `CAUSES` has the answer in words.
"""

from __future__ import annotations

import sys
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
import pandas as pd

BASE_M, STEP_S, HZ = 0.0884, 1e-3, 20.0
TRIALS, COMMANDS = 50, (5, 12)
POSITION_M, HEADING_RAD, MEMORY, LOST = 0.0015, 0.008, 0.4, 0.02
COMMAND_JITTER, TRIAL_JITTER = 0.004, 0.002

CAUSES = {
    "none": "nothing",
    "lag": "each wheel follows its command with a time constant of 0.09 s",
    "lag-and-base": "the same, and the wheels stand 4 % further apart",
    "acceleration": "a wheel's speed changes by 0.35 m/s² at most",
    "delay": "commands act 0.12 s late",
    "rate": "commands act on ticks of 0.25 s",
    "mismatch": "left wheel 1.2 % slower, right one 1.2 % faster",
    "base": "the wheels stand 4 % further apart",
    "gain": "wheels turn 7 % slower",
    "dead-zone": "a wheel loses 8 mm/s",
    "stribeck": "a wheel loses 15 mm/s at rest, fading within 40 mm/s",
    "limit": "a wheel turns at 0.14 m/s at most",
    "steps": "wheels' speeds come in steps of 25 mm/s",
    "sag": "speeds fall by 0.02 % a second of the session",
    "warm-up": "20 % slower at the start of a trial, fading within 2 s",
    "eccentric": "the left wheel's speed swings by 8 % once in 0.13 m",
    "yaw": "turns left by 0.03 rad/s while it moves",
    "turn-slip": "6 % of forward speed lost per rad/s",
    "side-slip": "slides out of curves: 0.08 s times v·ω",
    "patch": "40 % slower within 0.15 m of (0.1, -0.05) m",
    "slope": "drifts by (4, -2) mm/s while it moves",
    "tether": "pulled to (0.8, -0.4) m with 0.02 a second",
    "clock": "poses are stamped 0.08 s late",
    "drift": "the tracker's clock runs 1 % fast",
    "marker": "the marker sits 18 mm ahead of the axle",
    "scale": "positions 3 % too large",
    "turned": "positions turned by 0.05 rad against headings",
    "left-friction": "unlisted: the left wheel alone loses 12 mm/s",
    "backwards": "unlisted: a wheel turns 10 % slower backwards",
    "place-turns": "unlisted: the floor turns the robot, by where it is",
    "grip": "unlisted: the robot turns no faster than a sideways acceleration of 0.12 m/s² allows",
}


@dataclass
class _State:
    """What a robot carries along a trial: speeds and ways of its wheels."""

    speed: list[float] = field(default_factory=lambda: [0.0, 0.0])
    way: list[float] = field(default_factory=lambda: [0.0, 0.0])


def world(cause: str, seed: int = 1) -> pd.DataFrame:
    """A log of a robot with one cause, in the columns of docs/logs.md."""
    rng = np.random.default_rng([seed, *map(ord, cause)])
    rows, session_s = [], 0.0
    for trial in range(TRIALS):
        told, ends, path = _driven(cause, rng, session_s)
        session_s += ends[-1]
        rows.append(_tracked(cause, rng, f"t{trial:03d}", told, ends, path))
    return pd.concat(rows, ignore_index=True)


def _driven(cause: str, rng: np.random.Generator, session_s: float) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Commanded speeds (n, 2), the ends of the commands (n,), and the pose at every step."""
    n = int(rng.integers(*COMMANDS))
    told = rng.uniform(0.03, 0.2, (n, 2)) * rng.choice([-1, 1], (n, 2), p=[0.25, 0.75])
    straight, spot = rng.random(n) < 0.25, rng.random(n) < 0.15
    told[straight, 1], told[spot, 1] = told[straight, 0], -told[spot, 0]
    ends = np.cumsum(np.round(rng.uniform(0.3, 2.0, n) * HZ) / HZ)
    jitter = (1 + COMMAND_JITTER * rng.standard_normal((n, 2))) * (1 + TRIAL_JITTER * rng.standard_normal(2))
    steps = round(ends[-1] / STEP_S)
    path, state = np.empty((steps + 1, 3)), _State(way=list(rng.uniform(0, 0.13, 2)))
    path[0] = *rng.uniform(-0.3, 0.3, 2), rng.uniform(-np.pi, np.pi)
    for i in range(steps):
        t = i * STEP_S
        k = _in_force(cause, t, ends)
        wanted = [0.0, 0.0] if k < 0 else [_wheel(cause, w, told[k, w], t, session_s, state) * jitter[k, w] for w in (0, 1)]
        path[i + 1] = path[i] + np.array(_moved(cause, wanted, path[i], state)) * STEP_S
    return told, ends, path


def _in_force(cause: str, t: float, ends: np.ndarray) -> int:
    """Number of the command that acts at a time; -1: none yet."""
    if cause == "delay":
        t -= 0.12
    if cause == "rate":
        t = np.floor(t / 0.25 + 1e-9) * 0.25
    return -1 if t < 0 else int(min(np.searchsorted(ends, t + 1e-9, side="right"), len(ends) - 1))


def _wheel(cause: str, wheel: int, u: float, t: float, session_s: float, state: _State) -> float:
    """Speed that a wheel is driven at (m/s)."""
    lost = {"dead-zone": 0.008, "stribeck": 0.015 * np.exp(-abs(u) / 0.04), "left-friction": 0.012 * (wheel == 0)}
    factor = {
        "mismatch": 0.988 if wheel == 0 else 1.012,
        "gain": 0.93,
        "sag": 1 - 2e-4 * (session_s + t),
        "warm-up": 1 - 0.2 * np.exp(-t / 2),
        "eccentric": 1 + 0.08 * np.cos(2 * np.pi * state.way[wheel] / 0.13) * (wheel == 0),
        "backwards": 0.9 if u < 0 else 1.0,
    }
    if cause == "limit":
        return float(np.clip(u, -0.14, 0.14))
    if cause == "steps":
        return float(0.025 * np.round(u / 0.025))
    return float(np.sign(u) * max(abs(u) - lost.get(cause, 0.0), 0.0) * factor.get(cause, 1.0))


def _moved(cause: str, wanted: list[float], pose: np.ndarray, state: _State) -> tuple[float, float, float]:
    """Velocities east, north and of the heading."""
    for w in (0, 1):
        if cause.startswith("lag"):
            state.speed[w] += STEP_S * (wanted[w] - state.speed[w]) / 0.09
        elif cause == "acceleration":
            state.speed[w] += float(np.clip(wanted[w] - state.speed[w], -0.35 * STEP_S, 0.35 * STEP_S))
        else:
            state.speed[w] = wanted[w]
        state.way[w] += state.speed[w] * STEP_S
    left, right = state.speed
    moves = bool(left or right)
    x, y, heading = pose
    v, turn = (left + right) / 2, (right - left) / (BASE_M * (1.04 if cause.endswith("base") else 1.0))
    slides, east, north = 0.0, 0.0, 0.0
    if cause == "yaw" and moves:
        turn += 0.03
    if cause == "turn-slip":
        v *= max(1 - 0.06 * abs(turn), 0)
    if cause == "side-slip":
        slides = -0.08 * v * turn
    if cause == "patch" and (x - 0.1) ** 2 + (y + 0.05) ** 2 < 0.15**2:
        v, turn = 0.6 * v, 0.6 * turn
    if cause == "place-turns":
        turn += 1.25 * np.sin(6 * x) * abs(v)
    if cause == "grip" and abs(v * turn) > 0.12:
        turn *= 0.12 / abs(v * turn)
    if cause == "slope" and moves:
        east, north = 0.004, -0.002
    if cause == "tether" and moves:
        east, north = 0.02 * (0.8 - x), 0.02 * (-0.4 - y)
    cos, sin = np.cos(heading), np.sin(heading)
    return v * cos - slides * sin + east, v * sin + slides * cos + north, turn


def _tracked(
    cause: str, rng: np.random.Generator, trial: str, told: np.ndarray, ends: np.ndarray, path: np.ndarray
) -> pd.DataFrame:
    """What the tracker stamped: frames of the drive, and a last row where the robot is told to stand."""
    t = np.arange(0, ends[-1], 1 / HZ)
    true_s = (t - (0.08 if cause == "clock" else 0.0)) * (0.99 if cause == "drift" else 1.0)
    seen = path[np.clip(np.round(true_s / STEP_S).astype(int), 0, len(path) - 1)].copy()
    if cause == "marker":
        seen[:, :2] += 0.018 * np.c_[np.cos(seen[:, 2]), np.sin(seen[:, 2])]
    if cause == "scale":
        seen[:, :2] *= 1.03
    if cause == "turned":
        cos, sin = np.cos(0.05), np.sin(0.05)
        seen[:, :2] = seen[:, :2] @ np.array([[cos, sin], [-sin, cos]])
    fresh, off = rng.standard_normal(seen.shape), np.zeros_like(seen)
    off[0] = fresh[0]
    for i in range(1, len(t)):
        off[i] = MEMORY * off[i - 1] + np.sqrt(1 - MEMORY**2) * fresh[i]
    seen += off * [POSITION_M, POSITION_M, HEADING_RAD]
    seen[:, 2] = np.angle(np.exp(1j * seen[:, 2]))
    seen[rng.random(len(t)) < LOST] = np.nan
    k = np.minimum(np.searchsorted(ends, t + 1e-9, side="right"), len(ends) - 1)
    columns = ["t_s", "left_m_s", "right_m_s", "x_m", "y_m", "heading_rad"]
    last = [ends[-1], 0.0, 0.0, np.nan, np.nan, np.nan]
    table = pd.DataFrame(np.vstack([np.column_stack([t, told[k], seen]), last]), columns=columns)
    table.insert(0, "trial", trial)
    return table


def main(folder: str, *causes: str) -> None:
    """Write the logs of all causes, or of those named."""
    Path(folder).mkdir(parents=True, exist_ok=True)
    for cause in causes or CAUSES:
        world(cause).to_csv(Path(folder) / f"{cause}.csv", index=False)
        print(f"{cause}: {CAUSES[cause]}")


if __name__ == "__main__":
    main(*sys.argv[1:])
