"""Delays of single commands that follow the place, a speed or the time are said to do so, and are no scatter."""

import re

import numpy as np
import pandas as pd
import pytest

from bns.diagnose.data.tracks import tracks_of
from bns.diagnose.estimate.problem import problem_for
from bns.diagnose.predict.wheels import WheelPredictor
from bns.diagnose.residuals import delays_follow
from bns.diagnose.residuals.command_times import CommandTimes, command_times
from bns.diagnose.residuals.delays_follow import Changes, DelayRule, delay_rule
from tests.diagnose.worlds import BASE_M, FRAME_S, NOMINAL, hidden, measured

NOISE_S = 0.005


@pytest.fixture(scope="module")
def table():
    whole = measured(NOMINAL, trials=30, seed=3, speeds=(-0.2, 0.2), commands=8)
    return whole.assign(session_s=whole.trial * 60.0 + whole.t_s, battery_v=8.0 - 0.001 * np.arange(len(whole)) % 0.7)


def changes_of(tracks):
    """Every change of command of tracks, and the frame in which it is seen first."""
    ends = np.cumsum(tracks.duration_s, axis=1)
    rows = []
    for trial in range(len(tracks)):
        t_s = tracks.t_s[tracks.first[trial] : tracks.first[trial + 1]]
        for k in range(ends.shape[1] - 1):
            if tracks.duration_s[trial, k + 1] > 0.0 and ends[trial, k] < t_s[-1]:
                rows.append((trial, k, tracks.first[trial] + np.searchsorted(t_s, ends[trial, k] - 1e-6)))
    return Changes(*np.array(rows).T)


def rule_of(table, late_s, seed=0, noise_s=NOISE_S):
    """The rule that is found in delays ``late_s(tracks, changes)`` with noise."""
    tracks = tracks_of(table)
    changes = changes_of(tracks)
    noise = noise_s * np.random.default_rng(seed).normal(size=len(changes.frame))
    return delay_rule(tracks, BASE_M, changes, late_s(tracks, changes) + noise)


def of_numbers(words):
    """The first time in a clause, ms, and the clause without it."""
    by_ms = re.search(r"([\d.]+) ms", words).group(1)
    return float(by_ms), words.replace(f"{by_ms} ms", "# ms", 1)


def speeds(tracks, changes, after):
    at = changes.trial, changes.command + after
    return tracks.left_m_s[at], tracks.right_m_s[at]


RULES = {
    "x_m": (lambda t, c: 0.08 * t.pose[c.frame, 0], 0.08, "where the robot is: # ms later for each metre in x"),
    "y_m": (lambda t, c: -0.08 * t.pose[c.frame, 1], -0.08, "where the robot is: # ms earlier for each metre in y"),
    "speed_before_m_s": (
        lambda t, c: 0.4 * np.mean(speeds(t, c, 0), axis=0),
        0.4,
        "the speed that was commanded before: # ms later for each m/s",
    ),
    "speed_after_m_s": (
        lambda t, c: 0.4 * np.mean(speeds(t, c, 1), axis=0),
        0.4,
        "the speed that is commanded: # ms later for each m/s",
    ),
    "turn_before_rad_s": (
        lambda t, c: -0.02 * np.diff(speeds(t, c, 0), axis=0)[0] / BASE_M,
        -0.02,
        "the turn rate that was commanded before: # ms earlier for each rad/s",
    ),
    "turn_after_rad_s": (
        lambda t, c: 0.02 * np.diff(speeds(t, c, 1), axis=0)[0] / BASE_M,
        0.02,
        "the turn rate that is commanded: # ms later for each rad/s",
    ),
    "fast_before_m_s": (
        lambda t, c: 0.8 * np.abs(np.mean(speeds(t, c, 0), axis=0)),
        0.8,
        "how fast the robot was told to drive before, ahead or back: # ms later for each m/s",
    ),
    "fast_after_m_s": (
        lambda t, c: 0.8 * np.abs(np.mean(speeds(t, c, 1), axis=0)),
        0.8,
        "how fast the robot is told to drive, ahead or back: # ms later for each m/s",
    ),
    "session_s": (
        lambda t, c: 5e-5 * (60.0 * c.trial + t.t_s[c.frame]),
        5e-5,
        "the time in the session: # ms later for each minute",
    ),
    "time_in_trial_s": (lambda t, c: 0.02 * t.t_s[c.frame], 0.02, "the time in the trial: # ms later for each second"),
    "battery_v": (lambda t, c: -0.1 * t.extra["battery_v"][c.frame], -0.1, "battery_v: # ms earlier for each unit of it"),
}


