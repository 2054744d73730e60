"""Which way each effect acts, and how much, by hand: one command of constant speeds is an arc."""

import math

import numpy as np
import pytest

from bns.physics.model import Model
from bns.physics.wheels.differential_drive import simulate

LEFT, RIGHT, BASE, TIME_S = 0.1, 0.2, 0.1, 1.5
"""Forward 0.15 m/s, turning left by 1 rad/s."""


def arc(forward, to_the_right, yaw):
    """Where a robot is that began at the origin, heading east."""
    angle = yaw * TIME_S
    along, across = math.sin(angle) / yaw, (1.0 - math.cos(angle)) / yaw  # integrals of cos and sin
    return forward * along + to_the_right * across, forward * across - to_the_right * along, angle


@pytest.mark.parametrize(
    ("effect", "values", "forward", "to_the_right", "yaw"),
    [
        ("understeer", {"loss_s_m": 0.4}, 0.15, 0.0, 1.0 - 0.4 * 0.15),
        ("understeer", {"loss_s_m": -0.4}, 0.15, 0.0, 1.0 + 0.4 * 0.15),
        ("turn-slip", {"slip_s": 0.2}, 0.15 * 0.8, 0.0, 1.0),
        ("turn-slip-quadratic", {"slip_s2": 0.3}, 0.15 * 0.7, 0.0, 1.0),
        ("side-slip", {"slip_s": 0.5}, 0.15, 0.5 * 0.15, 1.0),
        ("yaw-bias", {"rate_rad_s": 0.1}, 0.15, 0.0, 1.1),
        ("turn-asymmetry", {"share": 0.1}, 0.15, 0.0, 1.1),
        ("pivot-slip", {"loss": 0.5}, 0.15, 0.0, 1.0),
        ("wheelbase", {"factor": 1.25}, 0.15, 0.0, 0.8),
        ("speed-gain", {"gain": 1.1}, 0.165, 0.0, 1.1),
        ("speed-limit", {"max_m_s": 0.16}, 0.13, 0.0, 0.6),
        ("wheel-mismatch", {"ratio": 1.2}, 0.34 / 2.2, 0.0, 2.8 / 2.2),
    ],
)
@pytest.mark.parametrize("backwards", [False, True])
def test_one_command_by_hand(effect, values, forward, to_the_right, yaw, backwards):
    model = Model(wheelbase_m=BASE).with_effect(effect, **values)
    way = -1.0 if backwards else 1.0
    if backwards:  # the other way round the same circle: speeds and turning change their signs
        forward, yaw = -forward, ({"yaw-bias": 0.2, "turn-asymmetry": 0.2}.get(effect, 0.0) - yaw)
    poses = simulate(model, np.array([[way * LEFT]]), np.array([[way * RIGHT]]), np.array([[TIME_S]]), start=(0.0, 0.0, 0.0))
    np.testing.assert_allclose(poses[0, -1], arc(forward, to_the_right, yaw), rtol=1e-6, atol=1e-9)


@pytest.mark.parametrize(
    ("left", "right", "kept"),
    [(-0.1, 0.1, 0.8), (0.1, -0.1, 0.8), (-0.05, 0.1, 0.9), (0.05, -0.1, 0.9), (0.0, 0.1, 1.0), (0.05, 0.1, 1.0)],
)
def test_a_turn_loses_as_far_as_the_inner_wheel_runs_against_the_outer_one(left, right, kept):
    model = Model(wheelbase_m=BASE).with_effect("pivot-slip", loss=0.2)
    poses = simulate(model, np.array([[left]]), np.array([[right]]), np.array([[0.5]]), start=(0.0, 0.0, 0.0))
    assert poses[0, -1, 2] == pytest.approx(kept * (right - left) / BASE * 0.5)
