"""Beside a term that describes what is on no list, an effect of the list is named rather than drawn by a second term."""

import numpy as np
import pandas as pd
import pytest

from bns.diagnose import beside_terms, outcome, standing
from bns.diagnose.data.tracks import tracks_of
from bns.diagnose.diagnosing import diagnose
from bns.diagnose.estimate.problem import problem_for
from bns.diagnose.estimate.starts import listed
from bns.diagnose.predict.paired_errors import paired_errors
from bns.diagnose.predict.wheels import WheelPredictor
from bns.diagnose.residuals import established
from bns.diagnose.residuals.established import Established
from bns.diagnose.residuals.symbolic import fitted
from bns.diagnose.select.result import SelectionResult
from bns.physics.effects import all_effects
from tests.diagnose.worlds import BASE_M, FRAME_S, NOMINAL, hidden, measured

MISMATCH = 1.012


@pytest.fixture(scope="module")
def lopsided():
    """A log of wheels of unlike size, the effects that the model lacks, and the fit without any."""
    predictor = WheelPredictor(tracks_of(measured(hidden(wheel_mismatch={"ratio": MISMATCH}), trials=16, seed=4)))
    problem = problem_for(predictor, NOMINAL)
    return problem, listed(NOMINAL, None, predictor.tracks), problem.fit(NOMINAL)


def term(lopsided, formula, on="left"):
    problem, _, fit = lopsided
    return fitted(problem, fit, on, formula)


def test_an_effect_that_predicts_as_well_with_fewer_numbers_is_named(lopsided):
    problem, others, fit = lopsided
    others = {name: effect for name, effect in others.items() if name != "wheel-diameters"}  # hardly told from it
    name, added = established._in_its_place(problem, fit, term(lopsided, "k0 * u + k1 * u * abs(u)"), others)
    assert name == "wheel-mismatch"
    assert added.values[0] == pytest.approx(MISMATCH, abs=0.003)


@pytest.mark.parametrize("why", ["as many numbers", "no such effect", "it does less", "there already"])
def test_else_the_term_comes_in(lopsided, why):
    problem, others, fit = lopsided
    free = term(lopsided, "k * u" if why == "as many numbers" else "k0 * u + k1 * u * abs(u)")
    if why == "it does less":
        free, others = term(lopsided, "k0 * v + k1 * v * abs(v)", "w"), {"yaw-bias": others["yaw-bias"]}
    if why == "no such effect":
        others = {}
    if why == "there already":
        others = {"wheel-mismatch": others["wheel-mismatch"]}
        fit = problem.fit(NOMINAL.with_effect("wheel-mismatch", ratio=MISMATCH))
    assert established._in_its_place(problem, fit, free, others) == ("", fit)


def curved(trials=20, commands=9, seed=3):
    """By this test's own integrator: a driver whose speed is 15 % low but at full speed, and a right wheel 1.2 % larger."""
    rng, step_s, rows = np.random.default_rng(seed), FRAME_S / 8, []
    for trial in range(trials):
        told = rng.uniform(-0.2, 0.2, (commands, 2))
        ends = np.cumsum(rng.choice([1.0, 1.4, 2.0], commands))
        t_s = np.arange(0.0, ends[-1], step_s)
        of = np.searchsorted(ends[:-1], t_s + 1e-9, side="right")
        jittered = told * (1 + 0.003 * rng.standard_normal(told.shape))
        speed = (0.85 * jittered + 0.15 * jittered**3 / 0.04)[of] * [MISMATCH**-0.5, MISMATCH**0.5]
        heading = rng.uniform(-3, 3) + np.append(0.0, np.cumsum((speed[:, 1] - speed[:, 0]) / BASE_M * step_s)[:-1])
        x_m, y_m = (np.append(0.0, np.cumsum(speed.mean(axis=1) * f(heading) * step_s)[:-1]) for f in (np.cos, np.sin))
        poses = np.column_stack([x_m, y_m, heading])[::8]
        poses = poses + rng.standard_normal(poses.shape) * [1e-3, 1e-3, 4e-3]
        columns = {"trial": trial, "t_s": t_s[::8], "left_m_s": told[of[::8], 0], "right_m_s": told[of[::8], 1]}
        rows.append(pd.DataFrame(columns | dict(zip(("x_m", "y_m", "heading_rad"), poses.T, strict=True))))
    return pd.concat(rows, ignore_index=True)


@pytest.mark.parametrize("helps", [True, False])
def test_what_terms_bring_to_light_stays_where_the_error_falls_from_the_model_as_given(lopsided, monkeypatch, helps):
    """With mocked parts: the effect alone is worse than none; with the terms beside it the error is lower, or still higher."""
    problem, _, nominal = lopsided
    predictor, with_term = problem.predictor, term(lopsided, "k * v * abs(v)", "v")
    with_effect = problem.fit(with_term.fit.model.with_effect("wheel-mismatch", ratio=1.0))
    found = Established(("wheel-mismatch",), (with_term,), problem, with_effect)
    without = Established((), (with_term,), problem, with_term.fit)
    ratios = {"as given": 1.0, standing.WITH_EFFECTS: 1.05, beside_terms.WITH_TERMS: MISMATCH if helps else 1.03}
    steps = [(name, predictor.steps(NOMINAL.with_effect("wheel-mismatch", ratio=one))) for name, one in ratios.items()]
    barred = []
    monkeypatch.setattr(outcome, "sought_terms", lambda *given: (barred.extend(given[4]), without)[1] if given[4:] else found)
    monkeypatch.setattr(outcome, "without_absurd", lambda found, *_: found)
    monkeypatch.setattr(beside_terms, "_errors_with_terms", lambda *_: paired_errors(predictor, steps))
    ended = outcome.outcome_of(SelectionResult(problem, nominal, nominal, (), ()), predictor, NOMINAL, lambda _: None)
    assert ended.selection.accepted == (("wheel-mismatch",) if helps else ())
    assert barred == ([] if helps else ["wheel-mismatch"])
    assert ended.terms


@pytest.mark.slow
def test_a_curve_on_no_list_does_not_hide_unlike_wheels():
    of_floor = sorted(name for name, effect in all_effects().items() if effect.needs_place or effect.starts_from)
    found = diagnose(WheelPredictor(tracks_of(curved())), NOMINAL, barred=of_floor)  # which take most of the time
    assert found.verdict == "unlisted"
    assert found.effects == ("wheel-mismatch",)
    low, high = (found.numbers["wheel-mismatch"]["ratio"][end] for end in ("low", "high"))
    assert low < MISMATCH < high
    assert [(one.signal, one.on) for one in found.terms] == [("speed of each wheel", "wheels")]
