"""Intervals: the jackknife over trials, and numbers along which the loss has steps."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from bns.diagnose.data.checks import checked
from bns.diagnose.data.tracks import tracks_of
from bns.diagnose.estimate import fit_set as fit_set_module
from bns.diagnose.estimate.chords import chords
from bns.diagnose.estimate.fit import Fit
from bns.diagnose.estimate.fit_set import fit_set
from bns.diagnose.estimate.jagged import _drawn, _middle_of_least, _searched, with_jagged
from bns.diagnose.estimate.normal_equations import normal_equations
from bns.diagnose.estimate.parameters import FreeParameter, active_mask, increment, increments
from bns.diagnose.estimate.problem import problem_for
from bns.diagnose.estimate.significance import jackknife_covariance
from bns.diagnose.estimate.starts import listed
from bns.diagnose.predict.wheels import WheelPredictor
from bns.physics.effects import effect_named
from tests.diagnose.worlds import NOMINAL, hidden, measured


def predictor_of(model, **how):
    return WheelPredictor(tracks_of(checked(measured(model, **how))[0]))


def test_the_jackknife_is_that_of_fits_without_each_trial():
    """Trials of unequal weight: a line through points, one far out, by NumPy's own least squares."""
    rng = np.random.default_rng(0)
    x, y = np.append(rng.uniform(0, 1, 11), 6.0), rng.normal(size=12)
    columns = np.stack([np.ones(12), x], axis=1)
    whole = np.linalg.lstsq(columns, y, rcond=None)[0]
    without = [np.linalg.lstsq(np.delete(columns, i, 0), np.delete(y, i), rcond=None)[0] for i in range(12)]
    steps = np.array(without) - whole
    expected = 11 / 12 * sum(np.outer(s - steps.mean(axis=0), s - steps.mean(axis=0)) for s in steps)
    np.testing.assert_allclose(jackknife_covariance(steps), expected)


def test_a_fits_standard_error_is_the_jackknifes():
    predictor = predictor_of(hidden(speed_gain={"gain": 0.95}), trials=12)
    problem = problem_for(predictor, NOMINAL)
    gain = listed(NOMINAL, None, predictor.tracks)["speed-gain"]
    fit = problem.fit(NOMINAL.with_active(gain, (0.95,)))
    moved = []
    for i in range(12):
        others = predictor.tracks.trial != i
        curvature, gradient = normal_equations(fit.jacobian[others], fit.whitened[others])
        moved.append(-gradient[0] / curvature[0, 0])
    assert fit.se(0) == pytest.approx(np.std(moved) * np.sqrt(11), rel=1e-6)


@pytest.fixture(scope="module")
def dead_band():
    """Threshold 0.04 m/s: the fit, the problem, and the commands next to it below and above."""
    predictor = predictor_of(hidden(dead_band={"threshold_m_s": 0.04}), trials=30)
    effect = listed(NOMINAL, None, predictor.tracks)["dead-band"]
    model = NOMINAL.with_active(effect, (0.0412,))
    problem = problem_for(predictor, model)
    told = np.unique(np.abs(np.concatenate([predictor.tracks.left_m_s.ravel(), predictor.tracks.right_m_s.ravel()])))
    return problem, problem.fit(model), told[told < 0.04].max(), told[told > 0.04].min()


def test_a_threshold_lies_midway_between_the_commands_next_to_it(dead_band):
    problem, fit, below, above = dead_band
    found = with_jagged(problem, fit)
    assert found.loss < fit.loss + 1e-9
    assert found.values[0] == pytest.approx((below + above) / 2, abs=0.2 * (above - below))
    low, high = found.interval(0)
    assert low < below + 0.1 * (above - below)
    assert high > above - 0.1 * (above - below)
    assert high - low < 0.01, "and is known well all the same"
    assert found.se(0) == pytest.approx((high - low) / 2 / 1.96, rel=1e-3)


def test_fits_of_sets_of_effects_search_for_thresholds(dead_band):
    """`diagnose` and `add` both end there."""
    problem, fit, _, _ = dead_band
    effect = fit.model.effects[0].effect
    assert fit_set(problem.predictor, NOMINAL, [effect], known=fit.model)[1].spans


def test_a_limit_that_nothing_reaches_has_come_no_way():
    """Infinity less infinity is no number, and said so."""
    problem = problem_for(predictor_of(NOMINAL, trials=3), NOMINAL)
    added = problem.fit(NOMINAL.with_effect("command-timeout", timeout_s=float("inf")))
    assert not chords(problem.whitened, added, [0]).any()


