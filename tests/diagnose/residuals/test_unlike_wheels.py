"""Wheels that answer unlike each other, or brake otherwise than they speed up: named, and described where they are not listed."""

import re
from types import SimpleNamespace

import numpy as np
import pytest

from bns.diagnose.data.tracks import tracks_of
from bns.diagnose.diagnosing import diagnose
from bns.diagnose.estimate.parameters import FreeParameter
from bns.diagnose.estimate.plausibility import limiting, undetermined
from bns.diagnose.estimate.problem import problem_for
from bns.diagnose.estimate.starts import listed
from bns.diagnose.predict.wheels import WheelPredictor
from bns.diagnose.residuals.established import established
from bns.diagnose.residuals.grammar import RESPONSE_ALONE, RESPONSE_KNOTS_S, SLOWING, families
from bns.diagnose.residuals.symbolic import fitted
from bns.diagnose.residuals.words import in_words
from bns.physics.model import effect_named
from tests.diagnose.worlds import NOMINAL, hidden, measured


def driven(trials=20, **effects):
    return WheelPredictor(tracks_of(measured(hidden(**effects), trials=trials, seed=4, speeds=(-0.2, 0.2))))


@pytest.mark.slow
@pytest.mark.parametrize(
    ("name", "values"),
    [
        ("lag-mismatch", {"tau_s": 0.15, "ratio": 2.0}),
        ("braking-lag", {"tau_s": 0.2, "brake_ratio": 0.4}),
        ("braking-limit", {"max_m_s2": 0.25, "brake_ratio": 2.5}),
        ("braking-ramp", {"forward_m_s2": 0.25, "turn_rad_s2": 4.0, "brake_ratio": 2.5}),
        ("speed-scaling", {"max_m_s": 0.12}),
    ],
)
def test_each_is_named_with_its_numbers(name, values):
    found = diagnose(driven(trials=14, **{name.replace("-", "_"): values}), NOMINAL)
    assert (found.verdict, found.effects) == ("effects", (name,))
    assert {key: one["value"] for key, one in found.numbers[name].items()} == pytest.approx(values, rel=0.03)


@pytest.mark.slow
def test_a_lag_of_one_wheel_that_is_not_listed_is_described_beside_the_lag_of_both():
    """Without the words for it a false ratio of the wheels' diameters stood in for it."""
    predictor = driven(lag_mismatch={"tau_s": 0.15, "ratio": 2.0})
    catalogue = listed(NOMINAL, None, predictor.tracks)
    found = established(predictor, NOMINAL, {name: catalogue[name] for name in ("motor-lag", "wheel-mismatch")})
    assert found.names == ("motor-lag",)
    assert (found.terms[0].signal, found.terms[0].on) in {(signal, on) for on, signal in RESPONSE_ALONE.items()}
    assert in_words(found.terms[0], predictor).startswith(("the left wheel follows", "the right wheel follows"))


@pytest.mark.parametrize(
    ("on", "signal", "number", "said"),
    [
        ("left", RESPONSE_ALONE["left"], 0.5, "the left wheel follows a change of its command 0.07 s later than the right"),
        ("right", RESPONSE_ALONE["right"], -0.5, "the right wheel follows a change of its command 0.07 s sooner than the left"),
        ("wheels", SLOWING, -0.5, "a wheel that slows down follows its command 0.07 s sooner than one that speeds up"),
    ],
)
def test_a_response_is_said_by_how_much_later_it_makes_a_wheel(on, signal, number, said):
    """Half of a step comes with the command of 0.1 to 0.18 s ago."""
    assert RESPONSE_KNOTS_S[2:4] == (0.1, 0.18)
    values = {f"k{i}": number * (i == 2) for i in range(len(RESPONSE_KNOTS_S) - 1)}
    assert in_words(SimpleNamespace(on=on, signal=signal, term="", values=values), None).startswith(said)


