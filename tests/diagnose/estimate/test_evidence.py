"""Chances are what they say, and fits say how well they know."""

from itertools import product
from types import SimpleNamespace

import numpy as np
import pytest

from bns.diagnose.data.tracks import tracks_of
from bns.diagnose.estimate import fitting, starts
from bns.diagnose.estimate.chords import reaching
from bns.diagnose.estimate.fitting import Problem
from bns.diagnose.estimate.noise import estimate_noise
from bns.diagnose.estimate.parameters import FreeParameter
from bns.diagnose.estimate.problem import problem_for
from bns.diagnose.estimate.significance import FLIPS, fewest_trials, paired_elpd_diff, sign_flip_p
from bns.diagnose.predict.wheels import WheelPredictor
from bns.physics.effects import effect_named
from tests.diagnose.worlds import NOMINAL, hidden, measured


def test_sign_flips_are_exact_under_heavy_tails():
    """Where nothing is hidden, a chance below 5 % comes in 5 % of the cases, for trials of any scatter."""
    rng = np.random.default_rng(1)
    scores = rng.standard_t(2, size=(400, 20, 2)) * rng.lognormal(0, 1, size=(400, 20, 1))
    chances = np.array([sign_flip_p(s, s.T @ s) for s in scores])
    assert 0.02 < (chances < 0.05).mean() < 0.085
    assert 0.40 < (chances < 0.5).mean() < 0.60


def test_trials_that_pull_together_are_no_luck():
    scores = 1.0 + 0.1 * np.random.default_rng(2).normal(size=(20, 1))
    assert sign_flip_p(scores, scores.T @ scores) < 1e-4
    assert sign_flip_p(np.zeros((20, 1)), np.zeros((1, 1))) == 1.0


def test_no_chance_is_less_than_that_of_one_lot_among_all_that_were_drawn():
    """Thirty trials pull the same way in two of a billion lots, of which twenty thousand are drawn."""
    assert sign_flip_p(np.ones((30, 1)), np.eye(1)) == 1 / (1 + FLIPS)


def test_the_chance_of_numbers_that_depend_on_one_another_is_that_of_all_signs():
    """Against every one of the 1,024 ways to flip ten trials."""
    rng = np.random.default_rng(3)
    curvature = np.array([[4.0, 1.9, 0.3], [1.9, 1.0, 0.1], [0.3, 0.1, 9.0]])
    inverse = np.linalg.inv(curvature)
    for shift in (0.0, 0.6, 1.2):
        scores = rng.multivariate_normal([shift, 0.3 * shift, 0.0], curvature, size=10)
        signs = np.array(list(product([-1.0, 1.0], repeat=10)))
        sums = signs @ scores
        statistic = np.einsum("fk,kl,fl->f", sums, inverse, sums)
        exact = (statistic >= statistic[-1] * (1 - 1e-9)).mean()  # the last has no sign flipped
        assert sign_flip_p(scores, curvature) == pytest.approx(exact, abs=0.015)


def test_one_step_of_least_squares_from_nothing_ends_near_the_fit():
    predictor = WheelPredictor(tracks_of(measured(hidden(wheelbase={"factor": 1.03}, yaw_bias={"rate_rad_s": 0.02}), trials=12)))
    problem = problem_for(predictor, NOMINAL)
    base = problem.fit(NOMINAL)
    model = NOMINAL.with_effect("wheelbase", factor=1.0).with_effect("yaw-bias", rate_rad_s=0.0)
    there, best = problem.gauss_newton_step(model, base).model, problem.fit(model).model
    for name in ("wheelbase", "yaw-bias"):
        (step,), (fitted,) = there.values_of(name).values(), best.values_of(name).values()
        neutral = 1.0 if name == "wheelbase" else 0.0
        assert step - neutral == pytest.approx(fitted - neutral, rel=0.15)


