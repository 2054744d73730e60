"""Wheels whose speed controller rings: the response in time is found as a term, described, and predicts well."""

import re
from types import SimpleNamespace

import numpy as np
import pandas as pd
import pytest
from scipy.signal import lsim

from bns.diagnose.data.tracks import tracks_of
from bns.diagnose.diagnosing import diagnose
from bns.diagnose.estimate.starts import listed
from bns.diagnose.predict.wheels import WheelPredictor
from bns.diagnose.residuals import grammar
from bns.diagnose.residuals.established import established
from bns.diagnose.residuals.grammar import RESPONSE, RESPONSE_OF
from bns.diagnose.residuals.words import in_words
from tests.diagnose.worlds import NOMINAL

FREQUENCY, DAMPING = 7.0, 0.25
DENSE_S, FRAME_S, TRIAL_S = 0.002, 0.04, 8.0


def ringing(trials=24, seed=5):
    """Second-order wheels, w'' = f²(u - w) - 2·z·f·w', solved by scipy."""
    t = np.arange(0.0, TRIAL_S, DENSE_S)
    system = ([FREQUENCY**2], [1.0, 2 * DAMPING * FREQUENCY, FREQUENCY**2])
    return driven(lambda told: [lsim(system, u, t)[1] for u in told], trials, seed)


def two_lags(trials=24, seed=6):
    """A heavy robot: its mean speed lags by 0.25 s, the difference of its wheels by 0.06 s."""
    t = np.arange(0.0, TRIAL_S, DENSE_S)

    def moved(told):
        mean, half = (told[0] + told[1]) / 2, (told[1] - told[0]) / 2
        mean, half = (lsim(([1.0], [tau_s, 1.0]), u, t)[1] for tau_s, u in ((0.25, mean), (0.06, half)))
        return mean - half, mean + half

    return driven(moved, trials, seed)


def driven(moved, trials, seed):
    """The wheels of random commands; the pose by small arcs; a camera at 25 Hz."""
    rng = np.random.default_rng(seed)
    t = np.arange(0.0, TRIAL_S, DENSE_S)
    tables = []
    for trial in range(trials):
        changes = np.cumsum(rng.integers(10, 50, 20)) * FRAME_S
        speeds = rng.uniform(-0.2, 0.2, (2, len(changes) + 1)) * (rng.random(len(changes) + 1) > 0.15)
        told = speeds[:, np.searchsorted(changes, t + 1e-9, side="right")]
        left, right = moved(told)
        turn = np.cumsum((right - left) / NOMINAL.wheelbase_m * DENSE_S)
        heading, ahead = rng.uniform(-3, 3) + turn, (left + right) / 2 * DENSE_S
        pose = np.column_stack([np.cumsum(ahead * np.cos(heading)), np.cumsum(ahead * np.sin(heading)), heading])
        seen = slice(0, None, round(FRAME_S / DENSE_S))
        noisy = pose[seen] + rng.normal(size=pose[seen].shape) * [0.001, 0.001, 0.004]
        columns = {"trial": trial, "t_s": t[seen], "left_m_s": told[0, seen], "right_m_s": told[1, seen]}
        tables.append(pd.DataFrame(columns | {"x_m": noisy[:, 0], "y_m": noisy[:, 1], "heading_rad": noisy[:, 2]}))
    return WheelPredictor(tracks_of(pd.concat(tables, ignore_index=True)))


def overshoot():
    """Of a second-order system's step response, in closed form."""
    return np.exp(-np.pi * DAMPING / np.sqrt(1 - DAMPING**2))


@pytest.mark.slow
def test_a_ringing_controller_is_described():
    predictor = ringing()
    found = established(predictor, NOMINAL, {})
    assert [term.signal for term in found.terms][:1] == [RESPONSE]
    said = re.search(r"goes beyond it by (\d+)% after ([\d.]+) s", in_words(found.terms[0], predictor))
    assert float(said.group(1)) == pytest.approx(100 * overshoot(), abs=5)
    peak_s = np.pi / (FREQUENCY * np.sqrt(1 - DAMPING**2))
    assert float(said.group(2)) == pytest.approx(peak_s, abs=0.1)


@pytest.mark.slow
def test_beside_a_free_response_no_shift_in_time_is_named():
    """A response in time contains each shift: an offset that suits its coarse steps better says nothing of a clock."""
    predictor = ringing()
    found = established(predictor, NOMINAL, {"clock-offset": listed(NOMINAL, None, predictor.tracks)["clock-offset"]}, True)
    assert [term.signal for term in found.terms] == [RESPONSE]
    assert found.names == ()


