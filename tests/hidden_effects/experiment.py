"""A planned experiment carried out in a world of this benchmark's own equations."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pandas as pd

from bns.diagnose.design.sequences import Sequences
from tests.hidden_effects.camera import Camera, Layout, track
from tests.hidden_effects.cause import Cause
from tests.hidden_effects.driving import Driving
from tests.hidden_effects.luck import luck
from tests.hidden_effects.motion import move
from tests.hidden_effects.world import motor_jitter

STEP_S = 4e-3
PAUSE_S = 5.0


@dataclass(frozen=True)
class Look:
    """The robot and how it is looked at, apart from what is hidden."""

    wheelbase_m: float
    camera: Camera
    layout: Layout
    jitter: float


def carried_out(
    plan: Sequences, start: Sequence[float], hidden: Sequence[Cause], look: Look, seed: int, words: Sequence[str]
) -> pd.DataFrame:
    """What the camera sees of a plan, every trial from ``start``; ``words`` and ``seed`` name the luck."""
    count, most = plan.duration_s.shape
    edges = np.concatenate([np.zeros((count, 1)), np.cumsum(plan.duration_s, axis=1)], axis=1)
    wheels = np.stack([plan.left_m_s, plan.right_m_s], axis=2)
    counts = (plan.duration_s > 0).sum(axis=1)
    begins = np.concatenate([[0.0], np.cumsum(plan.lasting_s + PAUSE_S)[:-1]])
    driving = Driving(wheels, edges, counts, np.tile(np.array(start), (count, 1)), begins)
    jitter = motor_jitter(luck(seed, *words, "jitter"), (count, most, 2), look.jitter)
    paths = move(driving, look.wheelbase_m, list(hidden), jitter, luck(seed, *words), look.layout.tail_s, STEP_S)
    return track(luck(seed, *words, "camera"), paths, driving, list(hidden), look.camera, look.layout)


def plan_in(path: Path) -> tuple[Sequences, tuple[float, float, float]]:
    """The commands of a trial file, and the pose that its trials start from."""
    table = pd.read_csv(path)
    trials = [rows[["left_m_s", "right_m_s", "duration_s"]].to_numpy() for _, rows in table.groupby("trial", sort=False)]
    most = max(map(len, trials))
    padded = np.stack([np.pad(rows, ((0, most - len(rows)), (0, 0))) for rows in trials])
    x, y, heading = table[["start_x_m", "start_y_m", "start_heading_rad"]].iloc[0]
    return Sequences(*np.moveaxis(padded, 2, 0)), (float(x), float(y), float(heading))
