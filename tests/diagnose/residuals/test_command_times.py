"""Commands that take effect now sooner, now later: the scatter is measured, said, and not described as a response in time."""

from dataclasses import replace
from functools import partial

import numpy as np
import pandas as pd
import pytest

from bns.diagnose.data.tracks import tracks_of
from bns.diagnose.diagnosing import diagnose
from bns.diagnose.estimate.problem import problem_for
from bns.diagnose.predict.wheels import WheelPredictor
from bns.diagnose.report.text import diagnosis_text
from bns.diagnose.residuals.command_times import FEWEST, _spread, command_times
from bns.physics.formula import formula_effect
from tests.diagnose.worlds import FRAME_S, NOMINAL, hidden, measured

LATEST = 4
"""Frames by which a command may be late."""


def late(table, seed=0, latest=LATEST):
    """The log of a robot that carries out each command up to so many frames after it was sent."""
    rng, parts = np.random.default_rng(seed), []
    for _, rows in table.groupby("trial", sort=False):
        told = rows[["left_m_s", "right_m_s"]].to_numpy().copy()
        for k in np.flatnonzero((np.diff(told, axis=0) != 0).any(axis=1)) + 1:
            told[max(k - int(rng.integers(latest + 1)), 0) : k] = told[k]
        parts.append(rows.assign(left_m_s=told[:, 0], right_m_s=told[:, 1]))
    return pd.concat(parts, ignore_index=True)


def stopping_sooner(tracks):
    """The tracks of a robot with friction: told to stop, it stands the sooner, the slower it was."""
    duration_s = tracks.duration_s.copy()
    for trial, k in np.argwhere((tracks.left_m_s[:, 1:] == 0.0) & (tracks.left_m_s[:, :-1] > 0.0)):
        sooner_s = min(0.003 / tracks.left_m_s[trial, k], 0.1)
        duration_s[trial, k : k + 2] += sooner_s, -sooner_s
    return replace(tracks, duration_s=duration_s)


def late_where_large(tracks, beyond_m_s, late_s):
    """The tracks of a robot that carries out a change of command late where both wheels together change by more."""
    duration_s = tracks.duration_s.copy()
    by = np.abs(np.diff(tracks.left_m_s, axis=1)) + np.abs(np.diff(tracks.right_m_s, axis=1))
    for trial, k in np.argwhere(by > beyond_m_s):
        if duration_s[trial, k] > 2 * late_s:
            duration_s[trial, k : k + 2] += -late_s, late_s
    return replace(tracks, duration_s=duration_s)


def a_few_sooner(tracks, sooner_s):
    """The tracks of a robot that carries out every seventh change of command sooner than the log says."""
    duration_s = tracks.duration_s.copy()
    for trial, k in np.argwhere(np.diff(tracks.left_m_s, axis=1) != 0)[::7]:
        duration_s[trial, k : k + 2] += sooner_s, -sooner_s
    return replace(tracks, duration_s=duration_s)


def times_in(table, model=NOMINAL, as_logged=lambda tracks: tracks):
    predictor = WheelPredictor(as_logged(tracks_of(table)))
    problem = problem_for(predictor, model)
    return command_times(problem, problem.fit(model))


@pytest.fixture(scope="module")
def table():
    return measured(NOMINAL, trials=30, seed=3, speeds=(-0.2, 0.2), commands=8)


def test_the_scatter_is_that_of_the_delays(table):
    found = times_in(late(table), hidden(command_delay={"delay_s": LATEST * FRAME_S / 2}))
    spread_s = FRAME_S * np.sqrt(((LATEST + 1) ** 2 - 1) / 12)
    assert found.sd_s == pytest.approx(spread_s, rel=0.12)
    assert found.high_s - found.low_s == pytest.approx(LATEST * FRAME_S, rel=0.15)
    assert f"standard deviation {1e3 * found.sd_s:.0f} ms" in found.in_words


@pytest.mark.parametrize("sooner_s", [0.05, 0.11, -0.08])
def test_a_few_that_are_sooner_are_so_by_as_much(sooner_s):
    """Poses from before a command is logged say how much sooner it acted: without them, any early time fits."""
    exact = measured(NOMINAL, trials=30, seed=3, speeds=(-0.2, 0.2), commands=8, noise=(0.0005, 0.002), jitter=0.0)
    found = times_in(exact, as_logged=partial(a_few_sooner, sooner_s=sooner_s))
    assert (-found.low_s if sooner_s > 0 else found.high_s) == pytest.approx(abs(sooner_s), rel=0.1)
    assert found.high_s - found.low_s == pytest.approx(abs(sooner_s), rel=0.1)
    assert found.sd_s == pytest.approx(abs(sooner_s) * np.sqrt(6) / 7, rel=0.1)


