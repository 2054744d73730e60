"""The fast drive against the differential equation solved by a general solver."""

from dataclasses import replace

import numpy as np
import pytest

from bns.errors import ModelError
from bns.physics.model import Model, load_model
from bns.physics.wheels.differential_drive import simulate
from bns.physics.wheels.reference import ORDER, simulate_slowly

IDEAL = Model(wheelbase_m=0.0884)
VALUES = {
    "speed-gain": {"gain": 1.04},
    "wheel-mismatch": {"ratio": 0.97},
    "dead-zone": {"width_m_s": 0.015},
    "speed-limit": {"max_m_s": 0.17},
    "command-delay": {"delay_s": 0.0437},
    "motor-lag": {"tau_s": 0.09},
    "acceleration-limit": {"max_m_s2": 0.6},
    "wheelbase": {"factor": 1.07},
    "turn-slip": {"slip_s": 0.04},
    "side-slip": {"slip_s": 0.03},
    "yaw-bias": {"rate_rad_s": -0.08},
    "floor-slope": {"x_m_s": 0.01, "y_m_s": -0.02},
    "tether-pull": {"pull_per_s": 0.2, "anchor_x_m": -1.0, "anchor_y_m": 0.5},
}
LEFT = [0.12, 0.20, 0.03, 0.0, -0.1]
RIGHT = [0.20, 0.04, 0.15, 0.0, 0.05]
DURATION = [0.6013, 0.4502, 0.7, 0.2, 0.3333]
START = (0.2, -0.1, 0.7)


def both(model):
    fast = simulate(model, [LEFT], [RIGHT], [DURATION], start=START)[0]
    return fast, simulate_slowly(model, LEFT, RIGHT, DURATION, START)


def assert_same_way(model, metres=1e-5):
    fast, slow = both(model)
    np.testing.assert_allclose(fast[:, :2], slow[:, :2], rtol=0, atol=metres)
    np.testing.assert_allclose(fast[:, 2], slow[:, 2], rtol=0, atol=3 * metres)


def with_effects(names):
    model = IDEAL
    for name in names:
        model = model.with_effect(name, **VALUES[name])
    return model


@pytest.mark.parametrize("name", ORDER)
def test_each_effect_alone(name):
    assert_same_way(with_effects([name]))


def test_khepera():
    assert_same_way(load_model("khepera-world"))


WHILE_MOVING = {"yaw-bias", "floor-slope", "tether-pull"}


def test_all_that_acts_at_any_time_at_once():
    assert_same_way(with_effects([name for name in ORDER if name not in WHILE_MOVING]))


def test_all_at_once_is_good_to_one_step_of_drift():
    model = with_effects(ORDER)
    assert_same_way(model, metres=5e-4)
    assert_same_way(replace(model, dt_s=1e-4), metres=1e-5)


def test_error_falls_with_the_square_of_the_step():
    model = with_effects(["motor-lag", "turn-slip", "side-slip"])
    slow = simulate_slowly(model, LEFT, RIGHT, DURATION, START)
    errors = []
    for dt in (0.04, 0.01):
        fast = simulate(replace(model, dt_s=dt), [LEFT], [RIGHT], [DURATION], start=START)[0]
        errors.append(np.abs(fast - slow).max())
    assert errors[0] > 1e-6
    assert errors[1] < errors[0] / 8


def test_another_order_is_refused():
    with pytest.raises(ModelError, match="cannot solve the effects motor-lag, dead-zone in this order"):
        both(with_effects(["motor-lag", "dead-zone"]))
