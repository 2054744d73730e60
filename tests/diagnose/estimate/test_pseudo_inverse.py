"""Numbers of very different sizes in one fit, and numbers that are only known together."""

import numpy as np
import pandas as pd
import pytest

from bns.diagnose.adding import warnings_on
from bns.diagnose.data.tracks import tracks_of
from bns.diagnose.effect_caveats import on_numbers
from bns.diagnose.estimate.cross_validation import judged_errors
from bns.diagnose.estimate.fit_set import fit_set
from bns.diagnose.estimate.plausibility import does_nothing, known_together
from bns.diagnose.estimate.pseudo_inverse import pseudo_inverse
from bns.diagnose.predict.wheels import WheelPredictor
from bns.physics.effects import effect_named
from tests.diagnose.worlds import NOMINAL

COLD = "friction-warm-up"


def test_a_number_of_another_unit_is_not_taken_for_fixed():
    well = np.array([[2.0, 0.5, 0.1], [0.5, 1.0, 0.2], [0.1, 0.2, 3.0]])
    for units in ([1e5, 1.0, 1e-9], [1.0, 1.0, 1.0]):
        both = np.outer(units, units)
        np.testing.assert_allclose(pseudo_inverse(well * both) * both, np.linalg.inv(well), rtol=1e-9, atol=1e-12)


def test_what_is_known_of_one_number_twice_is_shared_and_nothing_known_stays_nothing():
    twice = np.array([[1.0, 1e6, 0.0], [1e6, 1e12, 0.0], [0.0, 0.0, 0.0]])
    found = pseudo_inverse(np.stack([twice, np.eye(3)]))
    gradient = np.array([1.0, 1e6, 0.0])
    np.testing.assert_allclose(found[0] @ gradient, [0.5, 0.5e-6, 0.0], rtol=1e-9)
    np.testing.assert_allclose(found[1], np.eye(3))
    assert pseudo_inverse(np.zeros((0, 0))).shape == (0, 0)


def one_trial(number, rng):
    """Friction that fades by half in hours, a battery that runs down, 20 minutes of session; arcs, by hand."""
    session = 40.0 * number
    full, friction = 1.0 - 1.5e-4 * session, 0.006 + 0.006 * np.exp(-session / 3000.0)
    told = np.repeat(rng.uniform(-0.2, 0.2, (8, 2)), 25, axis=0)
    left, right = (np.sign(told) * np.maximum(np.abs(told) * full - friction, 0.0) * (1 + 0.004 * rng.normal(size=2))).T
    heading = np.concatenate([[0.0], np.cumsum((right - left) / NOMINAL.wheelbase_m * 0.04)]) + rng.uniform(-3, 3)
    way, middle = (left + right) / 2 * 0.04, (heading[1:] + heading[:-1]) / 2
    x, y = (np.concatenate([[0.0], np.cumsum(way * axis(middle))]) for axis in (np.cos, np.sin))
    seen = np.column_stack([x, y, heading]) + rng.normal(size=(201, 3)) * [0.001, 0.001, 0.01]
    table = pd.DataFrame(seen, columns=["x_m", "y_m", "heading_rad"])
    told = np.vstack([told, told[-1:]])
    return table.assign(trial=number, t_s=0.04 * np.arange(201), left_m_s=told[:, 0], right_m_s=told[:, 1]).assign(
        session_s=lambda one: session + one["t_s"]
    )


@pytest.fixture(scope="module")
def short_session():
    """A session of 20 minutes, in which any friction that fades in the course of hours is a straight line."""
    rng = np.random.default_rng(5)
    predictor = WheelPredictor(tracks_of(pd.concat([one_trial(i, rng) for i in range(30)], ignore_index=True)))
    problem, fit, _ = fit_set(predictor, NOMINAL, [effect_named(COLD), effect_named("battery-sag")])
    return predictor, problem, fit


def test_numbers_that_make_up_for_each_other_have_wide_intervals(short_session):
    _, _, fit = short_session
    ends = {f.parameter.name: fit.interval(i) for i, f in enumerate(fit.free) if f.effect == COLD}
    assert ends["width_m_s"][1] - ends["width_m_s"][0] > 0.005  # with the time fixed: 0.001
    assert ends["time_s"][1] > 3 * max(ends["time_s"][0], 300.0)


def test_such_an_effect_acts_and_its_numbers_are_not_to_be_read_alone(short_session):
    predictor, problem, fit = short_session
    assert known_together(fit, COLD)
    assert not does_nothing(fit, COLD)
    errors = judged_errors(predictor, problem.pose_filter, NOMINAL, [])
    said = list(warnings_on(fit, [(effect_named(COLD), {})], errors))
    assert not any("no visible effect" in line for line in said)
    assert on_numbers(effect_named(COLD)) in said
    assert on_numbers(effect_named(COLD)).startswith(f"{COLD}: width_m_s and cold_m_s and time_s are only known together.")


def test_an_effect_that_is_not_there_does_nothing(short_session):
    predictor, _, _ = short_session
    _, fit, _ = fit_set(predictor, NOMINAL, [effect_named(COLD), effect_named("battery-sag"), effect_named("side-slip")])
    assert does_nothing(fit, "side-slip")
    assert not known_together(fit, "side-slip")
    assert not does_nothing(fit, "battery-sag")
    assert not known_together(fit, "battery-sag")