@pytest.mark.parametrize(
    ("effects", "given_s", "on", "signal", "said", "within_s"),
    [
        ({"lag_mismatch": {"tau_s": 0.15, "ratio": 2.0}}, 0.2, "left", RESPONSE_ALONE["left"], "sooner than the right", 0.005),
        ({"lag_mismatch": {"tau_s": 0.15, "ratio": 2.0}}, 0.1, "right", RESPONSE_ALONE["right"], "later than the left", 0.005),
        ({"braking_lag": {"tau_s": 0.2, "brake_ratio": 0.5}}, 0.2, "wheels", SLOWING, "sooner than one that speeds", 0.02),
    ],
)
def test_a_response_that_is_fitted_says_the_delay_of_the_robot(effects, given_s, on, signal, said, within_s):
    """By 0.1 s. A fit has its numbers in the order of texts, k10 before k2: 0.14 and 0.13 s were said of one wheel."""
    predictor, given = driven(**effects), NOMINAL.with_effect("motor-lag", tau_s=given_s)
    family = next(f for f in families(predictor, NOMINAL.wheelbase_m) if (f.signal, f.on) == (signal, on))
    problem = problem_for(predictor, given)
    term = fitted(problem, problem.fit(given), on, family.term, "unlisted", signal)
    late = re.search(rf"([0-9.]+) s {said}", in_words(term, predictor))
    assert float(late[1]) == pytest.approx(0.1, abs=within_s)


def made_up(intervals):
    """A fit of warm-up's numbers, loss (-1 to 1) and time_s (0.1 to 600), with these intervals."""
    free = tuple(FreeParameter("warm-up", p) for p in effect_named("warm-up").parameters)
    values = [sum(ends) / 2 for ends in intervals]
    se = [(high - low) / 4 for low, high in intervals]
    return SimpleNamespace(free=free, values=values, interval=lambda i: intervals[i], se=lambda i: se[i])


def test_numbers_that_may_be_anything_are_not_determined():
    anything, something = ((-1.0, 1.0), (0.1, 600.0)), ((-0.3, -0.1), (0.1, 600.0))
    assert undetermined(made_up(anything), "warm-up") == "these data do not determine loss and time_s"
    assert undetermined(made_up(something), "warm-up") == ""
    assert limiting(made_up(something), "warm-up")  # a warm-up of any length is a gain
    assert not limiting(made_up(((-0.3, -0.1), (90.0, 600.0))), "warm-up")
    assert not limiting(made_up(((-0.3, -0.1), (2.0, 9.0))), "warm-up")
    assert limiting(made_up(((-0.3, -0.1), (600.0, 600.0))), "warm-up")  # as long as a trial, and would be longer
    assert not limiting(made_up(((1.0, 1.0), (90.0, 500.0))), "warm-up")  # the loss has an end that no log sets


def test_a_warm_up_takes_no_longer_than_the_longest_trial():
    predictor = driven(trials=4)
    longest_s = float(predictor.tracks.own_s.max())
    loss, time = listed(NOMINAL, None, predictor.tracks)["warm-up"].parameters
    assert (time.high, time.plausible[1]) == (longest_s, longest_s)
    assert loss == effect_named("warm-up").parameters[0]
    assert effect_named("warm-up").lasting(1e4) == effect_named("warm-up")


@pytest.mark.slow
def test_a_gain_is_no_tie_with_a_warm_up_that_outlasts_every_trial():
    found = diagnose(driven(trials=12, speed_gain={"gain": 0.95}), NOMINAL)
    assert (found.verdict, found.effects) == ("effects", ("speed-gain",))


def test_a_limit_that_nothing_reaches_has_no_slope():
    """Beside one that is finite a step of infinity made every number of the model NaN."""
    predictor = driven(trials=4)
    model = NOMINAL.with_effect("velocity-ramp", forward_m_s2=0.3, turn_rad_s2=np.inf)
    fit = problem_for(predictor, model).fit(model, rounds=0)
    assert np.isfinite(fit.jacobian).all()
    assert not fit.jacobian[..., 1].any()


def test_a_number_at_neutral_on_its_upper_bound_is_compared():
    """Its step for differences goes down: taken for a distance it divided 0 by 0."""
    predictor = driven(warm_up={"loss": 0.3, "time_s": 2.0})
    bounded = effect_named("warm-up").lasting(2.0)
    assert bounded.parameters[1].high == bounded.parameters[1].neutral == 2.0
    problem = problem_for(predictor, NOMINAL)
    base = problem.fit(NOMINAL)
    added = problem.fit(NOMINAL.with_active(bounded, (0.3, 2.0)), rounds=0)
    assert problem.paired_comparison(base, added).p_value < 1e-4