def test_a_slope_that_spans_a_step_does_not_narrow_the_interval():
    """The other number would follow the step's slope, off to where the loss is higher within the same two changes of command."""
    true = hidden(supply_trip={"step_m_s": 0.2, "off_s": 0.3})
    predictor = predictor_of(true, trials=20, seed=6, speeds=(-0.2, 0.2), jitter=0.0)
    told = predictor.grid.left_m_s, predictor.grid.right_m_s
    sizes = sum(np.abs(np.diff(wheel, axis=1, prepend=0.0)) for wheel in told)
    below, above = sizes[sizes < 0.2].max(), sizes[sizes > 0.2].min()
    effect = listed(NOMINAL, None, predictor.tracks)["supply-trip"]
    limit, off = effect.parameters
    effect = replace(effect, parameters=(replace(limit, resolution=0.02), off))  # over which the slope is taken
    model = NOMINAL.with_active(effect, ((below + above) / 2, 0.3))
    problem = problem_for(predictor, model)
    fit = problem.fit(model)
    assert np.abs(fit.jacobian[..., 0]).max() > 0
    low, high = with_jagged(problem, fit).interval(0)
    assert low < below < above < high


@pytest.fixture(scope="module")
def gain():
    """A smooth number that says that it is jagged: problem and fit."""
    predictor = predictor_of(hidden(speed_gain={"gain": 0.95}), trials=30)
    effect = listed(NOMINAL, None, predictor.tracks)["speed-gain"]
    jagged = replace(effect, parameters=(replace(effect.parameters[0], jagged=True),))
    problem = problem_for(predictor, NOMINAL.with_active(effect, (0.95,)))
    return problem, problem.fit(NOMINAL.with_active(jagged, (0.95,)))


def test_of_a_smooth_number_the_search_says_what_the_slopes_say(gain):
    problem, fit = gain
    value, (low, high) = _searched(problem, fit, 0)
    assert value == pytest.approx(fit.values[0], abs=0.3 * fit.se(0))
    assert high - low == pytest.approx(4 * fit.se(0), rel=0.35)


def test_an_interval_is_not_narrower_than_that_of_the_slopes(gain, monkeypatch):
    problem, fit = gain
    monkeypatch.setattr("bns.diagnose.estimate.jagged._searched", lambda *_: (0.95, (0.9499, 0.9501)))
    found = with_jagged(problem, fit)
    low, high = replace(found, spans={}).interval(0)
    assert found.interval(0) == (min(low, 0.9499), max(high, 0.9501))
    assert high - low > 2e-4


def test_a_step_lies_between_the_values_that_are_good_and_the_next_ones():
    losses = np.where(np.abs(np.arange(9.0) - 4.0) < 1.5, 0.0, 10.0)[:, None] * np.ones(5)
    assert _drawn(np.arange(9.0), losses) == (2.0, 6.0)


def test_smooth_numbers_are_left_as_they_are():
    predictor = predictor_of(hidden(speed_gain={"gain": 0.95}), trials=12)
    problem = problem_for(predictor, NOMINAL)
    fit = problem.fit(NOMINAL.with_effect("speed-gain", gain=0.95))
    assert with_jagged(problem, fit) is fit


def test_the_bootstrap_of_a_parabola_is_the_jackknifes_interval():
    rng = np.random.default_rng(1)
    at, own = np.linspace(-1.5, 1.5, 121), rng.normal(size=60)
    losses = (at[:, None] - own) ** 2 / 2
    low, high = _drawn(at, losses)
    half = 1.96 * own.std() / np.sqrt(60)
    assert (low, high) == pytest.approx((own.mean() - half, own.mean() + half), abs=0.09)


def test_of_equally_good_values_the_middle_is_taken():
    losses = np.array([9.0, 2.0, 1.0, 1.0, 1.01, 1.0, 5.0, 1.0])
    assert _middle_of_least(np.arange(8.0), losses) == 3.5


def fit_of(value, variance, trials, numbers=2, jacobian=1.0):
    """A fit of which the first number, with bounds 0.5 and 2, has this value and this variance."""
    factor = replace(effect_named("wheelbase").parameters[0], low=0.5, high=2.0)
    free = tuple(FreeParameter(f"e{i}", factor) for i in range(numbers))
    covariance, jacobian = np.diag([variance] + [1.0] * (numbers - 1)), np.full((trials, 3, numbers), jacobian)
    return Fit(None, free, np.array([value] * numbers), covariance, np.ones(trials), np.ones(trials), jacobian[..., 0], jacobian)


def test_an_interval_is_student_s_with_a_degree_of_freedom_a_trial_less_one_a_number():
    """Of tables: 2.776 with four degrees of freedom, 12.706 with one, which is the least."""
    assert fit_of(1.0, 1e-4, 6).interval(0) == pytest.approx((1.0 - 0.02776, 1.0 + 0.02776), abs=1e-5)
    assert fit_of(1.0, 1e-4, 3).interval(0) == pytest.approx((1.0 - 0.12706, 1.0 + 0.12706), abs=1e-5)
    assert fit_of(1.0, 1e-4, 2).interval(0) == fit_of(1.0, 1e-4, 3).interval(0)
    assert fit_of(1.0, 1e-4, 6).interval(0, 0.9) == pytest.approx((1.0 - 0.02132, 1.0 + 0.02132), abs=1e-5)


