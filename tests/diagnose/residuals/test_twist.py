"""What winds up as the robot turns and unwinds as it turns back, such as a cable: by an integration of this file's own."""

import numpy as np
import pandas as pd
import pytest

from bns.diagnose.data.tracks import tracks_of
from bns.diagnose.diagnosing import diagnose
from bns.diagnose.predict.wheels import WheelPredictor
from bns.diagnose.residuals.grammar import TWIST, families
from bns.diagnose.residuals.places_in_words import turned_in_words
from bns.physics.formula import formula_effect
from bns.physics.model import Model
from bns.physics.wheels.differential_drive import simulate

BASE_M, RATE, WITHIN = 0.3, 20, 10
MODEL = Model(BASE_M)


def driven(winds, trials=30, commands=8, seed=0, noise=(0.001, 0.004)):
    """Set points for a second each; a cable turns the robot back by ``winds`` rad/s for each rad that it has turned in the trial.

    Trials begin at any heading, and headings are logged between -180 and 180 degrees.
    """
    rng, tables = np.random.default_rng(seed), []
    dt = 1.0 / (RATE * WITHIN)
    for trial in range(trials):
        v, w = rng.uniform(-0.3, 0.4, commands), rng.uniform(-1.5, 1.5, commands)
        rows, pose = [], np.array([rng.uniform(-1, 1), rng.uniform(-1, 1), rng.uniform(-np.pi, np.pi)])
        began = pose[2]
        for k in range(commands * RATE):
            told = v[k // RATE], w[k // RATE]
            rows.append((k / RATE, *told, *pose))
            for _ in range(WITHIN):
                middle = pose[2] + (told[1] - winds * (pose[2] - began)) * dt / 2
                turn = told[1] - winds * (middle - began)
                pose = pose + dt * np.array([told[0] * np.cos(middle), told[0] * np.sin(middle), turn])
        one = pd.DataFrame(rows, columns=["t_s", "v", "w", "x_m", "y_m", "heading_rad"])
        one[["x_m", "y_m"]] += rng.normal(scale=noise[0], size=(len(one), 2))
        one["heading_rad"] = (one.heading_rad + rng.normal(scale=noise[1], size=len(one)) + np.pi) % (2 * np.pi) - np.pi
        one["left_m_s"], one["right_m_s"] = one.v - one.w * BASE_M / 2, one.v + one.w * BASE_M / 2
        tables.append(one.drop(columns=["v", "w"]).assign(trial=f"T{trial:02d}"))
    return pd.concat(tables, ignore_index=True)


def test_the_formula_counts_from_the_start_of_the_trial_over_whole_turns():
    """At 2 rad/s for 5 s against a cable: w = 2 - 0.3 turned, so that the turn is 2 / 0.3 (1 - exp(-1.5)), over half a turn."""
    model = MODEL.with_active(formula_effect("cable", "k * turned", "w"), (-0.3,))
    speed, n = 2.0 * BASE_M / 2, 50
    for began in (0.0, 2.5):
        path = simulate(model, [[-speed] * n], [[speed] * n], [[5.0 / n] * n], start=np.array([[0.4, 0.1, began]]))[0]
        assert path[-1, 2] - began == pytest.approx(2.0 / 0.3 * (1 - np.exp(-1.5)), rel=0.02)


def test_the_variable_starts_from_zero_in_each_trial_and_counts_whole_turns():
    table = driven(0.0, trials=6, commands=20, noise=(0.0, 0.0))
    predictor = WheelPredictor(tracks_of(table))
    seen, step_s = predictor.variables(), predictor.grid.step_s
    told = np.cumsum(seen["wheel_difference_m_s"] / BASE_M * step_s, axis=1)
    inside = predictor.grid.node_s[:, 1:] <= predictor.tracks.t_s.max()
    assert np.abs(told).max() > np.pi
    np.testing.assert_allclose(seen["turned_rad"][inside], told[inside], atol=0.1)
    assert any(family.signal == TWIST for family in families(predictor, BASE_M))


def test_a_turn_in_words():
    assert turned_in_words(np.pi / 2) == "after 90° to the left"
    assert turned_in_words(-np.pi) == "after 180° to the right"
    assert turned_in_words(0.001) == "before it turns"


@pytest.mark.slow
def test_a_cable_that_twists_is_described_and_the_error_falls():
    found = diagnose(WheelPredictor(tracks_of(driven(0.05))), MODEL)
    assert (found.verdict, found.effects) == ("unlisted", ())
    assert [(term.signal, term.on) for term in found.terms] == [(TWIST, "w")]
    assert found.terms[0].values["k0"] == pytest.approx(-0.05, rel=0.05)
    assert "changes with the turn since the trial began (to the left: +)" in found.behaviour[0]
    after = found.errors_with_terms.horizons["trial"]
    assert after.models[-1].rms_m < 0.2 * after.models[0].rms_m
