"""What is in force when: after the last row, its command goes on; where that row has none, the robot stands."""

from dataclasses import replace

import numpy as np
import pandas as pd
import pytest

from bns.diagnose.data.tracks import tracks_of
from bns.diagnose.predict import wheels
from bns.diagnose.predict.wheels import WheelPredictor, _chain
from bns.physics.effects import effect_named
from bns.physics.formula import formula_effect
from bns.physics.model import ActiveEffect
from tests.diagnose.worlds import NOMINAL, hidden, measured


def trial(name, left_m_s, step_s=0.5):
    """One row a command, the robot anywhere."""
    t = step_s * np.arange(len(left_m_s))
    rows = {"trial": name, "t_s": t, "left_m_s": left_m_s, "right_m_s": left_m_s}
    return pd.DataFrame(rows | {"x_m": 0.1 * t, "y_m": 0.0, "heading_rad": 0.0})


@pytest.mark.parametrize(
    ("left_m_s", "after_m_s"), [([0.1, 0.05, np.nan], 0.0), ([0.1, 0.05, 0.05], 0.05), ([0.1, 0.05, -0.08], -0.08)]
)
def test_what_the_last_row_says_is_in_force_after_it(left_m_s, after_m_s):
    longer = trial("longer", [0.02] * 6)  # its commands must not run into the shorter trial's
    grid = WheelPredictor(tracks_of(pd.concat([trial("short", left_m_s), longer], ignore_index=True))).grid
    middle = (grid.node_s[0, 1:] + grid.node_s[0, :-1]) / 2
    lasting = grid.step_s[0] > 0
    assert set(grid.left_m_s[0][lasting & (middle < 0.5)]) == {0.1}
    assert set(grid.left_m_s[0][lasting & (middle > 0.5) & (middle < 1.0)]) == {0.05}
    assert set(grid.left_m_s[0][lasting & (middle > 1.0)]) == {after_m_s}
    assert (grid.left_m_s[1][grid.step_s[1] > 0] == 0.02).all()


def asked_about():
    """Models that differ in one stage each, and a wheelbase."""
    model = NOMINAL.with_effect("speed-gain", gain=0.9).with_effect("clock-offset", offset_s=-0.04)
    clocks = replace(model, effects=tuple(replace(a, per_trial=a.effect.name == "clock-offset") for a in model.effects))
    return [
        model,
        model.with_effect("camera-scale", factor=1.1),
        model.with_effect("marker-offset", forward_m=0.02, left_m=-0.01),
        model.with_effect("clock-offset", offset_s=0.06),
        model.with_effect("heading-delay", delay_s=0.06),
        clocks.with_trial_values([0.02, -0.05, 0.1]),
        clocks.with_trial_values([0.02, 0.05, 0.1]),
        model.with_effect("side-slip", slip_s=0.1),
        model.with_effect("speed-gain", gain=1.1),
        replace(model, wheelbase_m=2 * model.wheelbase_m),
        model.with_effect("floor-slope", x_m_s=0.003, y_m_s=0.0),
        model.with_active(formula_effect("own", "k * v * abs(w)", "v"), (0.3,)),
        model.with_active(formula_effect("own", "k * abs(w)", "v"), (0.3,)),
    ]


def test_a_predictor_that_remembers_answers_as_a_new_one():
    tracks = tracks_of(measured(NOMINAL, trials=3, seed=4))
    models, asked = asked_about(), WheelPredictor(tracks)
    fresh = [WheelPredictor(tracks).steps(model) for model in models]
    assert len({f.body.tobytes() + f.drift_m.tobytes() for f in fresh}) == len(models)
    for _ in range(2):
        for model, expected in zip(models, fresh, strict=True):
            steps = asked.steps(model)
            np.testing.assert_array_equal(steps.body, expected.body)
            np.testing.assert_array_equal(steps.drift_m, expected.drift_m)


def counted(monkeypatch, name):
    """Calls of a function of the predictor's."""
    calls, real = [], getattr(wheels, name)
    monkeypatch.setattr(wheels, name, lambda *given: calls.append(given) or real(*given))
    return calls


