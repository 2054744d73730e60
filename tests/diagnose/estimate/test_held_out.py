"""Errors on held-out trials come from fits that have not seen these trials."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pandas as pd
import pytest

from bns.diagnose.data.checks import checked
from bns.diagnose.data.split_trials import split
from bns.diagnose.data.tracks import tracks_of
from bns.diagnose.estimate.cross_validation import FOLDS, folds, held_out_steps
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


class Pieces(SimpleNamespace):
    """Tracks of so many trials, with what was driven before each begins (s)."""

    def __len__(self):
        return 12


@pytest.mark.parametrize(
    ("lead_s", "expected"),
    [
        (None, [0, 1, 2, 3, 4, 0, 1, 2, 3, 4, 0, 1]),
        ([0, 2, 2, 0, 2, 2, 2, 2, 0, 2, 0, 2], [0, 0, 0, 1, 1, 1, 1, 1, 2, 2, 3, 3]),  # four trials in pieces
        ([0, 2, 0, 2, 0, 2, 0, 2, 0, 2, 0, 2], [0, 0, 1, 1, 2, 2, 3, 3, 4, 4, 0, 0]),  # six
        ([0] + [2] * 11, [0, 0, 0, 1, 1, 2, 2, 2, 3, 3, 4, 4]),  # one
        ([2] * 12, [0, 0, 0, 1, 1, 2, 2, 2, 3, 3, 4, 4]),  # one whose beginning is not in the log
    ],
)
def test_pieces_of_a_trial_are_held_out_together(lead_s, expected):
    tracks = Pieces(lead_s=None if lead_s is None else np.array(lead_s, dtype=float))
    assert folds(tracks).tolist() == expected


def test_what_was_peculiar_to_a_long_trial_is_no_drift_of_the_session():
    """Three trials of 60 s, each with another gain, cut into pieces: a curve along the session must not follow the three."""
    parts = []
    for number, gain in enumerate((1.0, 1.02, 0.99)):
        one = measured(hidden(speed_gain={"gain": gain}), trials=1, commands=60, seed=number)
        parts.append(one.assign(trial=number))
    table = split(pd.concat(parts, ignore_index=True), "lasting_s", 6.0)
    predictor = WheelPredictor(tracks_of(checked(table)[0]))
    of = folds(predictor.tracks)
    assert len(set(of)) == 3
    assert all(np.ptp(of[[name.startswith(f"{k}-") for name in predictor.tracks.names]]) == 0 for k in range(3))
    steps = held_out_steps(predictor, problem_for(predictor, MODEL).pose_filter, NOMINAL.with_effect("speed-gain", gain=1.0))
    told = predictor.steps(NOMINAL).body[:, 0]
    clear = (told > 1e-4) & (of[predictor.tracks.trial] == 1)
    assert np.median(steps.body[clear, 0] / told[clear]) < 1.005  # by a fit to the others, whose gains are 1.0 and 0.99
