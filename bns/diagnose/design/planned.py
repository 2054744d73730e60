"""Tracks of trials that nobody has driven yet: what a model says that the camera will see of planned commands."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import replace

import numpy as np

from bns.diagnose.data.tracks import Array, Tracks
from bns.diagnose.design.sequences import Sequences
from bns.diagnose.predict.horizons import laid_paths
from bns.diagnose.predict.wheels import WheelPredictor
from bns.diagnose.residuals.grammar import SHIFTS
from bns.diagnose.settings import DEFAULTS
from bns.physics.model import Model

_PLACE_ROUNDS = DEFAULTS.design.place_rounds


def planned_tracks(
    plan: Sequences, start: tuple[float, float, float], frame_s: float | None, begins_s: Array
) -> Tracks:
    """The frames of a plan, every pose still at the start. ``frame_s``: time between frames; None: poses at ends of commands.

    ``begins_s`` (trials,): time of the session at the start of each trial.
    """
    times = [_times(lasts[lasts > 0], frame_s) for lasts in plan.duration_s]
    counts = [len(t) for t in times]
    return Tracks(
        names=tuple(str(i) for i in range(len(plan))),
        first=np.concatenate([[0], np.cumsum(counts)]).astype(np.int64),
        t_s=np.concatenate(times),
        pose=np.tile(np.array(start), (sum(counts), 1)),
        left_m_s=plan.left_m_s,
        right_m_s=plan.right_m_s,
        duration_s=plan.duration_s,
        start_s=begins_s,
        start_known=True,
    )


def delays_of(models: Iterable[Model]) -> tuple[float, ...]:
    """Constant times (s) by which any of the models lets commands or stamps be late."""
    acting = (active for model in models for active in model.effects if active.effect.name in SHIFTS)
    return tuple(sorted({float(value) for active in acting for value in active.values}))


def noise_free_predictor(model: Model, tracks: Tracks, delays_s: Iterable[float] = ()) -> WheelPredictor:
    """A predictor on the tracks that the model says will be seen, free of noise, each from its first pose.

    ``delays_s``: of all models that are compared on these tracks (`delays_of`). A delay that ends inside a step of the grid is
    predicted a little wrongly, otherwise than a clock's offset that really does the same; and a search for commands that drive
    the two apart would find those of the largest such errors.
    """
    delays_s = tuple(delays_s)
    predictor = WheelPredictor(tracks, delays_s=delays_s)
    placed = any(model.at("world")) or any(active.effect.needs_place for active in model.effects)
    for _ in range(_PLACE_ROUNDS if placed else 1):
        tracks = replace(tracks, pose=laid_paths(tracks, predictor.steps(model)))
        predictor = WheelPredictor(tracks, delays_s=delays_s)
    return predictor


def _times(lasts: Array, frame_s: float | None) -> Array:
    ends = np.concatenate([[0.0], np.cumsum(lasts)])
    if frame_s is None:
        return np.asarray(ends, dtype=np.float64)
    frames = int(np.floor(ends[-1] / frame_s + 1e-6)) + 1
    return np.asarray(frame_s * np.arange(frames), dtype=np.float64)