@pytest.mark.parametrize(
    ("gains", "asked_at", "is_of_the_end"),
    [((1.6, 1.6, 1.6), [0], False), ((1.4, 1.6, 1.6), [0, 1], False), ((1.6, 1.4, 1.4), [0, 2, 3], True)],
)
def test_slopes_serve_again_while_the_loss_falls_by_three_quarters_of_what_they_said(gains, asked_at, is_of_the_end):
    """A residual of 2 that falls by 1 with each unit of one number: squares of half a residual say 2 less."""
    problem, asked = Problem.__new__(Problem), []

    def at(step):
        model = SimpleNamespace(per_trial_effect=None, step=step)
        return SimpleNamespace(model=model, whitened=np.array([[2.0, 0.0, 0.0]]), loss=100.0 - sum(gains[:step]))

    def jacobian(place, *_):
        asked.append(place.model.step)
        return SimpleNamespace(jacobian=np.array([[[-1.0], [0.0], [0.0]]]))

    problem._jacobian = jacobian
    problem._lower = lambda place, *_: (at(place.model.step + 1), 1e-3)
    end, _, fresh = problem._descended(at(0), (), None, 3)
    assert (end.model.step, asked, fresh) == (3, asked_at, is_of_the_end)


def test_gain_is_paired_by_trial():
    before = np.array([10.0, 20.0, 30.0])
    assert paired_elpd_diff(before, before - 1.0) == (1.0, 0.0)
    assert paired_elpd_diff(before, np.array([10.0, np.inf, 30.0]))[0] == -np.inf


def test_the_error_of_a_mean_gain_is_that_of_a_sample():
    """Gains 1, 2, 3 and 6: squares about their mean of 3 sum to 14, over three degrees of freedom and four trials."""
    before = np.array([11.0, 7.0, 8.0, 9.0])
    gain, error = paired_elpd_diff(before, before - [1.0, 2.0, 3.0, 6.0])
    assert (gain, error) == pytest.approx((3.0, (14 / 3 / 4) ** 0.5))
    assert paired_elpd_diff(before[:1], before[:1] - 1.0) == (1.0, np.inf)


@pytest.mark.parametrize(
    ("effects", "effect", "name", "true"),
    [
        ({"motor_lag": {"tau_s": 0.08}}, "motor-lag", "tau_s", 0.08),
        ({"wheelbase": {"factor": 1.06}}, "wheelbase", "factor", 1.06),
        ({"speed_limit": {"max_m_s": 0.16}}, "speed-limit", "max_m_s", 0.16),
        ({"side_slip": {"slip_s": -0.08}}, "side-slip", "slip_s", -0.08),
        ({"camera_rotation": {"angle_rad": 0.05}}, "camera-rotation", "angle_rad", 0.05),
    ],
)
def test_planted_numbers_come_back_within_their_intervals(effects, effect, name, true):
    predictor = WheelPredictor(tracks_of(measured(hidden(**effects), trials=14, seed=3)))
    problem = problem_for(predictor, NOMINAL)
    fit = starts.fit_with(problem, problem.fit(NOMINAL), effect_named(effect))
    index = [f.parameter.name for f in fit.free].index(name)
    low, high = fit.interval(index, 0.999)
    assert low < true < high
    assert high - low < 0.5 * abs(true - (1.0 if name == "factor" else 0.0)) + 0.02


def test_what_holds_a_trial_out_is_close_to_a_fit_without_it():
    """One Newton step from the common fit stands for a fit to all other trials."""
    from bns.diagnose.estimate.noise import huber

    predictor = WheelPredictor(tracks_of(measured(hidden(wheelbase={"factor": 1.05}), trials=8, seed=5)))
    model = NOMINAL.with_effect("wheelbase", factor=1.0)
    problem = problem_for(predictor, model)
    fit = problem.fit(model)
    for trial in (0, 5):
        counted = (problem.frame_trial != trial).astype(float)
        without = Problem(predictor, problem.pose_filter, counted).fit(model)
        truly = problem.per_trial(huber(problem.whitened(without.model)))[trial]
        assert fit.held_out[trial] == pytest.approx(truly, rel=2e-3)
        assert fit.held_out[trial] >= fit.losses[trial] - 1e-6


def test_so_many_trials_are_the_fewest_that_can_bring_an_effect_in():
    level = 0.05 / 20
    fewest = fewest_trials(level)
    assert fewest == 10  # 2 of the 2^10 ways that the signs can fall
    assert sign_flip_p(np.ones((fewest - 1, 1)), np.eye(1)) >= level > sign_flip_p(np.ones((fewest, 1)), np.eye(1))


def test_the_noise_of_tracking_is_taken_from_the_tracks_where_they_tell_it():
    predictor = WheelPredictor(tracks_of(measured(NOMINAL, trials=3)))
    steps = predictor.steps(NOMINAL)
    guessed = estimate_noise(predictor, steps)
    predictor.tracking = (0.0031, 0.0123)
    known = estimate_noise(predictor, steps)
    assert known[:2] == pytest.approx([0.0031, 0.0123])
    assert abs(guessed[:2] / known[:2] - 1).min() > 0.1


