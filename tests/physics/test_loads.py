"""What a load does to the wheels that move it: limits by force, an eccentric wheel that lifts it, a caster's hinge."""

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from bns.errors import ModelError
from bns.physics.effects import effect_named
from bns.physics.model import Model
from bns.physics.signals import Body, Wheels
from bns.physics.wheels.scans import limited_together, rate_limited, swivelled

B = 0.0884
STEP = np.full((2, 120), 0.03)


def commands(seed, low, high, steps=30):
    return np.repeat(np.random.default_rng(seed).uniform(low, high, (2, 2, 120 // steps)), steps, axis=2)


def test_limits_of_force_are_those_of_a_body_with_mass_and_inertia():
    """Two stiff controllers with limited force on one rigid body, in steps of 0.1 ms."""
    left, right = commands(1, -0.2, 0.2)
    straight, turning, fine = 0.3, 1.1, 300
    means = limited_together(left, right, STEP, straight, turning)
    for row in range(2):
        w, seen = np.zeros(2), []
        for target in np.stack([left[row], right[row]], axis=1):
            way = np.zeros(2)
            for _ in range(fine):
                force = np.clip((target - w) * 5e3, -1.0, 1.0)
                together, apart = force.sum() / 2, (force[1] - force[0]) / 2
                w = w + np.array([straight * together - turning * apart, straight * together + turning * apart]) * 0.03 / fine
                way += w / fine
            seen.append(way)
        np.testing.assert_allclose(np.stack(means)[:, row].T, seen, atol=2e-3)


def test_equal_limits_are_those_of_each_wheel_by_itself():
    left, right = commands(2, -0.2, 0.2)
    means = limited_together(left, right, STEP, 0.3, 0.3)
    np.testing.assert_allclose(means, [rate_limited(one, STEP, 0.3) for one in (left, right)], atol=1e-12)
    wheels = Wheels(STEP, left, right, B)
    with_ratio = effect_named("acceleration-limit").apply(wheels, max_m_s2=0.3, turn_ratio=4.0)
    assert np.abs(with_ratio.left_m_s - means[0]).max() > 0.02


def test_a_caster_rolls_where_it_points():
    forward, yaw = commands(5, -0.1, 0.1)
    yaw = 10 * yaw
    trail, pivot, friction, damping = 0.03, -0.05, 0.0, 0.004
    pushed, turned = swivelled(forward, yaw, STEP, np.array([2.0]), friction, damping, trail, pivot)
    ends = np.cumsum(STEP[0])
    for row in range(2):

        def rate(t, state, row=row):
            k = min(np.searchsorted(ends, t, side="right"), 119)
            v, w, psi = forward[row, k], yaw[row, k], state[0]
            s = (w * pivot * np.cos(psi) - v * np.sin(psi)) / trail - w
            return [s, damping * s * np.sin(psi), damping * s * (trail - pivot * np.cos(psi))]

        exact = solve_ivp(rate, (0, ends[-1]), [2.0, 0, 0], max_step=2e-3, t_eval=ends).y[1:]
        ways = np.stack([np.cumsum(one[row] * STEP[row]) for one in (pushed, turned)])
        np.testing.assert_allclose(ways, exact, atol=0.03 * np.abs(exact).max())


def test_a_caster_drags_only_until_it_trails_behind_its_hinge():
    ahead = np.where(np.arange(120) < 60, 0.1, -0.1) * np.ones((2, 1))
    body = Body(
        ahead, 0 * ahead, 0 * ahead + 0.2, ahead != 0, ahead, ahead, np.cumsum(STEP, axis=1), wheelbase_m=B, step_s=STEP
    )
    values = {"friction_m_s": 0.01, "damping_m": 0.002, "trail_m": 0.02, "pivot_m": -0.05}
    changed = np.abs(effect_named("caster-drag").apply(body, **values).forward_m_s - ahead)
    assert changed[:, 50:60].max() < 2e-4  # 15 cm on, it trails whatever its direction was
    assert changed[:, 61:80].max() > 1e-3  # it swings round
    assert changed[:, 115:].max() < 2e-4


def test_a_model_that_gives_no_turn_ratio_has_the_limit_of_each_wheel_by_itself():
    limit = effect_named("acceleration-limit")
    assert limit.checked({"max_m_s2": 0.3}) == (0.3, 1.0)
    assert limit.checked({"max_m_s2": 0.3, "turn_ratio": 4.0}) == (0.3, 4.0)
    with pytest.raises(ModelError, match="lacks max_m_s2"):
        limit.checked({"turn_ratio": 4.0})
    model = Model(B).with_effect("acceleration-limit", max_m_s2=0.3)
    assert "turn_ratio" not in model.canonical_json()
    assert model.digest != Model(B).with_effect("acceleration-limit", max_m_s2=0.3, turn_ratio=4.0).digest
