"""A centre of mass off the axle, against the equations of motion of such a robot."""

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from bns.physics.effects.mass_offset import apply
from bns.physics.model import Model
from bns.physics.signals import Body
from bns.physics.wheels.differential_drive import simulate

MASS, INERTIA, BASE, FORCE = 4.0, 0.04, 0.26, 25.0
"""kg, kg m^2 about the centre of mass, m, and N per m/s of each wheel's motor."""


def driven(ahead_m, left, right, lasted_s=6.0):
    """Where it ends: (x, y, heading), from the forces of motors that follow their commands like springs of speed."""

    def forces(_, state):
        v, w, _, _, heading = state
        pull, push = FORCE * (left - (v - w * BASE / 2)), FORCE * (right - (v + w * BASE / 2))
        dv = (pull + push) / MASS + ahead_m * w**2
        dw = ((push - pull) * BASE / 2 - MASS * ahead_m * v * w) / (INERTIA + MASS * ahead_m**2)
        return [dv, dw, v * np.cos(heading), v * np.sin(heading), w]

    return solve_ivp(forces, (0.0, lasted_s), np.zeros(5), rtol=1e-10, atol=1e-12)["y"][:, -1]


@pytest.mark.parametrize("ahead_m", [0.05, -0.05])
@pytest.mark.parametrize(("left", "right"), [(0.1, 0.3), (-0.1, -0.3), (0.3, -0.2), (0.25, 0.25)])
def test_it_turns_as_its_equations_of_motion_say(ahead_m, left, right):
    """In settled motion: the way of the last second of seven."""
    model = Model(wheelbase_m=BASE).with_effect("mass-offset", lead_m_s=MASS * ahead_m / (2 * FORCE))
    start, end = driven(ahead_m, left, right), driven(ahead_m, left, right, 7.0)
    tables = (np.array([[one]]) for one in (left, right, 1.0))
    found = simulate(model, *tables, start=start[None, 2:])[0, -1]
    assert end[4] - start[4] == pytest.approx(found[2] - start[4], abs=2e-4)
    np.testing.assert_allclose(found[:2], end[2:4], atol=2e-4)
    other = simulate(Model(wheelbase_m=BASE), *(np.array([[one]]) for one in (left, right, 1.0)), start=start[None, 2:])[0, -1]
    assert left == right or np.hypot(*(other - found)[:2]) > 2e-3


def test_a_robot_that_would_spin_turns_three_times_as_fast_at_most():
    model = Model(wheelbase_m=BASE).with_effect("mass-offset", lead_m_s=-0.05)
    poses = simulate(model, np.array([[0.4]]), np.array([[0.5]]), np.array([[1.0]]), start=(0.0, 0.0, 0.0))
    assert poses[0, -1, 2] == pytest.approx(3 * 0.1 / BASE)


@pytest.mark.parametrize("lead_m_s", [0.01, -0.006])
def test_speed_and_turn_rate_have_settled(lead_m_s):
    """Also where a sixth of the turn rate is lost."""
    v, w, none = np.array([[0.3]]), np.array([[1.5]]), np.zeros((1, 1))
    found = apply(Body(v, none, w, none + 1, none, none, none, wheelbase_m=BASE), lead_m_s)
    np.testing.assert_allclose(found.forward_m_s, v + lead_m_s * found.yaw_rad_s**2, rtol=1e-9)
    kept = 1 + 4 * lead_m_s * found.forward_m_s / BASE**2
    np.testing.assert_allclose(found.yaw_rad_s, w / kept, rtol=1e-5)
    assert abs(kept - 1) > 0.05
