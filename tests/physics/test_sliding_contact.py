"""One point of the robot rubs on the floor: solved by scipy with mass and inertia, by forces within a disc, and by hand."""

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from bns.physics.model import Model
from bns.physics.wheels.differential_drive import simulate
from bns.physics.wheels.sliding import dragged
from tests.hidden_effects.cause import Moment
from tests.hidden_effects.listed_loads import BASE_M, SlidingContact

RNG = np.random.default_rng(5)
TOLD = RNG.uniform(-0.3, 0.3, (12, 2))
PLACES = [(0.02, 0.4, 0.0), (0.01, 1.2, 0.0), (0.05, 0.3, 0.2), (0.03, 0.7, -0.5), (0.04, 0.0, 0.0), (0.02, 0.0, 0.6)]


def speeds(left, right, friction, behind, aside=0.0):
    """Mean and difference of the wheels' speeds."""
    one, other = (side[0, 0] for side in dragged(np.array([[left]]), np.array([[right]]), friction, behind, aside))
    return (one + other) / 2, other - one


@pytest.mark.parametrize(("friction", "behind", "aside"), PLACES)
def test_it_is_where_a_body_with_friction_at_one_point_ends(friction, behind, aside):
    """Solved by scipy from rest, with mass, inertia and a friction that is steep near rest."""
    for left, right in TOLD:

        def rates(_t, state, told_v=(left + right) / 2, told_d=right - left):
            v, d = state
            along, across = v - aside * d, -behind * d
            speed = np.sqrt(along**2 + across**2 + 1e-12)
            pulled = 4 * friction * (aside * along + behind * across) / speed
            return [(told_v - v - friction * along / speed) / 0.1, (told_d - d + pulled) / 0.06]

        solved = solve_ivp(rates, (0, 4), np.zeros(2), method="LSODA", rtol=1e-9, atol=1e-11)
        assert speeds(left, right, friction, behind, aside) == pytest.approx(tuple(solved.y[:, -1]), abs=1e-5)


def test_without_friction_it_changes_nothing():
    told = TOLD.T[:, None, :]
    np.testing.assert_allclose(dragged(*told, 0.0, 0.7, 0.3), told, atol=1e-15)


def test_a_straight_line_loses_the_friction_and_a_turn_on_the_spot_four_times_it_per_distance():
    assert speeds(0.1, 0.1, 0.02, 0.6) == pytest.approx((0.08, 0.0))
    assert speeds(-0.1, 0.1, 0.02, 0.6) == pytest.approx((0.0, 0.2 - 4 * 0.02 * 0.6))


def test_what_drags_on_the_left_turns_the_robot_to_the_left_on_its_way_ahead_and_back_on_its_way_back():
    for way in (1.0, -1.0):
        assert speeds(0.1 * way, 0.1 * way, 0.02, 0.0, 0.1) == pytest.approx((0.08 * way, 4 * 0.02 * 0.1 * way))


def test_in_a_curve_both_share_one_force():
    """Worked out by hand: v·(1 + f/s) = told v, d·(1 + 4·f·p^2/s) = told d, for v = 0.06, p·d = 0.08 and so s = 0.1."""
    v, d, f, p = 0.06, 0.2, 0.02, 0.4
    told_v, told_d = v * (1 + f / 0.1), d * (1 + 4 * f * p**2 / 0.1)
    assert speeds(told_v - told_d / 2, told_v + told_d / 2, f, p) == pytest.approx((v, d))


def test_what_needs_less_than_the_friction_stays_at_rest_and_a_little_more_moves():
    assert speeds(0.019, 0.019, 0.02, 0.6) == pytest.approx((0.0, 0.0), abs=1e-12)
    assert speeds(0.021, 0.021, 0.02, 0.6)[0] == pytest.approx(0.001)
    assert speeds(-0.023, 0.023, 0.02, 0.6)[1] == pytest.approx(0.0, abs=1e-12)
    assert speeds(-0.025, 0.025, 0.02, 0.6)[1] == pytest.approx(0.002)
    assert speeds(-0.025, 0.025, 0.02, 0.0)[1] == pytest.approx(0.05)  # a point in the middle only twists


def test_the_second_implementation_agrees():
    values = {"friction_m_s": 0.02, "distance_share": 0.6, "left_share": 0.3}
    model = Model(wheelbase_m=BASE_M).with_effect("sliding-contact", **values)
    left, right, duration = [[0.2, 0.0, -0.1]], [[0.05, 0.1, 0.0]], [[0.5, 0.3, 0.6]]
    pose = simulate(model, left, right, duration)[0, -1]
    step_s = 5e-3
    told = np.stack([np.repeat(np.array(side)[0], np.rint(np.array(duration)[0] / step_s).astype(int)) for side in (left, right)])
    moment = Moment(step_s, np.arange(told.shape[1]) * step_s, np.zeros((1, 1)), RNG)
    way = SlidingContact(**values).wheels(told.T[None], moment)[0].sum(axis=0) * step_s
    assert pose[2] == pytest.approx((way[1] - way[0]) / BASE_M, abs=5e-3)


def test_places_and_speeds_of_any_size_have_an_answer_that_is_never_faster():
    rng = np.random.default_rng(0)
    places = [0.0, 1e-9, 0.3, 3.0], [0.0, -3.0, 1e-9, 0.2]
    for friction in (1e-300, 1e-12, 1e-3, 0.03, 1.0):
        for behind, aside in [(p, q) for p in places[0] for q in places[1]]:
            told = rng.choice([0.0, 1e-300, 1e-9, 0.1, -0.1, 0.3 * rng.normal()], (2, 1, 60))
            left, right = dragged(*told, friction, behind, aside)
            c = [(one + other) / 2 - aside * (other - one) for one, other in ((left, right), told)]
            assert np.isfinite([left, right]).all()
            if behind == 0.0:  # all of the point's motion is along
                assert (np.abs(c[0]) <= np.abs(c[1]) * (1 + 1e-9) + 1e-15).all()