@pytest.mark.parametrize("variable", RULES)
def test_what_the_delays_follow_is_found_and_said(table, variable):
    late_s, slope, words = RULES[variable]
    found = rule_of(table, late_s)
    assert found.variable == variable
    assert found.later_s[0] == pytest.approx(slope, rel=0.05)
    assert found.left_s == pytest.approx(NOISE_S, rel=0.15)
    by_ms, said = of_numbers(found.in_words)
    assert said.startswith(f"commands take effect at times that depend on {words} (correlation ")
    assert by_ms == pytest.approx(1e3 * abs(slope) * (60.0 if variable == "session_s" else 1.0), rel=0.06)
    assert np.sign(slope) * found.correlation > 0.9
    assert f"correlation {found.correlation:.2f}; what is left scatters by " in found.in_words
    assert found.of_place == (variable in {"x_m", "y_m"})
    assert ("row by row" in found.in_words) == found.of_place


def test_a_camera_that_hangs_askew_reads_along_both_directions(table):
    found = rule_of(table, lambda t, c: 0.08 * t.pose[c.frame, 0] + 0.06 * t.pose[c.frame, 1])
    assert found.variable == "place"
    assert found.of_place
    assert found.later_s == pytest.approx((0.08, 0.06), rel=0.05)
    by_ms, said = of_numbers(found.in_words)
    assert by_ms == pytest.approx(100.0, rel=0.05)
    assert re.search(r"where the robot is: # ms later for each metre towards 3[678]° from the x axis", said)
    assert found.in_words.endswith("as if the camera read its picture row by row")


def test_delays_that_follow_the_heading_are_said_to_be_latest_at_one(table):
    found = rule_of(table, lambda t, c: 0.05 * np.cos(t.pose[c.frame, 2] - 1.0))
    assert found.variable == "heading_rad"
    assert re.search(r"the robot's heading: latest at 5[678]°, (49|50|51) ms later there than on average", found.in_words)


@pytest.mark.parametrize("seed", range(10))
def test_delays_at_random_follow_nothing(table, seed):
    assert rule_of(table, lambda *_: 0.0, seed, 0.04) is None


def test_delays_of_which_the_place_makes_the_smaller_part_are_scatter(table):
    assert rule_of(table, lambda t, c: 0.08 * t.pose[c.frame, 1], noise_s=0.04) is None


def test_few_trials_may_pull_the_same_way_by_chance(table, monkeypatch):
    few = table[table.trial < 5]
    assert rule_of(few, RULES["y_m"][0]) is None
    monkeypatch.setattr(delays_follow, "CHANCE", np.inf)
    assert rule_of(few, RULES["y_m"][0]).variable == "y_m"


def test_single_delays_that_are_far_off_do_not_hide_the_rule(table, monkeypatch):
    def wild(tracks, changes):
        far = np.arange(len(changes.frame)) % 40 == 7
        return np.where(far, 0.3, RULES["y_m"][0](tracks, changes))

    assert rule_of(table, wild).later_s == pytest.approx((-0.08,), rel=0.1)
    monkeypatch.setattr(delays_follow, "FAR", np.inf)
    assert rule_of(table, wild) is None


def test_a_column_with_gaps_and_one_that_never_changes_do_no_harm(table):
    some = table.assign(battery_v=table.battery_v.where(table.index % 3 > 0), still=1.0)
    assert rule_of(some, RULES["y_m"][0]).variable == "y_m"


def shuttered(table, s_per_m):
    """The log of a camera that reads row by row: each command seems to take effect a time later that grows with y.

    The commands are told as much before, by whole frames.
    """
    parts = []
    for _, rows in table.groupby("trial", sort=False):
        told, y_m = rows[["left_m_s", "right_m_s"]].to_numpy().copy(), rows.y_m.to_numpy()
        for k in np.flatnonzero((np.diff(told, axis=0) != 0).any(axis=1)) + 1:
            told[max(k - round((0.08 + s_per_m * y_m[k]) / FRAME_S), 0) : k] = told[k]
        parts.append(rows.assign(left_m_s=told[:, 0], right_m_s=told[:, 1]))
    return pd.concat(parts, ignore_index=True)


def test_a_log_of_a_camera_that_reads_row_by_row(table):
    model = hidden(command_delay={"delay_s": 0.08})
    problem = problem_for(WheelPredictor(tracks_of(shuttered(table, 0.15))), model)
    found = command_times(problem, problem.fit(model))
    assert found.rule.variable == "y_m"
    assert found.rule.later_s[0] == pytest.approx(0.15, rel=0.15)
    assert found.rule.correlation > 0.9
    assert found.in_words == found.rule.in_words


@pytest.mark.parametrize(
    ("variable", "said", "never"),
    [
        (None, "No model predicts when a single command takes effect", "camera"),
        ("y_m", "a camera that reads its rows one after another", "No model predicts"),
        ("speed_after_m_s", "A lag, a late command or a late clock", "No model predicts"),
    ],
)
def test_the_note_fits_what_was_found(variable, said, never):
    rule = None if variable is None else DelayRule(variable, (0.1,), 0.9, 0.01)
    found = CommandTimes(0.03, -0.05, 0.05, 100, rule)
    assert said in found.note
    assert never not in found.note
    assert ("packets" in found.in_words) == (rule is None)
