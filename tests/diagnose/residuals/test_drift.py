"""A turn of its own that grows during the session: a gyro that holds the heading, and drifts. Paths by this file's own arcs."""

from types import SimpleNamespace

import numpy as np
import pandas as pd
import pytest

from bns.diagnose.data.tracks import tracks_of
from bns.diagnose.diagnosing import diagnose
from bns.diagnose.predict.wheels import WheelPredictor
from bns.diagnose.residuals.grammar import DRIFT, families
from bns.diagnose.residuals.places_in_words import drift
from bns.physics.model import Model

BASE_M, FRAME_S = 0.25, 0.05
MODEL = Model(BASE_M)


def driven(most_rad_s, trials=30, seed=0, session=True, always_rad_s=0.0):
    """Eight commands of a second a trial, trials 20 s apart; the turn rate is off by up to ``most_rad_s``, over 200 s."""
    rng, tables = np.random.default_rng(seed), []
    for trial in range(trials):
        v, w = np.repeat(rng.uniform(-0.2, 0.4, 8), 20), np.repeat(rng.uniform(-1.0, 1.0, 8), 20)
        t_s = FRAME_S * np.arange(len(v))
        began_s = 20.0 * trial
        turned = (w + always_rad_s + most_rad_s * (1 - np.exp(-(began_s + t_s) / 200.0))) * FRAME_S
        heading = rng.uniform(-3, 3) + np.concatenate([[0.0], np.cumsum(turned)])[:-1]
        chord = v * FRAME_S * np.sinc(turned / (2 * np.pi))
        x, y = (np.concatenate([[0.0], np.cumsum(chord * f(heading + turned / 2))])[:-1] for f in (np.cos, np.sin))
        noisy = {name: values + rng.normal(scale=0.001, size=len(v)) for name, values in (("x_m", x), ("y_m", y))}
        noisy["heading_rad"] = (heading + rng.normal(scale=0.004, size=len(v)) + np.pi) % (2 * np.pi) - np.pi
        told = {"left_m_s": v - w * BASE_M / 2, "right_m_s": v + w * BASE_M / 2}
        tables.append(pd.DataFrame({"trial": f"T{trial:02d}", "t_s": t_s, **told, **noisy, "session_s": began_s + t_s}))
    table = pd.concat(tables, ignore_index=True)
    return table if session else table.drop(columns="session_s")


@pytest.mark.parametrize("session", [True, False])
def test_it_is_looked_for_where_the_session_is_known(session):
    predictor = WheelPredictor(tracks_of(driven(0.0, trials=2, session=session)))
    assert any(family.signal == DRIFT for family in families(predictor, BASE_M)) == session


@pytest.mark.slow
def test_a_drift_of_the_turn_rate_is_described_and_no_constant_stands_for_it():
    """At the end of 588 s, 95 % of 0.04 rad/s: 2.2 degrees a second to the left."""
    found = diagnose(WheelPredictor(tracks_of(driven(0.04))), MODEL)
    assert (found.verdict, found.effects) == ("unlisted", ())
    assert [(term.signal, term.on) for term in found.terms] == [(DRIFT, "w")]
    assert found.behaviour[0].startswith("the robot turns 2.2 °/s further to the left at 5")
    assert "of the session than at its beginning" in found.behaviour[0]
    after = found.errors_with_terms.horizons["trial"]
    assert after.models[-1].rms_m < 0.2 * after.models[0].rms_m


@pytest.mark.slow
def test_a_turn_that_is_always_there_is_the_effect():
    found = diagnose(WheelPredictor(tracks_of(driven(0.0, always_rad_s=0.02))), MODEL)
    assert (found.verdict, found.effects) == ("effects", ("yaw-bias",))


def test_a_drift_in_words():
    predictor = SimpleNamespace(tracks=SimpleNamespace(session_s=np.array([0.0, 1000.0])))
    term = SimpleNamespace(term="k0 * moving * t", values={"k0": np.radians(-0.002)}, on="w")
    said = "the robot turns 2 °/s further to the right at 1000 s of the session than at its beginning, whenever it moves"
    assert drift(term, predictor) == said
    term.values["k0"] = np.radians(0.003)
    assert "turns 3 °/s further to the left" in drift(term, predictor)
