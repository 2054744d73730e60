"""A swivel caster and its hinge, against the equations of its motion."""

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.optimize import brentq

from bns.errors import ModelError
from bns.physics.effects import effect_named
from bns.physics.signals import Body
from bns.physics.wheels.casters import SLOW_RAD_S, swivelled

B = 0.0884
STEP = np.full((2, 120), 0.03)


def commands(seed, low, high, steps=30):
    return np.repeat(np.random.default_rng(seed).uniform(low, high, (2, 2, 120 // steps)), steps, axis=2)


@pytest.mark.parametrize(("friction", "damping"), [(0.0, 0.004), (0.01, 0.0), (0.006, 0.002)])
@pytest.mark.parametrize("pivot", [-0.05, 0.06])
def test_a_caster_rolls_where_it_points_and_turns_the_robot_that_turns_it(friction, damping, pivot):
    """Solved by scipy, where the rate of the hinge is the root of its equation."""
    forward, yaw = commands(5, -0.1, 0.1)
    yaw = 10 * yaw
    trail = 0.03
    pushed, turned = swivelled(forward, yaw, STEP, np.array([2.0]), np.ones(1), friction, damping, trail, pivot, B / 2)
    ends = np.cumsum(STEP[0])
    for row in range(2):

        def rate(t, state, row=row):
            k = min(np.searchsorted(ends, t, side="right"), 119)
            v, w, sin, cos = forward[row, k], yaw[row, k], np.sin(state[0]), np.cos(state[0])

            def missing(s):
                q = friction * s / (abs(s) + SLOW_RAD_S) + damping * s
                ahead, turn = v + q * sin, w + q * (trail - pivot * cos) / (B / 2) ** 2
                return (turn * pivot * cos - ahead * sin) / trail - turn - s

            s = brentq(missing, -200.0, 200.0)
            q = friction * s / (abs(s) + SLOW_RAD_S) + damping * s
            return [s, q * sin, q * (trail - pivot * cos)]

        exact = solve_ivp(rate, (0, ends[-1]), [2.0, 0, 0], max_step=5e-3, t_eval=ends).y[1:]
        ways = np.stack([np.cumsum(one[row] * STEP[row]) for one in (pushed, turned)])
        np.testing.assert_allclose(ways, exact, atol=0.02 * np.abs(exact).max())


def test_a_model_file_that_is_older_than_a_number_is_read():
    effect = effect_named("caster-drag")
    old = {"friction_m_s": 0.01, "damping_m": 0.002, "trail_m": 0.02, "pivot_m": -0.05}
    assert effect.checked(old) == (*old.values(), 0.0)
    with pytest.raises(ModelError, match="lacks trail_m"):
        effect.checked({"friction_m_s": 0.01, "damping_m": 0.002, "pivot_m": -0.05})


def test_casters_that_point_the_same_way_go_on_as_one():
    forward, yaw = commands(5, 0.05, 0.1)
    values = 0.01, 0.001, 0.02, -0.05, B / 2
    pair = np.array([2.0, 4.0])
    both = [swivelled(forward, yaw, STEP, a, np.full(len(a), 1 / len(a)), *values) for a in (pair, pair[:1])]
    other = swivelled(forward, yaw, STEP, np.array([4.0]), np.ones(1), *values)
    for mean, one, two in zip(*both, other, strict=True):
        np.testing.assert_allclose(mean, (one + two) / 2, atol=1e-9)
        assert not np.array_equal(one[:, :20], two[:, :20])


def test_a_caster_drags_only_until_it_trails_behind_its_hinge():
    ahead = np.where(np.arange(120) < 60, 0.1, -0.1) * np.ones((2, 1))
    body = Body(
        ahead, 0 * ahead, 0 * ahead + 0.2, ahead != 0, ahead, ahead, np.cumsum(STEP, axis=1), wheelbase_m=B, step_s=STEP
    )
    values = {"friction_m_s": 0.0, "damping_m": 0.004, "trail_m": 0.02, "pivot_m": -0.05}
    changed = np.abs(effect_named("caster-drag").apply(body, **values).forward_m_s - ahead)
    assert changed[:, 50:60].max() < 2e-4  # 15 cm on, it trails whatever its direction was
    assert changed[:, 61:80].max() > 1e-3  # it swings round
    assert changed[:, 115:].max() < 2e-4
    dry = values | {"friction_m_s": 0.01, "damping_m": 0.0}
    held = np.abs(effect_named("caster-drag").apply(body, **dry).forward_m_s - ahead)
    assert held[:, 50:60].min() > 3e-4  # the robot gives way before the hinge does, and the caster stays askew


def test_dry_friction_is_alike_in_coarse_and_in_fine_steps():
    """While the caster swings round, in two steps of a camera and in 320."""
    ways = []
    for steps in (2, 320):
        step = np.full((1, steps), 0.16 / steps)
        forward, yaw = np.full((1, steps), 0.15), np.full((1, steps), 0.8)
        found = swivelled(forward, yaw, step, np.array([2.0]), np.ones(1), 0.01, 0.0, 0.015, -0.05, B / 2)
        ways.append([float((one * step).sum()) for one in found])
    np.testing.assert_allclose(ways[0], ways[1], atol=2e-3 * np.abs(ways[1]).max())
