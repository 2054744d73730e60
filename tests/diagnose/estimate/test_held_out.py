"""Errors on held-out trials come from fits that have not seen these trials."""

from dataclasses import replace

import numpy as np
import pytest

from bns.diagnose.data.checks import checked
from bns.diagnose.data.tracks import tracks_of
from bns.diagnose.estimate.cross_validation import FOLDS, held_out_steps
from bns.diagnose.estimate.problem import problem_for
from bns.diagnose.predict.wheels import WheelPredictor
from tests.diagnose.worlds import NOMINAL, hidden, measured

TRIALS = 2 * FOLDS
MODEL = NOMINAL.with_effect("wheelbase", factor=1.0)


def predictor(*odd):
    """Trials of a robot as it is drawn; those that are `odd` were driven, with the same commands, by one a fifth wider."""
    plain, wide = (measured(model, trials=TRIALS, seed=3) for model in (NOMINAL, hidden(wheelbase={"factor": 1.2})))
    return WheelPredictor(tracks_of(checked(plain.where(~plain["trial"].isin(odd), wide))[0]))


@pytest.mark.parametrize("fold", [0, 3])
def test_no_trial_has_a_part_in_what_is_predicted_of_it(fold):
    members = [trial for trial in range(TRIALS) if trial % FOLDS == fold]
    plain, odd = predictor(), predictor(*members)
    pose_filter = problem_for(plain, MODEL).pose_filter
    of_plain, of_odd = (held_out_steps(one, pose_filter, MODEL).body for one in (plain, odd))
    own = np.isin(plain.tracks.trial, members)
    np.testing.assert_allclose(of_odd[own], of_plain[own], rtol=1e-9, atol=1e-12)
    assert np.abs(of_odd[~own] - of_plain[~own]).max() > 1e-4  # the others are predicted by fits that saw the odd ones


def test_a_robot_unlike_the_others_is_predicted_as_the_others():
    """With one fold odd the fit to the others finds 1.0; a fit to all would lie between, and flatter the model."""
    odd = predictor(0, FOLDS)
    pose_filter = problem_for(odd, MODEL).pose_filter
    steps, own = held_out_steps(odd, pose_filter, MODEL).body, np.isin(odd.tracks.trial, (0, FOLDS))
    as_drawn, turned = odd.steps(MODEL).body[own, 2], steps[own, 2]
    turning = np.abs(as_drawn) > 1e-3
    assert np.median(turned[turning] / as_drawn[turning]) == pytest.approx(1.0, abs=0.01)


def test_what_carries_the_robot_is_predicted_by_the_other_folds_too():
    """The drift of each fold is that of the model fitted to the others, as its displacements are."""
    plain, drifting = predictor(), NOMINAL.with_effect("wheelbase", factor=1.0)
    pose_filter, real = problem_for(plain, drifting).pose_filter, plain.steps

    class Carried:
        """Steps with a drift that every frame has a number of its own for."""

        def __getattr__(self, name):
            return getattr(plain, name)

        def steps(self, model, *more, **named):
            found = real(model, *more, **named)
            ahead = np.arange(2.0 * len(found.drift_m)).reshape(-1, 2)
            return replace(found, drift_m=found.drift_m + 1e-9 * ahead)

    found = held_out_steps(Carried(), pose_filter, drifting).drift_m
    np.testing.assert_allclose(found, 1e-9 * np.arange(float(found.size)).reshape(-1, 2), atol=1e-12)


def test_trials_that_do_not_count_have_no_part_in_what_is_predicted_of_any():
    """Those that the odd robot drove are set aside: all others are predicted as if it had driven none."""
    odd_ones = (1, 6)
    plain, odd = (one.not_counting(odd_ones) for one in (predictor(), predictor(*odd_ones)))
    pose_filter = problem_for(plain, MODEL).pose_filter
    of_plain, of_odd = (held_out_steps(one, pose_filter, MODEL).body for one in (plain, odd))
    np.testing.assert_allclose(of_odd, of_plain, rtol=1e-9, atol=1e-12)