def test_what_a_camera_does_is_worked_out_without_driving_again(monkeypatch):
    drives = counted(monkeypatch, "with_body_effects")
    predictor = WheelPredictor(tracks_of(measured(NOMINAL, trials=3, seed=4)))
    model = NOMINAL.with_effect("camera-scale", factor=1.1).with_effect("clock-offset", offset_s=0.0)
    for seen in (model, model.with_effect("camera-scale", factor=1.2), model.with_effect("clock-offset", offset_s=0.1)):
        predictor.steps(seen)
    assert len(drives) == 1
    predictor.steps(model.with_effect("wheelbase", factor=1.1))
    assert len(drives) == 2


def test_what_the_body_does_is_worked_out_without_turning_the_wheels_again(monkeypatch):
    turns = counted(monkeypatch, "wheel_motion")
    predictor = WheelPredictor(tracks_of(measured(NOMINAL, trials=3, seed=4)))
    model = NOMINAL.with_effect("motor-lag", tau_s=0.1)
    for slipping in (model, model.with_effect("side-slip", slip_s=0.1), model.with_effect("turn-slip", slip_s=0.1)):
        predictor.steps(slipping)
    assert len(turns) == 1
    predictor.steps(model.with_effect("motor-lag", tau_s=0.2))
    assert len(turns) == 2


LATE_AND_LAGGING = {"command-delay": {"delay_s": 0.077}, "motor-lag": {"tau_s": 0.08}, "backlash": {"gap_m": 0.002}}


@pytest.mark.parametrize("order", [("command-delay", "motor-lag", "backlash"), ("motor-lag", "command-delay", "backlash")])
def test_a_delay_acts_behind_lags_and_play_wherever_a_model_has_it(order):
    effects = [effect_named(name) for name in order]
    model = replace(NOMINAL, effects=tuple(ActiveEffect(e, tuple(LATE_AND_LAGGING[e.name].values())) for e in effects))
    names = [[effect.name for effect, *_ in _chain(one, ("wheel",))] for one in (model, model.without("motor-lag"))]
    assert names == [["motor-lag", "backlash", "command-delay"], ["backlash", "command-delay"]]
    assert [effect.name for effect, *_ in _chain(model.without("backlash"), ("wheel",))] == ["motor-lag", "command-delay"]


@pytest.mark.parametrize("beside", [{"motor_lag": {"tau_s": 0.08}}, {"backlash": {"gap_m": 0.004}}])
def test_a_late_command_and_a_late_clock_are_alike_in_long_steps(beside):
    tracks = tracks_of(measured(NOMINAL, trials=3, seed=5, speeds=(-0.2, 0.2)))
    predictor = WheelPredictor(tracks, dt_s=0.1)
    lagging = hidden(**beside)
    late, clock = lagging.with_effect("command-delay", delay_s=0.077), lagging.with_effect("clock-offset", offset_s=0.077)
    apart = predictor.steps(late.arranged()).body - predictor.steps(clock.arranged()).body
    changed = predictor.steps(late.arranged()).body - predictor.steps(lagging).body
    assert np.abs(apart).max() < 0.03 * np.abs(changed).max()


@pytest.mark.parametrize("delay_s", [0.06, -0.1])
def test_late_headings_are_predicted_as_the_simulation_sees_them(delay_s):
    model = NOMINAL.with_effect("heading-delay", delay_s=delay_s)
    tracks = tracks_of(measured(model, trials=3, seed=4, noise=(0.0, 0.0), jitter=0.0))
    seen, predictor = wheels.displacements(tracks.pose, tracks.is_first), WheelPredictor(tracks)
    away = np.abs(predictor.steps(model).body - seen).max(axis=0)
    assert (away < [1e-4, 1e-4, 3e-3]).all()
    other = np.abs(predictor.steps(NOMINAL.with_effect("heading-delay", delay_s=-delay_s)).body - seen).max(axis=0)
    assert (other[1:] > [5e-4, 3e-2]).all()  # forwards, the sign of an angle hardly matters
