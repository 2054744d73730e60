"""Tyres that slip, behind the lag of the wheels: against the equations in steps of 0.1 ms."""

import numpy as np
import pytest

from bns.physics.effects import effect_named
from bns.physics.effects.traction_limit import PARTS, _in_parts
from bns.physics.signals import Conditions, Wheels

STEP_S, FINE_S = 0.04, 1e-4
TAU_S, LIMIT_M_S2, RATIO = 0.1, 0.8, 1.5


def told(*commands):
    """Each command (left, right; m/s) for half a second."""
    sides = np.repeat(np.array(commands, dtype=float).T, round(0.5 / STEP_S), axis=1)
    step_s = np.full((1, sides.shape[1]), STEP_S)
    return Wheels(step_s, sides[:1], sides[1:], 0.3, Conditions())


def acted(wheels, tau_s):
    late = effect_named("motor-lag").apply(wheels, tau_s=tau_s) if tau_s else wheels
    slipped = effect_named("traction-limit").apply(late, max_m_s2=LIMIT_M_S2, turn_ratio=RATIO)
    return np.stack([slipped.left_m_s[0], slipped.right_m_s[0]])


def in_small_steps(wheels, tau_s):
    """Two wheels that lag, and a body that each of them pushes with no more than it can: mean speeds of each step (2, steps)."""
    commands = np.stack([wheels.left_m_s[0], wheels.right_m_s[0]])
    turning, body, out = np.zeros(2), np.zeros(2), np.zeros_like(commands)
    parts = round(STEP_S / FINE_S)
    for k in range(commands.shape[1]):
        for _ in range(parts):
            turning = turning + (commands[:, k] - turning) * (FINE_S / tau_s if tau_s else 1.0)
            push = np.clip((turning - body) / FINE_S, -LIMIT_M_S2, LIMIT_M_S2)
            straight, spin = push.sum() / 2, (push[1] - push[0]) / 2 * RATIO
            body = body + np.array([straight - spin, straight + spin]) * FINE_S
            out[:, k] += body / parts
    return out


FAST = ((0.2, 0.2), (0.05, 0.2), (-0.2, 0.2), (-0.2, -0.2), (0.0, 0.0))
SLOW = ((0.1, 0.1), (0.05, 0.1), (0.1, 0.05), (0.08, 0.1), (0.0, 0.0))
"""The first command is at the limit for a moment only."""


@pytest.mark.parametrize("commands", [FAST, SLOW])
@pytest.mark.parametrize("tau_s", [0.0, TAU_S])
def test_the_robot_follows_its_wheels_as_fast_as_friction_lets_it(tau_s, commands):
    wheels = told(*commands)
    way_mm = 1e3 * STEP_S * np.cumsum(acted(wheels, tau_s) - in_small_steps(wheels, tau_s), axis=1)
    assert np.abs(way_mm).max() < 0.25  # of 100 mm in each command
    late = effect_named("motor-lag").apply(wheels, tau_s=tau_s) if tau_s else wheels
    unlimited = np.stack([late.left_m_s[0], late.right_m_s[0]])
    assert 1e3 * STEP_S * np.abs(np.cumsum(acted(wheels, tau_s) - unlimited, axis=1)).max() > (1.0 if commands is FAST else 0.1)


@pytest.mark.parametrize("side", [1.0, -1.0, 0.0])
def test_what_is_slower_than_the_limit_is_not_late(side):
    """Taken as steps, a lag of 0.1 s and half of the limit would come late by a quarter of a step, 10 ms."""
    ramp = np.linspace(0.0, 0.4 * LIMIT_M_S2, round(0.8 / STEP_S))[None]
    wheels = Wheels(np.full(ramp.shape, STEP_S), ramp, side * ramp, 0.3, Conditions())
    slipped, late = acted(wheels, TAU_S), effect_named("motor-lag").apply(wheels, tau_s=TAU_S)
    late_s = np.abs(late.left_m_s[0] - slipped[0])[5:-1].max() / (0.4 * LIMIT_M_S2 / 0.8)
    assert late_s < 3e-4


def test_without_a_lag_it_is_a_limit_of_force():
    wheels = told((0.2, 0.1), (0.0, 0.2))
    forced = effect_named("force-limit").apply(wheels, max_m_s2=LIMIT_M_S2, turn_ratio=RATIO)
    assert acted(wheels, 0.0) == pytest.approx(np.stack([forced.left_m_s[0], forced.right_m_s[0]]))


@pytest.mark.parametrize(
    ("steps", "steep"),
    [
        ((0.1, 0.1, 0.2, 0.2), (0.0, 0.0)),  # a jump
        ((0.1, 0.1, 0.2, 0.25), (0.0, 0.075)),  # and what follows it
        ((0.1, 0.3, 0.2, 0.2), (0.0, 0.0)),  # a peak
        ((0.1, 0.2, 0.3, 0.4), (0.1, 0.1)),  # a ramp
        ((0.1, 0.12, 0.3, 0.32), (0.04, 0.04)),
    ],
)
def test_a_jump_stays_a_jump_and_a_ramp_a_ramp(steps, steep):
    """By how much the speed changes within the second and the third step; each keeps its mean."""
    parts, _ = _in_parts(np.array([steps]), np.full((1, 4), STEP_S))
    each = parts.reshape(4, PARTS)
    assert each.mean(axis=1) == pytest.approx(steps)
    assert np.diff(each, axis=1).mean(axis=1)[1:3] * PARTS == pytest.approx(steep, abs=1e-12)
