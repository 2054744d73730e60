"""A lag of the motors and a tracker that smooths: made by plain integration and by scipy's filter, not by this package."""

import re
from dataclasses import replace

import numpy as np
import pandas as pd
import pytest
from scipy.signal import lfilter, lfilter_zi

from bns.diagnose.data.tracks import tracks_of
from bns.diagnose.estimate.problem import problem_for
from bns.diagnose.estimate.smoothing_tracker import LAG, SmoothingTracker, smoothing_tracker
from bns.diagnose.estimate.starts import fit_with
from bns.diagnose.predict.wheels import WheelPredictor
from bns.physics.effects import effect_named
from bns.physics.model import Model

BASE_M, STEP_S, TAU_S = 0.12, 0.001, 0.12


def log(motors_s=0.0, tracker_s=0.0, turning=1.0, trials=24):
    """Commands of 0.8 s, and poses at 25 Hz with 1 mm and 3 mrad of noise."""
    rng, rows = np.random.default_rng(3), []
    for trial in range(trials):
        speed, turn = rng.uniform(0.05, 0.2, 8), turning * rng.uniform(-0.1, 0.1, 8)
        told = np.repeat(np.stack([speed - turn, speed + turn]), 800, axis=1)
        wheels = first_order(told, motors_s)
        heading = np.cumsum(wheels[1] - wheels[0]) / BASE_M * STEP_S + rng.uniform(-3, 3)
        forward = wheels.mean(axis=0)
        pose = np.stack([np.cumsum(forward * np.cos(heading)), np.cumsum(forward * np.sin(heading)), heading / STEP_S]) * STEP_S
        seen = first_order(pose, tracker_s, begin=pose[:, :1])[:, ::40].T
        seen = seen + rng.normal(size=seen.shape) * [0.001, 0.001, 0.003]
        at = {"trial": trial, "t_s": np.arange(len(seen)) * 40 * STEP_S, "left_m_s": told[0, ::40], "right_m_s": told[1, ::40]}
        rows.append(pd.DataFrame(at | dict(zip(["x_m", "y_m", "heading_rad"], seen.T, strict=True))))
    return pd.concat(rows, ignore_index=True)


def first_order(values, tau_s, begin=0.0):
    if tau_s == 0.0:
        return values
    share = 1 - np.exp(-STEP_S / tau_s)
    b, a = [share], [1, share - 1]
    return lfilter(b, a, values, zi=lfilter_zi(b, a) * (begin + np.zeros((len(values), 1))))[0]


def alternative(table, *beside):
    predictor = WheelPredictor(tracks_of(table))
    model = Model(wheelbase_m=BASE_M)
    problem = problem_for(predictor, model)
    fit = fit_with(problem, problem.fit(model), effect_named(LAG))
    for name in beside:
        fit = fit_with(problem, fit, effect_named(name))
    problem = problem_for(predictor, fit.model)
    fit = problem.fit(fit.model)
    assert fit.model.values_of(LAG)["tau_s"] == pytest.approx(TAU_S, rel=0.1)
    return smoothing_tracker(problem, fit)


def test_a_tracker_that_smooths_is_told_from_motors_that_lag_and_its_time_constant_is_found():
    found = alternative(log(tracker_s=TAU_S))
    assert found.tau_s == pytest.approx(TAU_S, rel=0.03)
    assert found.z > 4
    assert re.match(r"motor-lag: a tracker that smooths .* of 1[12]\d ms\) fits this log better than motors", found.in_words())
    assert f"by {found.z:.1f} standard errors" in found.in_words()


def test_motors_that_lag_are_told_from_a_tracker_that_smooths():
    found = alternative(log(motors_s=TAU_S))
    assert found.z < -4
    assert found.in_words() == ""


def test_on_straight_lines_nothing_tells_the_two_apart():
    found = alternative(log(motors_s=TAU_S, turning=0.0))
    assert abs(found.z) < 3
    assert "fits this log as well as motors that lag. Ask whether" in found.in_words()


def test_effects_that_do_what_a_filter_does_in_curves_are_named_with_the_lag():
    of_three = SmoothingTracker(0.15, 1.0, (LAG, "turn-slip-quadratic", "clock-offset"))
    said = "motor-lag and turn-slip-quadratic and clock-offset: a tracker .* of 150 ms\\) fits this log as well as these effects"
    assert re.match(said, of_three.in_words())


def test_what_stands_beside_the_lag_for_curves_goes_with_it():
    found = alternative(log(tracker_s=TAU_S), "turn-slip-quadratic")
    assert found.instead_of == (LAG, "turn-slip-quadratic")
    assert found.tau_s == pytest.approx(TAU_S, rel=0.03)


def test_a_filter_is_told_from_a_late_clock_that_was_named_in_its_place():
    predictor = WheelPredictor(tracks_of(log(tracker_s=TAU_S)))
    problem = problem_for(predictor, Model(wheelbase_m=BASE_M))
    fit = fit_with(problem, problem.fit(Model(wheelbase_m=BASE_M)), effect_named("clock-offset"))
    problem = problem_for(predictor, fit.model)
    found = smoothing_tracker(problem, problem.fit(fit.model))
    assert found.instead_of == ("clock-offset",)
    assert found.tau_s == pytest.approx(TAU_S, rel=0.05)
    assert found.z > 4
    assert "fits this log better than this effect, by" in found.in_words()
    left = found.in_words(all_explained=False)
    assert "may do the work of this effect, as far as what is left unexplained lets one tell. Ask whether" in left
    assert replace(found, z=0.0).in_words(all_explained=False) == replace(found, z=0.0).in_words()


def test_a_model_without_a_lag_has_no_alternative():
    predictor = WheelPredictor(tracks_of(log(trials=4)))
    problem = problem_for(predictor, Model(wheelbase_m=BASE_M))
    assert smoothing_tracker(problem, problem.fit(Model(wheelbase_m=BASE_M))) is None
