"""What a track shows beyond a model: nothing where the model is right, and a kick where there was one."""

from itertools import pairwise

import numpy as np
import pytest

from bns.diagnose.data.tracks import tracks_of
from bns.diagnose.estimate.problem import problem_for
from bns.diagnose.predict.wheels import WheelPredictor
from bns.diagnose.residuals.unforeseen import unforeseen, unforeseen_way
from tests.diagnose.worlds import NOMINAL, hidden, measured

SLOPE = hidden(floor_slope={"x_m_s": 0.01, "y_m_s": -0.004})
EXACT = {"trials": 4, "noise": (0.0, 0.0), "jitter": 0.0, "speeds": (-0.2, 0.2)}


def windows(model, table):
    predictor = WheelPredictor(tracks_of(table))
    problem = problem_for(predictor, model)
    first = np.concatenate([np.arange(a, b - 12, 5) for a, b in pairwise(predictor.tracks.first)])
    return problem, problem.fit(model, 0), first


@pytest.mark.parametrize("model", [NOMINAL, SLOPE])
def test_a_right_model_leaves_nothing(model):
    problem, fit, begin = windows(model, measured(model, **EXACT))
    assert np.abs(unforeseen_way(problem, fit, begin, begin + 11)).max() < 2e-4
    assert np.abs(unforeseen(problem, fit)).max() < 2e-4


def test_a_push_to_the_left_is_seen_in_the_windows_that_span_it():
    table = measured(NOMINAL, **EXACT)
    one = table.trial == 2
    at = table.index[one][30]
    heading = table.heading_rad[at]
    table.loc[one & (table.index >= at), ["x_m", "y_m"]] += 0.05 * np.array([-np.sin(heading), np.cos(heading)])
    problem, fit, begin = windows(NOMINAL, table)
    frame = problem.predictor.tracks.first[2] + 30
    spans = (begin < frame) & (begin + 11 >= frame)
    off = unforeseen_way(problem, fit, begin, begin + 11)
    np.testing.assert_allclose(np.hypot(off[spans, 0], off[spans, 1]), 0.05, atol=1e-3)
    assert np.abs(off[~spans]).max() < 2e-4
