"""Effects that no robot has: controls that say how much any spare number seems to explain.

Each has the form of a real effect, but goes by something that cannot matter. Where trials have the same commands, what happens
in another trial is what happens in this one: so its sign is another one in each trial, too.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np

from bns.physics.effect import Effect, Parameter
from bns.physics.order import DECOYS as BETWEEN
from bns.physics.signals import Array, Body

_GOLDEN = 0.6180339887498949
"""Multiples of it, without their whole part, never repeat: lots that need no generator."""


def _trial_sign(body: Body, stream: int) -> Array:
    """+1 or -1 for each trial, as if by lot, (batch, 1)."""
    share = np.modf((np.arange(len(body.forward_m_s)) + 1) * _GOLDEN * (stream + 1))[0]
    signs: Array = np.where(share < 0.5, -1.0, 1.0)[:, None]
    return signs


def _wave(body: Body, period_s: float, stream: int) -> Array:
    """A wave along the session, its phase another one for each trial."""
    phase = np.modf((np.arange(len(body.forward_m_s)) + 1) * _GOLDEN * (stream + 2))[0][:, None]
    wave: Array = np.sin(2 * np.pi * (body.session_s / period_s + phase))
    return wave


def _faster_in_some_trials(body: Body, size: float) -> Body:
    return replace(body, forward_m_s=body.forward_m_s * (1 + size * _trial_sign(body, 1)))


def _turning_in_some_trials(body: Body, size: float) -> Body:
    return replace(body, yaw_rad_s=body.yaw_rad_s * (1 + size * _trial_sign(body, 2)))


def _faster_in_waves(body: Body, size: float) -> Body:
    return replace(body, forward_m_s=body.forward_m_s * (1 + size * _wave(body, 2.3, 3)))


def _turning_in_waves(body: Body, size: float) -> Body:
    return replace(body, yaw_rad_s=body.yaw_rad_s + size * body.moving * _wave(body, 3.7, 4))


def _slip_of_another_trial(body: Body, size: float) -> Body:
    other = _trial_sign(body, 5) * np.abs(np.roll(body.yaw_rad_s, 1, axis=0))
    return replace(body, forward_m_s=body.forward_m_s * (1 - size * other))


def _sideways_of_another_trial(body: Body, size: float) -> Body:
    other = _trial_sign(body, 6) * np.roll(body.forward_m_s * body.yaw_rad_s, 1, axis=0)
    return replace(body, sideways_m_s=body.sideways_m_s + size * other)


def _decoy(number: int, apply: Callable[[Body, float], Body]) -> Effect:
    return Effect(
        name=f"decoy-{number}",
        stage="body",
        parameters=(Parameter("size", "1", -1.0, 1.0, (-0.5, 0.5), 0.0, "means nothing"),),
        equation="none",
        residuals="none",
        lookalikes=(),
        apply=apply,
        after=BETWEEN,
    )


DECOYS = tuple(
    _decoy(number, apply)
    for number, apply in enumerate(
        (
            _faster_in_some_trials,
            _turning_in_some_trials,
            _faster_in_waves,
            _turning_in_waves,
            _slip_of_another_trial,
            _sideways_of_another_trial,
        ),
        start=1,
    )
)
