"""A swivel caster and its hinge, against the equations of its motion."""

import numpy as np
from scipy.integrate import solve_ivp

from bns.physics.effects import effect_named
from bns.physics.signals import Body
from bns.physics.wheels.casters import swivelled

B = 0.0884
STEP = np.full((2, 120), 0.03)


def commands(seed, low, high, steps=30):
    return np.repeat(np.random.default_rng(seed).uniform(low, high, (2, 2, 120 // steps)), steps, axis=2)


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


def test_dry_friction_is_alike_in_coarse_and_in_fine_steps():
    """While the caster swings round, in two steps of a camera and in 320."""
    ways = []
    for steps in (2, 320):
        step = np.full((1, steps), 0.16 / steps)
        forward, yaw = np.full((1, steps), 0.15), np.full((1, steps), 0.8)
        found = swivelled(forward, yaw, step, np.array([2.0]), 0.01, 0.0, 0.015, -0.05)
        ways.append([float((one * step).sum()) for one in found])
    np.testing.assert_allclose(ways[0], ways[1], rtol=1e-3)
