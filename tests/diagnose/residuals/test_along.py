"""What the robot as a whole loses on the way, whatever it turns: by an integration of this file's own."""

import re

import numpy as np
import pandas as pd
import pytest

from bns.diagnose.data.tracks import tracks_of
from bns.diagnose.diagnosing import diagnose
from bns.diagnose.estimate.problem import problem_for
from bns.diagnose.predict.wheels import WheelPredictor
from bns.diagnose.residuals.grammar import ALONG, families
from bns.diagnose.residuals.symbolic import fitted
from bns.diagnose.residuals.words import in_words
from bns.physics.model import Model

BASE_M, RATE, WITHIN = 0.3, 20, 10
MODEL = Model(BASE_M)


def driven(loses_m_s, slowest=-0.4, trials=30, commands=8, seed=2, noise=(0.001, 0.004)):
    """Set points for a second each; whatever hangs on the robot takes ``loses_m_s`` from its speed where it rolls backwards."""
    rng, tables = np.random.default_rng(seed), []
    dt = 1.0 / (RATE * WITHIN)
    for trial in range(trials):
        v, w = rng.uniform(slowest, 0.4, commands), rng.uniform(-1.2, 1.2, commands)
        rows, pose = [], np.append(rng.uniform(-1, 1, 2), rng.uniform(-np.pi, np.pi))
        for k in range(commands * RATE):
            told = v[k // RATE], w[k // RATE]
            rows.append((k / RATE, *told, *pose))
            rolls = told[0] if told[0] > 0 else min(told[0] + loses_m_s, 0.0)
            for _ in range(WITHIN):
                middle = pose[2] + told[1] * dt / 2
                pose = pose + dt * np.array([rolls * np.cos(middle), rolls * np.sin(middle), told[1]])
        one = pd.DataFrame(rows, columns=["t_s", "v", "w", "x_m", "y_m", "heading_rad"])
        one[["x_m", "y_m"]] += rng.normal(scale=noise[0], size=(len(one), 2))
        one["heading_rad"] += rng.normal(scale=noise[1], size=len(one))
        one["left_m_s"], one["right_m_s"] = one.v - one.w * BASE_M / 2, one.v + one.w * BASE_M / 2
        tables.append(one.drop(columns=["v", "w"]).assign(trial=f"T{trial:02d}"))
    return WheelPredictor(tracks_of(pd.concat(tables, ignore_index=True)))


@pytest.mark.parametrize(("slowest", "there"), [(-0.4, True), (0.05, False)])
def test_it_is_asked_of_robots_that_drive_backwards_too(slowest, there):
    found = [family for family in families(driven(0.0, slowest, trials=3), BASE_M) if family.signal == ALONG]
    assert [family.on for family in found] == ["v"] * there


def test_in_words_it_says_what_some_speeds_come_to():
    predictor = driven(0.03, trials=8)
    problem = problem_for(predictor, MODEL)
    (family,) = (one for one in families(predictor, BASE_M) if one.signal == ALONG)
    said = in_words(fitted(problem, problem.fit(MODEL), "v", family.term, "unlisted", ALONG), predictor)
    assert said.startswith("forward motion differs from its command, whatever the robot turns: ")
    back = re.findall(r"slower by ([\d.]+) mm/s at (-[\d.]+) m/s", said)
    assert [float(loss) for loss, _ in back] == pytest.approx([30, 30], abs=5)
    assert [float(at) for _, at in back] == pytest.approx([-0.11, -0.36], abs=0.05)


@pytest.mark.slow
def test_what_is_lost_backwards_alone_is_described_without_a_false_effect():
    found = diagnose(driven(0.03), MODEL)
    assert (found.verdict, found.effects) == ("unlisted", ())
    assert [(term.signal, term.on) for term in found.terms] == [(ALONG, "v")]
    after = found.errors_with_terms.horizons["trial"]
    assert after.models[-1].rms_m < 0.3 * after.models[0].rms_m