@pytest.mark.parametrize(
    ("value", "ends"), [(1.0, (0.5, 2.0)), (0.4, (0.4, 2.0)), (2.1, (0.5, 2.1))], ids=["inside", "below", "above"]
)
def test_an_interval_ends_at_the_bounds_and_holds_its_value(value, ends):
    """A user's model may have a number that is beyond them."""
    assert fit_of(value, 100.0, 20).interval(0) == ends


def test_a_number_that_no_pose_depends_on_may_be_anything():
    assert fit_of(1.0, 0.0, 20, jacobian=0.0).interval(0) == (0.5, 2.0)
    assert fit_of(1.0, 0.0, 20).interval(0) == (1.0, 1.0)


def test_slopes_are_taken_inwards_at_the_upper_bound_and_wide_ones_to_both_sides_where_there_is_room():
    factor = next(p for p in effect_named("wheelbase").parameters if p.name == "factor")
    number, usual = FreeParameter("wheelbase", factor), increment(FreeParameter("wheelbase", factor), factor.neutral)
    assert usual > 0
    assert [increment(number, value) for value in (factor.low, factor.high - 2 * usual)] == [usual, usual]
    assert increment(number, factor.high) == -usual
    up, down = increments(number, factor.neutral, wide=True)
    assert up > 20 * usual
    assert down < -20 * usual
    assert [step < 0 for step in increments(number, factor.high, wide=True)] == [True]
    assert [step > 0 for step in increments(number, factor.low, wide=True)] == [True]
    assert increments(number, factor.neutral) == [usual]


@pytest.mark.parametrize(("falls", "taken"), [(0.4, False), (0.6, True), (-0.4, False)])
def test_an_effect_of_several_that_is_begun_again_must_end_lower_by_half(monkeypatch, falls, taken):
    """By less, it is the same valley."""
    model = SimpleNamespace(without=lambda name: name)
    fit, again = SimpleNamespace(loss=10.0, model=model, jacobian_by_parameter={}), SimpleNamespace(loss=10.0 - falls)
    effects = [SimpleNamespace(name=name) for name in "ab"]
    ends = {("a", "a"): fit, ("b", "b"): again}
    monkeypatch.setattr(fit_set_module, "fit_with", lambda _problem, lacking, effect: ends[lacking, effect.name])
    problem = SimpleNamespace(fit=lambda model, nearby: model)
    assert fit_set_module._begun_again(problem, fit, effects) is (again if taken else fit)
    assert fit_set_module._begun_again(problem, fit, effects[1:]) is fit


@pytest.mark.parametrize(("end", "outwards"), [("low", 1.0), ("high", -1.0)])
def test_only_a_gradient_that_presses_a_number_against_its_bound_holds_it_there(end, outwards):
    """The loss falls against its gradient: at the lower bound a positive one presses."""
    factor = next(p for p in effect_named("wheelbase").parameters if p.name == "factor")
    free = (FreeParameter("wheelbase", factor),)
    there, inside = (hidden(wheelbase={"factor": value}) for value in (getattr(factor, end), factor.neutral))
    assert active_mask(there, free, np.array([outwards])).tolist() == [False]
    assert active_mask(there, free, np.array([-outwards])).tolist() == [True]
    assert active_mask(inside, free, np.array([outwards])).tolist() == [True]
    assert active_mask(there, free, np.array([0.0])).tolist() == [True], "nothing presses"


def test_a_limit_that_is_not_reached_may_be_higher_but_not_lower():
    """The right wheel goes no faster than 0.12 m/s; the left one is never told more than 0.16, so that is its limit or more."""
    truth = hidden(speed_limit_mismatch={"max_m_s": 0.12, "left_spare": 1.0})
    predictor = predictor_of(truth, trials=20, speeds=(-0.16, 0.16))
    effect = listed(NOMINAL, None, predictor.tracks)["speed-limit-mismatch"]
    problem = problem_for(predictor, truth)
    fit = with_jagged(problem, problem.fit(NOMINAL.with_active(effect, (0.12, 0.3)), rounds=0))
    spare = next(j for j, number in enumerate(fit.free) if number.parameter.name == "left_spare")
    fastest = 0.16  # at 1 - 0.12 / 0.16 the left limit is that
    low, high = fit.interval(spare)
    assert (fit.values[spare], high) == (0.3, 1.0)
    assert 1 - 0.12 / fastest - 0.06 < low < 0.3
    other = with_jagged(problem, problem.fit(NOMINAL.with_active(effect, (0.2, 0.0)), rounds=0))  # neither is ever reached
    assert other.interval(spare)[1] == pytest.approx(1.0)