@pytest.mark.parametrize(
    ("name", "before", "ruling", "flatter"),
    [
        ("wheelbase", 0.7, 3.1, True),
        ("wheelbase", 0.7, 2.9, False),
        ("wheelbase", 4900.0, 4900.0, False),  # a step of a thousandth moves both by 4.9 standard deviations
        ("wheelbase", 5100.0, 5100.0, True),  # and by 5.1: two trials jump at once, and neither rules alone
        ("dead-band", 5100.0, 5100.0, False),  # a number that has steps of its own
    ],
)
def test_where_a_slope_jumps_each_trial_has_the_one_of_its_flatter_side(name, before, ruling, flatter):
    """Three trials of one frame each; the last has more or less than nine tenths of the sum of squares."""
    one = FreeParameter(name, effect_named(name).parameters[0])
    rows = ((before, 0.7, ruling), (0.6, 0.8, 0.1))
    ahead, back = (np.array([[a, 0.0, 0.0], [0.0, b, 0.0], [0.0, 0.0, c]]) for a, b, c in rows)
    problem = Problem.__new__(Problem)
    problem.predictor = SimpleNamespace(luck=None, tracks=SimpleNamespace(first=np.arange(4)))
    problem._trial = np.arange(3)
    problem._difference = lambda _at, _free, _j, by: ahead if by > 0 else back
    values = tuple(value + 0.05 for value in effect_named(name).neutral.values())
    at = SimpleNamespace(model=NOMINAL.with_active(effect_named(name), values))
    found = problem._slope(at, [one], 0, 1e-3)
    np.testing.assert_array_equal(found, np.stack([back[0], ahead[1], back[2]]) if flatter else ahead)
    problem.predictor.luck = object()
    assert problem._slope(at, [one], 0, 1e-3) is ahead


def test_of_wide_slopes_to_both_sides_the_flatter_one_counts(monkeypatch):
    one = FreeParameter("wheelbase", effect_named("wheelbase").parameters[0])
    at = SimpleNamespace(model=hidden(wheelbase={"factor": 1.0}), whitened=np.zeros((2, 3)))
    problem, flat = Problem.__new__(Problem), np.array([[1.0, 0.0, 0.0], [0.0, -1.0, 0.0]])
    monkeypatch.setattr(fitting, "increments", lambda *_: [0.1, -0.1, 0.2])
    problem._slope = lambda _at, _free, _j, by: {0.1: 3.0, -0.1: 1.0, 0.2: -2.0}[by] * flat
    np.testing.assert_array_equal(problem._jacobian(at, [one], wide=True).jacobian[..., 0], flat)


def test_the_way_to_a_fit_takes_the_place_of_the_direction_most_like_it():
    """Most like it whatever its length or its sign."""
    columns = np.array([[[9.0, 0.0, 1.0], [0.0, -0.1, 1.0], [0.0, 0.0, 1.0]]])
    way = np.array([[0.2, 1.0, 0.1]])
    expected = columns.copy()
    expected[..., 1] = way
    np.testing.assert_array_equal(reaching(way, columns), expected)
    assert columns[0, 1, 1] == -0.1, "the columns given stay as they are"


@pytest.mark.parametrize(
    ("falls", "promises", "screening", "rounds"),
    [(0.049, 0.049, None, 0), (0.051, 0.0, None, None), (0.0, 0.051, None, None), (0.0, 0.051, "few", 0)],
)
def test_a_start_that_earns_next_to_nothing_of_what_a_trial_loses_is_not_followed(
    monkeypatch, falls, promises, screening, rounds
):
    """Ten trials that lose 10 each: half a percent of that is 0.05. Promises are followed where no fit takes minutes."""
    start = SimpleNamespace(model="there", loss=100.0 - falls, promised=100.0 - promises, jacobian_by_parameter="nearby")
    monkeypatch.setattr(starts, "best_start", lambda *_: start)
    base = SimpleNamespace(loss=100.0, losses=np.full(10, 10.0))
    problem = SimpleNamespace(fit=lambda *asked: asked, predictor=SimpleNamespace(screening=screening))
    assert starts.fit_with(problem, base, SimpleNamespace(name="any", after="motor-lag")) == ("there", rounds, "nearby")
