"""What firmware, drives and bearings do to commands, and scrubbing to turns: each is named with its numbers."""

import numpy as np
import pandas as pd
import pytest

from bns.diagnose.data.tracks import tracks_of
from bns.diagnose.diagnosis import diagnose
from bns.diagnose.estimate.problem import problem_for
from bns.diagnose.estimate.starts import fit_extended, fit_with, listed
from bns.diagnose.predict.wheels import WheelPredictor
from tests.diagnose.worlds import NOMINAL, hidden, measured


def driven(trials=20, **effects):
    """Without scatter of the motors: it would act before the commands are rounded."""
    return WheelPredictor(tracks_of(measured(hidden(**effects), trials=trials, seed=4, speeds=(-0.2, 0.2), jitter=0.0)))


@pytest.mark.slow
@pytest.mark.parametrize(
    ("name", "values"),
    [
        ("command-truncation", {"step_m_s": 0.013, "share": 1.0}),
        ("command-quantisation", {"step_m_s": 0.027, "share": 1.0}),
        ("reversal-pause", {"pause_s": 0.15}),
        ("turn-dead-zone", {"width_rad_s": 0.2}),
        ("compass-deviation", {"cosine_share": 0.1, "sine_share": -0.06}),
        ("reverse-gain", {"gain": 0.9}),
        ("dead-zone-mismatch", {"width_m_s": 0.01, "left_share": 1.8}),
        ("speed-limit-mismatch", {"max_m_s": 0.12, "left_spare": 0.25}),
        ("carpet-drift", {"x_share": 0.05, "y_share": -0.03}),
        ("command-timeout", {"timeout_s": 0.8}),
        ("overload-trip", {"step_m_s": 0.13, "off_s": 0.2}),
        ("supply-trip", {"step_m_s": 0.2, "off_s": 0.3}),
    ],
)
def test_each_is_named_with_its_numbers(name, values):
    found = diagnose(driven(**{name.replace("-", "_"): values}), NOMINAL)
    assert (found.verdict, found.effects) == ("effects", (name,))
    assert {key: one["value"] for key, one in found.numbers[name].items()} == pytest.approx(values, rel=0.03)


@pytest.mark.slow
def test_friction_that_falls_over_a_session_is_named_with_its_numbers():
    """The dead zone is constant within each trial: trials are short compared with the time constant."""
    trials = []
    for i in range(24):
        width = 0.006 + 0.012 * np.exp(-(30 * i + 3) / 240)
        one = measured(hidden(dead_zone={"width_m_s": width}), trials=1, seed=i, speeds=(-0.2, 0.2), jitter=0.002)
        trials.append(one.assign(trial=i, session_s=one["t_s"] + 30 * i))
    found = diagnose(WheelPredictor(tracks_of(pd.concat(trials, ignore_index=True))), NOMINAL)
    assert (found.verdict, found.effects) == ("effects", ("friction-warm-up",))
    numbers = {key: one["value"] for key, one in found.numbers["friction-warm-up"].items()}
    assert numbers == pytest.approx({"width_m_s": 0.006, "cold_m_s": 0.012, "time_s": 240.0}, rel=0.15)


@pytest.mark.parametrize("step_m_s", [0.0113, *(pytest.param(step, marks=pytest.mark.slow) for step in (0.027, 0.045))])
@pytest.mark.parametrize("name", ["command-truncation", "command-quantisation"])
def test_a_step_is_found_that_is_no_round_number(name, step_m_s):
    """The loss has a valley for each number of steps below the fastest speed."""
    predictor = driven(trials=8, **{name.replace("-", "_"): {"step_m_s": step_m_s, "share": 1.0}})
    problem = problem_for(predictor, NOMINAL)
    found = fit_with(problem, problem.fit(NOMINAL), listed(NOMINAL, None, predictor.tracks)[name])
    assert found.values == pytest.approx([step_m_s, 1.0], rel=0.05)


def test_a_wheel_that_starts_late_is_found_from_one_that_stops_at_the_same_command():
    """The best single threshold, by which it is begun, lies far from both."""
    predictor = driven(breakaway={"threshold_m_s": 0.09, "stop_ratio": 0.4})
    effects = listed(NOMINAL, None, predictor.tracks)
    problem = problem_for(predictor, NOMINAL)
    alike = fit_with(problem, problem.fit(NOMINAL), effects["dead-band"])
    assert alike.values[0] < 0.075
    found = fit_extended(problem, alike, effects["breakaway"])
    assert found.values == pytest.approx([0.09, 0.4], rel=0.1)
