"""Where the fit with one effect more begins, and when it is not made."""

from dataclasses import replace

import pytest

from bns.diagnose.data.tracks import tracks_of
from bns.diagnose.estimate.problem import settled_problem
from bns.diagnose.estimate.starts import _starts, best_start, fit_with, listed
from bns.diagnose.predict.wheels import WheelPredictor
from tests.diagnose.worlds import NOMINAL, hidden, measured


def fitted(robot, started, **kind):
    """Problem, fit of a model that is not the robot's, and the effects."""
    predictor = WheelPredictor(tracks_of(measured(robot, seed=1, **kind)))
    return *settled_problem(predictor, started, None), listed(NOMINAL, None, predictor.tracks)


def test_an_effect_is_fitted_though_others_do_by_now_what_it_does():
    """Friction of the right wheel alone, described as friction in both gears and unlike wheels: no start is better at first."""
    robot = hidden(
        dead_zone_mismatch={"width_m_s": 0.008, "left_share": 0.0}, inertia_lag={"tau_s": 0.06, "turn_ratio": 0.42}
    )
    imitated = hidden(
        wheel_mismatch={"ratio": 0.95},
        gear_friction={"tau_s": 0.06, "turn_ratio": 0.42, "friction_m_s": 0.003, "loss_m_s": 0.008},
    )
    problem, base, effects = fitted(robot, imitated, trials=16, commands=6, speeds=(-0.2, 0.2))
    start = best_start(problem, base, effects["dead-zone-mismatch"])
    assert start.loss >= base.loss * (1 - 1e-12)  # rounding: the sums of two fits of the same numbers
    assert base.loss > start.promised + 10
    added = fit_with(problem, base, effects["dead-zone-mismatch"])
    least = problem.fit(robot).loss
    assert added.loss - least < 0.1 * (base.loss - least)
    assert added.model.values_of("dead-zone-mismatch")["left_share"] == pytest.approx(0.0, abs=0.01)


def test_an_effect_that_promises_nothing_is_not_fitted():
    problem, base, effects = fitted(NOMINAL, hidden(wheelbase={"factor": 1.0}), trials=12)
    start = best_start(problem, base, effects["motor-lag"])
    assert min(start.loss, start.promised) > base.loss - 1
    added = fit_with(problem, base, effects["motor-lag"])
    assert added.model == start.model


def of_the_package(starts):
    """A `starts_from`; what one of a user's returns is looked at before."""

    def found(_wheels):
        return starts

    found.__module__ = "bns.physics.effects.told"
    return found


def test_starts_that_an_effect_proposes_are_held_within_its_bounds():
    """As those of a patch of floor on a map are; what is no number is dropped."""
    problem, base, effects = fitted(NOMINAL, hidden(wheelbase={"factor": 1.0}), trials=4)
    patch = effects["uneven-patch"]
    given = problem.predictor
    neutral = tuple(patch.neutral.values())
    low, high = ([getattr(p, end) for p in patch.parameters] for end in ("low", "high"))
    for proposed, used in (
        ((tuple(2 * v + 1 for v in high), tuple(2 * v - 1 for v in low)), [tuple(high), tuple(low)]),
        (((float("nan"), *neutral[1:]), neutral), [neutral]),
        (((float("nan"), *neutral[1:]),), [neutral]),
    ):
        told = replace(patch, name=f"told-{len(proposed)}-{proposed[0][0]}", starts_from=of_the_package(proposed))
        assert list(_starts(told, given, base.model)) == used
        for values in _starts(told, given, base.model):
            base.model.with_active(told, values)
