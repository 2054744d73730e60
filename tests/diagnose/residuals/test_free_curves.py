"""Free curves along variables, beside numbers that may press against a bound."""

import numpy as np

from bns.diagnose.data.tracks import tracks_of
from bns.diagnose.estimate.problem import settled_problem
from bns.diagnose.predict.wheels import WheelPredictor
from bns.diagnose.residuals.along_variables import earned_by_columns, residual_dependence
from tests.diagnose.worlds import NOMINAL, hidden, measured


def test_what_a_number_at_its_bound_would_do_beyond_it_is_no_merit_of_a_curve():
    """A dead zone below zero would speed the wheels up. A curve that does nothing gained by it; a real one was hidden by it."""
    robot = hidden(speed_gain={"gain": 1.08})
    predictor = WheelPredictor(tracks_of(measured(robot, trials=16, seed=1)))
    problem, fit = settled_problem(predictor, NOMINAL.with_effect("dead-zone", width_m_s=0.0), None)
    assert fit.values.tolist() == [0.0]
    nothing = 1e-3 * np.random.default_rng(0).normal(size=(*fit.whitened.shape, 1))
    assert earned_by_columns(problem, fit, nothing).elpd_diff < 0.01 * fit.losses.mean()
    best = residual_dependence(problem, fit)[0]
    assert best.paired_comparison.p_value < 1e-4
    assert best.paired_comparison.elpd_diff > 5
