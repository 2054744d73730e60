"""The chance that what an effect earns is luck, judged along its whole way from nothing to where it was found."""

import pytest

from bns.diagnose.data.tracks import tracks_of
from bns.diagnose.estimate.problem import problem_for
from bns.diagnose.estimate.starts import fit_with, listed
from bns.diagnose.predict.wheels import WheelPredictor
from tests.diagnose.worlds import NOMINAL, hidden, measured


@pytest.mark.parametrize("limit_m_s2", [0.02, 0.05, 0.1])
def test_a_limit_that_changes_everything_is_no_luck(limit_m_s2):
    """Along the tangent where it was found, as much would be luck in 58 to 85 of 100 cases (0.02 and 0.05 m/s²)."""
    table = measured(hidden(acceleration_limit={"max_m_s2": limit_m_s2}), trials=20, seed=1, speeds=(-0.2, 0.2), commands=8)
    predictor = WheelPredictor(tracks_of(table))
    problem = problem_for(predictor, NOMINAL)
    base = problem.fit(NOMINAL)
    added = fit_with(problem, base, listed(NOMINAL, None, predictor.tracks)["acceleration-limit"])
    assert added.values == pytest.approx([limit_m_s2], rel=0.02)
    assert problem.paired_comparison(base, added).p_value < 1e-4


def test_what_is_not_there_may_be_luck():
    predictor = WheelPredictor(tracks_of(measured(NOMINAL, trials=20, seed=1, commands=8)))
    problem = problem_for(predictor, NOMINAL)
    base = problem.fit(NOMINAL)
    for name in ("acceleration-limit", "wheelbase", "heating", "caster-swing"):
        added = fit_with(problem, base, listed(NOMINAL, None, predictor.tracks)[name])
        assert problem.paired_comparison(base, added).p_value > 1e-3


def test_a_delay_that_gives_way_to_another_delay_with_a_lag_is_no_luck():
    """One delay for both stands a long way off: seen from it, the lag's own way from nothing gains nothing certain (p 0.1)."""
    both = hidden(command_delay={"delay_s": 0.1}, motor_lag={"tau_s": 0.14})
    predictor = WheelPredictor(tracks_of(measured(both, trials=20, seed=1, speeds=(-0.2, 0.2), commands=8)))
    effects = listed(NOMINAL, None, predictor.tracks)
    problem = problem_for(predictor, NOMINAL)
    late = fit_with(problem, problem.fit(NOMINAL), effects["command-delay"])
    problem = problem_for(predictor, late.model)
    base = problem.fit(late.model)
    added = fit_with(problem, base, effects["motor-lag"])
    assert added.model.values_of("command-delay")["delay_s"] == pytest.approx(0.1, abs=0.02)
    assert problem.paired_comparison(base, added).p_value < 1e-4


def test_a_threshold_between_two_commands_is_no_luck():
    """A little more or less of it changes nothing, so that it has no tangent where it was found; its way there has."""
    robot = hidden(dead_band={"threshold_m_s": 0.06})
    predictor = WheelPredictor(tracks_of(measured(robot, trials=24, seed=2, commands=3)))
    problem = problem_for(predictor, NOMINAL)
    base = problem.fit(NOMINAL)
    added = fit_with(problem, base, listed(NOMINAL, None, predictor.tracks)["dead-band"])
    assert not added.jacobian.any()
    assert problem.paired_comparison(base, added).p_value < 1e-4


def test_a_number_without_influence_earns_nothing():
    """No wheel turns backwards; what is gained beside it, by a wheelbase that was not at its best, is not its own."""
    predictor = WheelPredictor(tracks_of(measured(NOMINAL, trials=12, seed=1, commands=3)))
    problem = problem_for(predictor, NOMINAL)
    started = NOMINAL.with_effect("wheelbase", factor=1.1)
    base = problem.fit(started, rounds=0)
    added = problem.fit(started.with_effect("reverse-gain", gain=0.9))
    comparison = problem.paired_comparison(base, added)
    assert comparison.elpd_diff > 1
    assert comparison.p_value == 1.0
