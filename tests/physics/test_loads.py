"""What a load does to the wheels that move it: limits by force, an eccentric wheel that lifts it, a caster's hinge."""

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from bns.errors import ModelError
from bns.physics.effects import effect_named
from bns.physics.effects.wheel_eccentricity import starts_from
from bns.physics.model import Model
from bns.physics.signals import Body, Conditions, Wheels
from bns.physics.wheels.scans import limited_together, rate_limited, swivelled, turned_under_load

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


def test_a_wheel_under_load_turns_as_the_equation_says():
    speed = commands(3, -0.1, 0.1)
    start, droop, turn = np.array([0.7, 2.0]), np.array([0.02, 0.0]), 0.13
    per_m, way = 2 * np.pi / turn, speed * STEP
    free = (np.cumsum(way, axis=2) - way / 2) * per_m
    starts = np.broadcast_to(start[None, :, None], (2, 2, 2))
    cos, sin, led = turned_under_load(speed, STEP, np.cos(free), np.sin(free), starts, droop, per_m, 0.05)
    ends = np.cumsum(STEP[0])
    for wheel, n, row in ((0, 0, 0), (0, 1, 1), (1, 1, 0)):

        def rate(t, state, wheel=wheel, row=row):
            u = speed[wheel, row, min(np.searchsorted(ends, t, side="right"), 119)]
            return [
                (u + droop[wheel] * np.sin(state[0])) * per_m,
                u * np.cos(state[0]) + 0.05 * np.sin(state[0]),
            ]

        exact = solve_ivp(rate, (0, ends[-1]), [start[n], 0], max_step=2e-3, t_eval=ends - 0.015).y
        assert np.abs(np.exp(1j * exact[0]) - (cos + 1j * sin)[wheel, n, row]).max() < 5e-3
        assert np.abs(exact[1] - led[wheel, n, row]).max() < 2e-4


def test_a_wheel_that_lifts_a_load_is_found_from_headings_whatever_its_angle_at_the_start():
    """Its speed falls short by as much at any speed; without the droop, slow commands are off by a third of theirs."""
    rng = np.random.default_rng(7)
    trials, fine, share, droop = 24, 10, 0.08, 0.1
    step = np.full((trials, 200), 0.05)
    left, right = (np.repeat(rng.uniform(-0.1, 0.1, (trials, 8)), 25, axis=1) for _ in range(2))
    phi, really = rng.uniform(0, 2 * np.pi, trials), np.zeros_like(left)
    for k in range(200):
        for _ in range(fine):
            turned = left[:, k] + share * droop * np.sin(phi)
            really[:, k] += turned * (1 + share * np.cos(phi)) / fine
            phi += turned * 0.05 / fine * 2 * np.pi / 0.13
    rate = (right - really) / B * step
    heading = np.cumsum(rate, axis=1) - rate / 2 + rng.normal(0, 0.004, rate.shape)
    wheels = Wheels(step, left, right, B, Conditions(seen=np.stack([0 * heading, 0 * heading, heading], axis=2)))
    values = {"left_share": share, "right_share": 0.0, "turn_m": 0.13}
    with_load = effect_named("wheel-eccentricity").apply(wheels, **values, droop_m_s=droop)
    without = effect_named("wheel-eccentricity").apply(wheels, **values)
    assert np.std(with_load.left_m_s - really) < 0.3 * np.std(left - really)
    assert np.std(with_load.left_m_s - really) < 0.4 * np.std(without.left_m_s - really)
    best = starts_from(wheels)[1]
    assert best[2] == pytest.approx(0.13, rel=0.05)
    assert 0.03 <= best[3] <= 0.3


def test_without_a_droop_the_wave_is_the_one_of_the_speed_alone():
    left, right = commands(4, 0.05, 0.1)
    way = left * STEP
    turned = effect_named("wheel-eccentricity").apply(Wheels(STEP, left, right, B), 0.1, 0.0, 0.13)
    wave = 0.1 * np.cos((np.cumsum(way, axis=1) - way / 2) * 2 * np.pi / 0.13) * np.sinc(left * STEP / 0.13)
    np.testing.assert_allclose(turned.left_m_s, left * (1 + wave), rtol=1e-12)


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
    assert effect_named("wheel-eccentricity").checked({"left_share": 0.1, "right_share": 0.0, "turn_m": 0.1})[3] == 0.0
    with pytest.raises(ModelError, match="lacks max_m_s2"):
        limit.checked({"turn_ratio": 4.0})
    model = Model(B).with_effect("acceleration-limit", max_m_s2=0.3)
    assert "turn_ratio" not in model.canonical_json()
    assert model.digest != Model(B).with_effect("acceleration-limit", max_m_s2=0.3, turn_ratio=4.0).digest
