"""Past speeds of a wheel in a formula: the mean over a window of time, against sums over a fine grid and by hand."""

from itertools import pairwise

import numpy as np
import pytest

from bns.errors import ModelError
from bns.physics.formula import formula_effect
from bns.physics.model import Model
from bns.physics.wheels.grid import Grid
from bns.physics.wheels.motion import body_motion
from bns.physics.wheels.scans import averaged

FINE_S = 1e-3


def over_a_fine_grid(speed, step_s, from_s, to_s):
    """What `averaged` is by its definition, as sums: steps are whole numbers of ``FINE_S``."""
    counts = np.round(step_s / FINE_S).astype(int)
    dense = np.repeat(speed, counts)
    a, b = round(from_s / FINE_S), round(to_s / FINE_S)
    padded = np.concatenate([np.zeros(b), dense])
    window = np.array([padded[i + 1 : i + 1 + b - a].mean() for i in range(len(dense))])
    return np.array([part.mean() if len(part) else 0.0 for part in np.split(window, np.cumsum(counts)[:-1])])


@pytest.mark.parametrize("window", [(0.0, 0.04), (0.1, 0.3), (1.0, 2.5)])
def test_a_window_of_the_past(window):
    rng = np.random.default_rng(1)
    speed, step_s = rng.normal(size=(2, 60)), rng.integers(0, 200, (2, 60)) * FINE_S
    found = averaged(speed, step_s, *window)
    for row in range(2):
        wanted = over_a_fine_grid(speed[row], step_s[row], *window)
        # the sums hold each speed for a millisecond: they are off by at most half of one in the window's length
        np.testing.assert_allclose(found[row], wanted, atol=6 * FINE_S / (window[1] - window[0]) * 0.5)
    assert (found[step_s == 0] == 0).all()


def test_a_wheel_that_does_what_it_was_told_a_while_ago():
    step = np.full((1, 6), 0.1)
    node = np.cumsum(np.concatenate([[0.0], step[0]]))[None]
    told = np.array([[0.1, 0.2, 0.2, 0.0, 0.0, 0.0]])
    grid = Grid(step, node, told, told, np.zeros((1, 0), dtype=np.int64))
    model = Model(0.1).with_active(formula_effect("late", "k * (ago(0.2, 0.3) - u)", "wheels"), (1.0,))
    ways = np.concatenate([[0.0], np.cumsum(told[0] * 0.1)])
    at = [np.interp(node[0] - ago, node[0], ways, left=0.0) for ago in (0.2, 0.3)]
    mean = [np.interp(np.linspace(a, b, 1001), node[0], at[0] - at[1]).mean() / 0.1 for a, b in pairwise(node[0])]
    np.testing.assert_allclose(body_motion(model, grid).forward_m_s[0], mean, atol=1e-4)


def test_a_robot_that_goes_as_it_was_told_a_while_ago_and_turns_at_once():
    step = np.full((1, 6), 0.1)
    node = np.cumsum(np.concatenate([[0.0], step[0]]))[None]
    left, right = np.array([[0.1, 0.2, 0.2, 0.0, 0.0, 0.0]]), np.array([[0.1, 0.1, 0.1, 0.1, 0.0, 0.0]])
    grid = Grid(step, node, left, right, np.zeros((1, 0), dtype=np.int64))

    def moved(now, on):
        return body_motion(Model(0.1).with_active(formula_effect("late", f"k * (ago(0.2, 0.3) - {now})", on), (1.0,)), grid)

    plain, both, ahead, turn = body_motion(Model(0.1), grid), moved("u", "wheels"), moved("v", "v"), moved("w", "w")
    np.testing.assert_allclose(ahead.forward_m_s, both.forward_m_s, atol=1e-12)
    np.testing.assert_array_equal(ahead.yaw_rad_s, plain.yaw_rad_s)
    np.testing.assert_allclose(turn.yaw_rad_s, both.yaw_rad_s, atol=1e-12)
    np.testing.assert_array_equal(turn.forward_m_s, plain.forward_m_s)


@pytest.mark.parametrize(
    ("term", "on", "said"),
    [
        ("k * ago(0.2, 0.1)", "wheels", "the smaller first"),
        ("k * ago(0, 100)", "wheels", "0 to 60"),
        ("k * ago(a, 0.2)", "left", "two times in seconds"),
        ("k * ago(0.2)", "wheels", "ago takes 2"),
        ("k * ago", "wheels", "ago is a function"),
        ("k * ago(0.1, 0.2)", "s", "it needs on: wheels, left, right, v, w, not s"),
    ],
)
def test_what_is_no_window(term, on, said):
    with pytest.raises(ModelError, match=said):
        formula_effect("own", term, on)


def test_a_response_is_linear_in_its_numbers():
    assert formula_effect("own", "k0 * (ago(0, 0.1) - u) + k1 * (ago(0.1, 0.2) - u)", "wheels").starts == ((0.0, 0.0),)