def test_a_response_that_begins_beyond_its_end_goes_there_at_once():
    term = SimpleNamespace(signal=RESPONSE, on="wheels", term="k * (1 - ago(0.2, 0.4))", values={"k": 0.5}, fit=SimpleNamespace())
    term.fit.model = NOMINAL
    assert "goes beyond it by 50% at once, and stays within 5% of it from 0.3" in in_words(term, None)


@pytest.mark.parametrize("term", ["k * (ago(0.1, 0.2) - ago(0.4, 0.7))", "-k * ago(0.2, 0.4)"])
def test_what_is_no_response_to_a_step_is_not_described_as_one(term):
    """A term that overshoots by more than the step, or ends in the other direction."""
    term = SimpleNamespace(signal=RESPONSE, on="wheels", term=term, values={"k": 3.0})
    assert in_words(term, None).endswith("not as the response of a drive to a step does")


@pytest.mark.parametrize(
    ("model", "said"),
    [
        (NOMINAL, "after a change of its command a wheel has half of the new speed within 0.04 s, and"),
        (
            NOMINAL.with_effect("motor-lag", tau_s=0.2),
            "after a change of its command, beyond what the effects of the wheels do to it, a wheel has half of the new speed",
        ),
    ],
)
def test_a_response_says_from_what_it_begins_and_no_time_that_its_knots_do_not_resolve(model, said):
    term = SimpleNamespace(signal=RESPONSE, on="wheels", term="k * (ago(0.4, 0.55) - u)", values={"k": 0.3})
    assert in_words(SimpleNamespace(**vars(term), fit=SimpleNamespace(model=model)), None).startswith(said)


def test_a_response_that_is_over_before_the_first_knot_is_said_to_be_at_once():
    """No half of the speed by one time and all of it before that."""
    term = SimpleNamespace(signal=RESPONSE, on="wheels", term="k * (ago(0.0, 0.03) - u)", values={"k": 1.0})
    said = in_words(SimpleNamespace(**vars(term), fit=SimpleNamespace(model=NOMINAL)), None)
    assert said == "after a change of its command a wheel has the new speed within 0.04 s"


def test_a_free_response_is_tried_only_where_no_effect_was_accepted(monkeypatch):
    """It can imitate lag, delay and limits; these have names, and numbers that can be measured."""
    asked = []
    offered = grammar.families

    def families(predictor, wheelbase_m, response=True):
        asked.append(RESPONSE in {family.signal for family in offered(predictor, wheelbase_m, response)})
        return []

    monkeypatch.setattr("bns.diagnose.residuals.established.families", families)
    predictor = ringing(trials=8)
    established(predictor, NOMINAL, {})
    established(predictor, NOMINAL, {"motor-lag": listed(NOMINAL, None, predictor.tracks)["motor-lag"]})
    assert asked == [True, False]


@pytest.mark.slow
def test_a_robot_that_goes_ahead_more_slowly_than_it_turns_is_described_beside_its_lag():
    predictor = two_lags()
    accepted = {name: listed(NOMINAL, None, predictor.tracks)[name] for name in ("motor-lag", "turn-slip")}
    found = established(predictor, NOMINAL, accepted)
    assert found.names == ("motor-lag",)
    assert found.fit.model.values_of("motor-lag")["tau_s"] == pytest.approx(0.06, abs=0.01)
    assert [term.signal for term in found.terms][:1] == [RESPONSE_OF["v"]]
    begun = "after a change of its command, beyond what the effects of the wheels do to it, the robot's forward motion has half"
    assert in_words(found.terms[0], predictor).startswith(begun)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("barred", "verdict", "effects", "errors"),
    [
        ((), "effects", ["controller-overshoot"], "error"),
        (("controller-overshoot",), "unlisted", [], "error_with_terms"),
    ],
)
def test_with_the_effect_or_the_response_the_error_falls_to_the_noise(barred, verdict, effects, errors):
    answer = diagnose(ringing(), NOMINAL, barred=barred).as_json()
    assert (answer["verdict"], answer["effects"]) == (verdict, effects)
    for horizon in ("1s", "5s", "trial"):
        error = answer[errors][horizon]
        assert error["after"] < 1.5 * error["noise_floor"] < error["before"], horizon
