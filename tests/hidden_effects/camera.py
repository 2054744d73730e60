"""From true paths to the table a lab would have: frames, noise, lost markers, outliers, quantisation, clocks."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import pandas as pd
from scipy.signal import lfilter

from tests.hidden_effects.cause import Cause
from tests.hidden_effects.driving import FRAME_S, Driving
from tests.hidden_effects.listed import voltage
from tests.hidden_effects.motion import Paths

VOLT_NOISE_V = 0.005


@dataclass(frozen=True)
class Camera:
    """What is wrong with the measuring in every world.

    Standard deviations of one pose and of time stamps; shares of rows lost (in gaps of a few frames) and of outliers.
    """

    position_m: float
    heading_rad: float
    quantum_m: float = 0.0005
    quantum_rad: float = 0.001
    lost: float = 0.02
    outliers: float = 0.0
    stamp_s: float = 0.0
    memory: float = 0.0
    """Correlation of the noise from frame to frame (AR(1)), its standard deviation as stated."""


@dataclass(frozen=True)
class Layout:
    """How the table is written.

    rows: `frames` (commands change on frames), `frames+changes` (an extra row at each change of command) or `ends` (rows at
    ends of commands only). blind: extra rows have no pose. missing: lost rows are left out, not NaN.
    """

    rows: str = "frames"
    blind: bool = False
    missing: bool = False
    wrapped: bool = False
    session: bool = True
    voltage: bool = False
    tail_s: float = 0.0
    frame_s: float = FRAME_S


def track(
    rng: np.random.Generator,
    paths: Paths,
    driving: Driving,
    causes: Sequence[Cause],
    camera: Camera,
    layout: Layout,
) -> pd.DataFrame:
    """The table of measurements."""
    trials = [_trial(rng, trial, paths, driving, causes, camera, layout) for trial in range(len(driving.counts))]
    return pd.concat(trials, ignore_index=True)


def _trial(
    rng: np.random.Generator,
    trial: int,
    paths: Paths,
    driving: Driving,
    causes: Sequence[Cause],
    camera: Camera,
    layout: Layout,
) -> pd.DataFrame:
    edges = driving.edges_s[trial, : driving.counts[trial] + 1]
    t, extra = stamps(edges, layout)
    poses = paths.stamped(trial, t, causes)
    for cause in causes:
        poses = cause.seen(poses)
    poses = _noisy(rng, poses, camera)
    poses[extra & layout.blind] = np.nan
    gone = _lost(rng, len(t), camera.lost) & ~_changes(t, edges)
    poses[gone] = np.nan
    table = _rows(trial, t, edges, driving, poses, layout)
    if layout.rows == "frames":  # extra rows may lie closer to a frame than stamps err
        table["t_s"] += _stamp_error(rng, len(t), camera.stamp_s)
    _session(rng, table, driving.session_s[trial], layout)
    return table[~gone] if layout.missing else table


def stamps(edges: np.ndarray, layout: Layout) -> tuple[np.ndarray, np.ndarray]:
    """Times (rows,) of a trial's rows, and which of them are there for a change of command alone."""
    if layout.rows == "ends":
        return edges.copy(), np.zeros(len(edges), bool)
    frames = layout.frame_s * np.arange(int(np.floor((edges[-1] + layout.tail_s) / layout.frame_s + 1e-6)) + 1)
    more = edges[np.abs(edges[:, None] - frames).min(axis=1) > 1e-6]
    t = np.concatenate([frames, more])
    order = np.argsort(t, kind="stable")
    return t[order], (np.arange(len(t)) >= len(frames))[order]


def _changes(t: np.ndarray, edges: np.ndarray) -> np.ndarray:
    return np.abs(t[:, None] - edges).min(axis=1) < 1e-6


def _noisy(rng: np.random.Generator, poses: np.ndarray, camera: Camera) -> np.ndarray:
    size = np.array([camera.position_m, camera.position_m, camera.heading_rad])
    white = rng.normal(size=poses.shape)
    if camera.memory and len(white) > 1:
        white[1:] *= np.sqrt(1 - camera.memory**2)
        white = lfilter([1.0], [1.0, -camera.memory], white, axis=0)
    out = poses + white * size
    jumps = rng.uniform(-1, 1, poses.shape) * np.array([0.3, 0.3, 2.0])
    out += jumps * (rng.random((len(poses), 1)) < camera.outliers)
    quanta = np.array([camera.quantum_m, camera.quantum_m, camera.quantum_rad])
    return np.round(out / quanta) * quanta


def _lost(rng: np.random.Generator, rows: int, share: float) -> np.ndarray:
    """Gaps of one to eight rows; never the first row."""
    gone = np.zeros(rows, bool)
    for start in np.flatnonzero(rng.random(rows) < share / 4.5):
        gone[start + 1 : start + 1 + rng.integers(1, 9)] = True
    return gone


def _stamp_error(rng: np.random.Generator, rows: int, stamp_s: float) -> np.ndarray:
    error = np.clip(rng.normal(0, stamp_s, rows) if stamp_s else np.zeros(rows), -3 * stamp_s, 3 * stamp_s)
    error[0] = abs(error[0])
    return error


def _rows(
    trial: int, t: np.ndarray, edges: np.ndarray, driving: Driving, poses: np.ndarray, layout: Layout
) -> pd.DataFrame:
    now = np.searchsorted(edges, t + 1e-6, side="right") - 1
    driven = now < driving.counts[trial]
    commands = driving.wheels_m_s[trial, np.minimum(now, driving.counts[trial] - 1)]
    commands = np.where(driven[:, None], commands, np.nan)
    heading = np.angle(np.exp(1j * poses[:, 2])) if layout.wrapped else poses[:, 2]
    return pd.DataFrame(
        {
            "trial": trial,
            "t_s": t,
            "left_m_s": commands[:, 0],
            "right_m_s": commands[:, 1],
            "x_m": poses[:, 0],
            "y_m": poses[:, 1],
            "heading_rad": heading,
        }
    )


def _session(rng: np.random.Generator, table: pd.DataFrame, began_s: float, layout: Layout) -> None:
    since = began_s + table["t_s"]
    if layout.session:
        table["session_s"] = since
    if layout.voltage:
        table["battery_v"] = np.round(voltage(since.to_numpy()) + rng.normal(0, VOLT_NOISE_V, len(table)), 3)
