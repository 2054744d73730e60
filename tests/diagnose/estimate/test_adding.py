"""What is added to a model: the warnings that go with it, and what earlier calls know."""

from pathlib import Path
from types import SimpleNamespace

import numpy as np

from bns.diagnose.adding import Memory, add_effects, warnings_on
from bns.diagnose.data.load import measured_table
from bns.diagnose.estimate.cross_validation import Judged, judged_errors
from bns.diagnose.estimate.parameters import FreeParameter
from bns.diagnose.estimate.problem import problem_for
from bns.diagnose.estimate.starts import fitting
from bns.diagnose.predict.wheels import WheelPredictor
from bns.diagnose.report import page
from bns.errors import DataError
from bns.physics.effects import effect_named
from tests.diagnose.worlds import NOMINAL, hidden, measured


def test_a_number_at_its_bound_that_changes_nothing_there_is_not_said_to_ask_for_more():
    effect = effect_named("dead-zone")
    number = effect.parameters[0]
    assert number.low == number.neutral
    errors = SimpleNamespace(trials=12, horizons={"1s": SimpleNamespace(models=())})

    def said(value):
        fit = SimpleNamespace(
            free=(FreeParameter("dead-zone", number),),
            values=np.array([value]),
            covariance=np.zeros((1, 1)),
            interval=lambda _: (0.0, 0.002),
        )
        return [one for one in warnings_on(fit, [(effect, {})], errors) if "at its bound" in one]

    assert said(number.low) == []
    assert len(said(number.high)) == 1


def test_a_bound_that_robots_reach_is_not_said_to_hold_the_data_back():
    effect = effect_named("dead-zone-mismatch")
    number = next(p for p in effect.parameters if p.name == "left_share")
    errors = SimpleNamespace(trials=12, horizons={"1s": SimpleNamespace(models=())})
    for value in (number.low, number.high):
        fit = SimpleNamespace(
            free=(FreeParameter(effect.name, number),), values=np.array([value]), interval=lambda _, at=value: (at, at)
        )
        assert not [one for one in warnings_on(fit, [(effect, {})], errors) if "at its bound" in one]


def test_an_effect_of_each_trial_is_fitted_though_the_shared_one_is_known():
    table = measured(hidden(clock_offset={"offset_s": 0.08}), trials=6, seed=3, commands=3)
    data = measured_table(table, Path("log.csv"))
    predictor, effects, memory = WheelPredictor(data.tracks), [(effect_named("clock-offset"), {})], Memory()
    shared = add_effects(predictor, NOMINAL, effects, data, per_trial=False, memory=memory).model
    own = add_effects(predictor, NOMINAL, effects, data, per_trial=True, memory=memory).model
    again = add_effects(predictor, NOMINAL, effects, data, per_trial=False, memory=memory).model
    assert [model.effects[0].per_trial for model in (shared, own, again)] == [False, True, False]
    assert [len(model.effects[0].trial_values) for model in (shared, own, again)] == [0, 6, 0]


def test_the_ladder_of_a_report_ends_in_the_model_and_the_error_of_its_diagnosis(monkeypatch):
    """A fit that is begun elsewhere would end in nearly the same numbers, and one error would be shown with two values."""
    effects = [effect_named(name) for name in ("motor-lag", "wheel-mismatch")]
    world = hidden(motor_lag={"tau_s": 0.15}, wheel_mismatch={"ratio": 1.02})
    data = measured_table(measured(world, trials=10, seed=3, commands=3), Path("log.csv"))
    whole = WheelPredictor(data.tracks)
    predictor = whole.not_counting([2])  # a trial that stands out counts in no fit of the diagnosis, either
    model = NOMINAL
    for effect in effects:
        model = model.with_active(fitting(effect, NOMINAL, predictor.tracks), tuple(world.values_of(effect.name).values()))
    problem = problem_for(predictor, model)
    fit = problem.fit(model, rounds=1)  # not where a longer fit would end
    found = SimpleNamespace(problem=problem, fit=fit, accepted=tuple(e.name for e in effects))
    errors = judged_errors(predictor, problem.pose_filter, NOMINAL, [Judged("with the effects", fit.model, problem.pose_filter)])
    d = SimpleNamespace(selection=found, effects=found.accepted, errors=errors)
    monkeypatch.setattr(page, "compare", lambda *_: None)
    monkeypatch.setattr(page, "shown_paths", lambda *_: [])

    def nothing_to_tell_apart():
        raise DataError("no experiment")

    ladder = page.gathered(data, whole, NOMINAL, d, nothing_to_tell_apart).extended
    assert ladder.names == ("as given", "motor-lag", "wheel-mismatch")
    shown = {horizon: at for horizon, at in ladder.errors.horizons.items() if at.windows}
    assert shown
    for horizon, at in shown.items():
        assert (at.models[0].rms_m, at.models[-1].rms_m) == tuple(m.rms_m for m in errors.horizons[horizon].models)
    assert [a.values for a in ladder.model.effects] == [a.values for a in fit.model.effects]