def test_times_at_the_end_of_what_is_tried_do_not_count(monkeypatch, table):
    """Two of five are farther off."""
    monkeypatch.setattr("bns.diagnose.residuals.command_times.FARTHEST_S", 0.06)
    found = times_in(late(table), hidden(command_delay={"delay_s": LATEST * FRAME_S / 2}))
    assert -0.05 < found.low_s < found.high_s < 0.05
    monkeypatch.undo()
    every = times_in(late(table), hidden(command_delay={"delay_s": LATEST * FRAME_S / 2}))
    assert found.commands == pytest.approx(every.commands * 3 / 5, rel=0.15)


def test_what_errors_of_tracking_add_is_taken_out():
    rng = np.random.default_rng(0)
    true_s, error_s = rng.uniform(-0.05, 0.05, 2000), np.repeat([0.002, 0.04], 1000)
    sd_s, low_s, high_s = _spread(true_s + error_s * rng.normal(size=2000), error_s)
    assert sd_s == pytest.approx(true_s.std(), rel=0.05)
    assert (low_s, high_s) == pytest.approx(np.quantile(true_s, [0.05, 0.95]), rel=0.1)
    assert _spread(error_s[:1000] * rng.normal(size=1000), 2 * error_s[:1000]) == (0.0, 0.0, 0.0)


def test_stops_of_a_robot_with_friction_are_no_scatter(monkeypatch):
    """Not even at a sixth of what is asked of scatter."""
    monkeypatch.setattr("bns.diagnose.residuals.command_times.TIMES_USUAL", 1.0)
    table = measured(NOMINAL, trials=30, seed=3, speeds=(0.02, 0.2), commands=8, pauses=True, straight=1.0)
    assert times_in(table, as_logged=stopping_sooner) is None
    assert times_in(late(table), hidden(command_delay={"delay_s": LATEST * FRAME_S / 2})) is not None


@pytest.mark.parametrize(("beyond_m_s", "late_s"), [(0.4, 0.12), (0.35, 0.2)])
def test_large_changes_that_are_late_are_no_scatter(monkeypatch, table, beyond_m_s, late_s):
    """Without a look at the sizes of the changes, they would be."""
    robot = partial(late_where_large, beyond_m_s=beyond_m_s, late_s=late_s)
    assert times_in(table, as_logged=robot) is None
    monkeypatch.setattr("bns.diagnose.residuals.command_times.ALIKE", -np.inf)
    assert times_in(table, as_logged=robot) is not None


@pytest.mark.parametrize(
    "robot",
    [
        NOMINAL,
        hidden(command_delay={"delay_s": 0.1}),
        hidden(motor_lag={"tau_s": 0.15}),
        hidden(acceleration_limit={"max_m_s2": 0.4}),
        hidden(backlash={"gap_m": 0.004}),
        NOMINAL.with_active(formula_effect("slow-left", "k * (ago(0, 0.2) - u)", "left"), (1.0,)),
        NOMINAL.with_active(formula_effect("slow-turns", "k * (ago(0, 0.3) - w)", "w"), (1.0,)),
        hidden(wheelbase={"factor": 1.1}, speed_gain={"gain": 0.93}),
    ],
    ids=lambda robot: "+".join(a.effect.name for a in robot.effects) or "nothing",
)
def test_other_faults_are_no_scatter(robot):
    """Nothing of them is in the model: a delay makes all commands late alike, a limit the large changes most."""
    assert times_in(measured(robot, trials=30, seed=3, speeds=(-0.2, 0.2), commands=8)) is None


def test_trials_that_count_nothing_have_no_say(table):
    predictor = WheelPredictor(tracks_of(late(table)))
    model = hidden(command_delay={"delay_s": LATEST * FRAME_S / 2})
    without = predictor.not_counting(range(5))
    problem = problem_for(without, model)
    found = command_times(problem, problem.fit(model))
    every = times_in(late(table), model)
    assert found.commands == pytest.approx(every.commands * 25 / 30, rel=0.1)
    assert found.sd_s == pytest.approx(every.sd_s, rel=0.2)


def test_few_changes_of_command_say_nothing(table):
    few = late(table[table.trial < FEWEST // 12])
    assert times_in(few) is None


@pytest.mark.slow
def test_it_is_said_and_no_response_in_time_is_offered_for_it(table):
    found = diagnose(WheelPredictor(tracks_of(late(table))), NOMINAL)
    assert found.verdict == "unlisted"
    assert found.behaviour[0].startswith("commands take effect at times that scatter")
    assert not any("response" in term.signal or "changes of speed" in term.signal for term in found.terms)
    assert any(note.startswith("No model predicts when a single command takes effect") for note in found.notes)
    assert found.as_json()["command_times"]["sd_s"] == found.rest.command_times.sd_s
    assert "commands take effect at times that scatter" in diagnosis_text(found)
    plain = replace(found, rest=replace(found.rest, command_times=None))
    assert plain.as_json()["command_times"] is None
    assert plain.behaviour == found.behaviour[1:]
