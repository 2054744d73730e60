"""Terms on all velocities at once and on each wheel, and the names that only they have."""

import numpy as np
import pytest

from bns.errors import ModelError
from bns.physics.formula import NEVER_M, formula_effect, since_reversal, swing, value_of
from bns.physics.model import Model
from bns.physics.wheels.grid import Grid
from bns.physics.wheels.motion import body_motion

BASE_M, STEP_S = 0.1, 0.5


def motion(model, left, right):
    step = np.full((1, len(left)), STEP_S)
    node = np.cumsum(np.concatenate([[0.0], step[0]]))[None]
    return body_motion(model, Grid(step, node, np.array([left]), np.array([right]), np.zeros((1, 0), dtype=np.int64)))


def with_term(term, on, *values):
    return Model(BASE_M).with_active(formula_effect("own", term, on), values)


def test_a_share_scales_all_three_velocities():
    plain = motion(Model(BASE_M).with_effect("side-slip", slip_s=0.1), [0.1, 0.2], [0.2, 0.1])
    model = Model(BASE_M).with_effect("side-slip", slip_s=0.1).with_active(formula_effect("own", "k", "share"), (-0.25,))
    slower = motion(model, [0.1, 0.2], [0.2, 0.1])
    for name in ("forward_m_s", "sideways_m_s", "yaw_rad_s"):
        np.testing.assert_allclose(getattr(slower, name), 0.75 * getattr(plain, name))


def test_a_term_on_wheels_is_worked_out_for_each():
    """Losing a tenth of its own speed above 0.15 m/s, a wheel makes the robot turn: arithmetic by hand."""
    body = motion(with_term("k * u * sign(max(u - 0.15, 0))", "wheels", -0.1), [0.2, 0.1], [0.1, 0.1])
    np.testing.assert_allclose(body.forward_m_s, [[(0.18 + 0.1) / 2, 0.1]])
    np.testing.assert_allclose(body.yaw_rad_s, [[(0.1 - 0.18) / BASE_M, 0.0]], atol=1e-15)


@pytest.mark.parametrize(("on", "turn"), [("left", 0.02), ("right", -0.02)])
def test_a_term_on_one_wheel_leaves_the_other(on, turn):
    """A wheel that loses 2 cm/s turns the robot to its own side: arithmetic by hand."""
    body = motion(with_term("k * sign(u)", on, -0.02), [0.1], [0.1])
    np.testing.assert_allclose(body.forward_m_s, [[0.09]])
    np.testing.assert_allclose(body.yaw_rad_s, [[turn / BASE_M]])


def test_recent_work_fades_and_is_each_wheel_s_own():
    """A wheel that did 0.1 m/s for long has 0.1 m/s times the time of fading behind it."""
    body = motion(with_term("k * u * lately10", "wheels", 1.0), [0.1] * 200, [0.0] * 200)
    left = body.forward_m_s[0] - body.yaw_rad_s[0] * BASE_M / 2
    assert left[-1] == pytest.approx(0.1 + 0.1 * 0.1 * 10.0, rel=1e-3)
    assert left[0] == pytest.approx(0.1 + 0.1 * 0.1 * STEP_S / 2, rel=0.05)
    np.testing.assert_allclose(body.forward_m_s[0] + body.yaw_rad_s[0] * BASE_M / 2, 0.0, atol=1e-15)


def test_names_of_a_wheel_are_numbers_elsewhere():
    assert [p.name for p in formula_effect("own", "k * u", "v").parameters] == ["k", "u"]
    assert [p.name for p in formula_effect("own", "k * u", "wheels").parameters] == ["k"]


def test_what_is_fresh_of_a_change_fades():
    body = motion(with_term("k * fresh", "wheels", 1.0), [0.1] * 6, [0.1] * 6)
    added = body.forward_m_s[0] - 0.1
    assert added[0] == pytest.approx(0.1 * 0.15 / STEP_S * -np.expm1(-STEP_S / 0.15))
    assert added[-1] < 1e-5


def test_the_way_since_a_reversal_counts_from_it():
    speed = np.array([[0.1, 0.1, 0.0, -0.1, -0.2, 0.1]])
    way = since_reversal(speed, np.full((1, 6), STEP_S))[0]
    assert (way[:3] == NEVER_M).all()
    assert way[3:] == pytest.approx([0.025, 0.1, 0.025])


def test_a_reversal_swings_the_direction_round_and_it_fades_with_the_way():
    off = swing(motion(Model(BASE_M), [0.1] * 4 + [-0.01] + [-0.1] * 4, [0.1] * 4 + [-0.01] + [-0.1] * 4))[0]
    assert off[:4] == pytest.approx(0.0)
    assert off[4] > 0.95
    assert off[-1] < 0.1


def test_rounding_and_values():
    assert value_of("k * round(u / 0.5)", {"k": 2.0, "u": np.array([0.2, 0.3, 1.1])}).tolist() == [0.0, 2.0, 4.0]
    with pytest.raises(ModelError, match="round takes 1"):
        formula_effect("own", "k * round(v, 2)", "v")


def test_a_variable_in_the_wrong_case_is_no_number_to_fit():
    """k * v * abs(W) has two numbers that only their product is known of."""
    with pytest.raises(ModelError, match=r"formula own: did you mean w by W\? Give a number to fit another letter"):
        formula_effect("own", "k * v * abs(W)", "v")
    assert [p.name for p in formula_effect("own", "W * v", "v", numbers=("W",)).parameters] == ["W"]
