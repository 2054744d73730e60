"""What is left is seen: moments that stand out, what follows an event, what brakes the robot whichever way it goes."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pandas as pd
import pytest

from bns.diagnose.data.tracks import tracks_of
from bns.diagnose.diagnosing import diagnose
from bns.diagnose.diagnosis import Diagnosis
from bns.diagnose.estimate.problem import problem_for
from bns.diagnose.estimate.significance import PairedComparison
from bns.diagnose.predict.wheels import RECENT_S, WheelPredictor
from bns.diagnose.residuals import unexplained as rest_module
from bns.diagnose.residuals.along_variables import SHARE, ResidualDependence, probe_effect, significant_dependence
from bns.diagnose.residuals.autocorrelation import Autocorrelation, _moves, _period
from bns.diagnose.residuals.outliers import FAR, TRIALS, WIDTH, _windows, moment_at, outliers
from bns.diagnose.residuals.unexplained import NOTHING, Unexplained, unexplained
from bns.physics.jointed.mechanism import Mechanism
from bns.physics.jointed.model_files import load_body
from tests.diagnose.worlds import FRAME_S, NOMINAL, measured
from tests.jointed.arm import xml

SNAKE = load_body("snake")

KICK_S, KICK_RAD = 1.6, 0.15


def kicked(table, trials):
    """From `KICK_S` on these trials go on as if the robot had been turned on the spot."""
    table = table.copy()
    for trial in trials:
        after = (table.trial == trial) & (table.t_s > KICK_S)
        x, y = table.loc[after, "x_m"], table.loc[after, "y_m"]
        x0, y0 = x.iloc[0], y.iloc[0]
        cos, sin = np.cos(KICK_RAD), np.sin(KICK_RAD)
        table.loc[after, "x_m"] = x0 + cos * (x - x0) - sin * (y - y0)
        table.loc[after, "y_m"] = y0 + sin * (x - x0) + cos * (y - y0)
        table.loc[after, "heading_rad"] += KICK_RAD
    return table


def resting(table, lasting_s=3.0):
    """After every trial the robot is told to stand, and is watched."""
    n = round(lasting_s / FRAME_S)
    rests = table.groupby("trial").tail(1)
    rests = rests.loc[rests.index.repeat(n)].assign(left_m_s=0.0, right_m_s=0.0)
    rests["t_s"] += FRAME_S * (1 + rests.groupby("trial").cumcount())
    return pd.concat([table, rests]).sort_values(["trial", "t_s"], ignore_index=True).ffill()


def with_memory(table, memory=0.9, seed=1):
    """Frames share errors of the tracker: of 1.5 mm and 15 mrad, as under filters that smooth poses."""
    rng, off = np.random.default_rng(seed), np.zeros((len(table), 3))
    fresh = rng.standard_normal(off.shape) * np.sqrt(1 - memory**2)
    for k in range(1, len(off)):
        off[k] = memory * off[k - 1] + fresh[k]
    x_m, y_m, heading_rad = (np.array([0.0015, 0.0015, 0.015]) * off).T
    return table.assign(x_m=table.x_m + x_m, y_m=table.y_m + y_m, heading_rad=table.heading_rad + heading_rad)


def found_in(table):
    predictor = WheelPredictor(tracks_of(table))
    problem = problem_for(predictor, NOMINAL)
    return outliers(problem, problem.fit(NOMINAL))


@pytest.mark.parametrize("seed", range(6))
def test_honest_scatter_does_not_stand_out(seed):
    assert found_in(measured(NOMINAL, seed=seed, jitter=0.008)) == []


def test_lost_and_mistaken_markers_do_not_stand_out():
    table = measured(NOMINAL, trials=30, seed=4)
    rng = np.random.default_rng(0)
    hit = rng.random(len(table)) < 0.01
    table.loc[hit, ["x_m", "y_m"]] += rng.uniform(-0.3, 0.3, (hit.sum(), 2))
    table = table.drop(index=rng.choice(len(table), 60, replace=False))
    assert found_in(table) == []


def test_a_tracker_whose_errors_have_a_memory_stands_out_nowhere_though_the_robot_stands():
    """A filter that takes errors for independent is surest of a robot that stands, and wrong for many frames on end."""
    assert found_in(with_memory(resting(measured(NOMINAL, trials=30, seed=5, noise=(1e-5, 1e-5))))) == []


@pytest.mark.parametrize("frames", [3, 6, 14])
def test_a_marker_that_is_mistaken_for_some_frames_does_not_stand_out(frames):
    table = measured(NOMINAL, trials=20, seed=3, commands=8)
    for trial in range(0, 20, 3):
        rows = table.index[table.trial == trial][30 + trial :][:frames]
        table.loc[rows, ["x_m", "y_m"]] += [0.11, -0.07]
    assert found_in(table) == []


def test_trials_with_a_kick_are_named_with_the_moment():
    trials = [2, 5, 6, 11]
    found = found_in(kicked(measured(NOMINAL, seed=3), trials))
    assert {int(o.trial) for o in found} == set(trials)
    assert all(abs(o.t_s - KICK_S) <= (WIDTH + 1) * FRAME_S and o.size > FAR for o in found)
    assert [o.size for o in found] == sorted((o.size for o in found), reverse=True)


def test_a_kick_or_two_say_nothing_of_the_model():
    assert found_in(kicked(measured(NOMINAL, seed=3), range(TRIALS - 1))) == []


def test_poses_at_commands_ends_have_no_moments():
    assert found_in(measured(NOMINAL, seed=3, ends_only=True)) == []


@pytest.mark.slow
def test_a_diagnosis_says_where_to_look():
    table = kicked(measured(NOMINAL, trials=20, seed=3), [1, 8, 9, 15])
    found = diagnose(WheelPredictor(tracks_of(table)), NOMINAL)
    assert found.verdict == "unlisted"
    assert {o["trial"] for o in found.as_json()["outliers"]} == {"1", "8", "9", "15"}
    assert any(note.startswith("4 of 20 trials have moments with more than 6 times") for note in found.notes)


def test_windows_reach_to_the_last_frame_where_they_fit():
    first = np.cumsum([0, 1 + 2 * WIDTH, 2 * WIDTH, 1 + WIDTH, 1, 2])
    assert _windows(first).tolist() == [1, 1 + WIDTH, first[1] + 1, first[2] + 1]


def largest(table):
    predictor = WheelPredictor(tracks_of(table))
    problem = problem_for(predictor, NOMINAL)
    return unexplained(problem, problem.fit(NOMINAL), ()).autocorrelation


@pytest.mark.parametrize(
    ("body", "period_s", "counts"), [("snake", None, False), ("snake", 0.4, True), ("arm", None, True), ("wheels", None, True)]
)
def test_what_only_drifts_on_counts_where_no_floor_makes_it(body, period_s, counts, monkeypatch):
    """A body on a floor touches it a little otherwise each time, and goes on otherwise."""
    model = {
        "snake": SNAKE,
        "arm": replace(SNAKE, name="arm", mechanism=Mechanism(xml(), ("elbow", "hand"))),
        "wheels": NOMINAL,
    }[body]
    alike = Autocorrelation("heading", "within", 3, 0.33, 9.0, period_s)
    monkeypatch.setattr(rest_module, "autocorrelations", lambda *_: [alike])
    monkeypatch.setattr(rest_module, "_moments", lambda *_: ((), None, None))
    monkeypatch.setattr(rest_module, "command_times", lambda *_: None)
    rest = unexplained(None, SimpleNamespace(model=model), ())
    assert rest.any is counts
    assert rest.autocorrelation is (alike if counts else None)


@pytest.mark.parametrize("jitter", [0.002, 0.02])
def test_motors_that_vary_have_no_rhythm(jitter):
    assert largest(measured(NOMINAL, trials=30, seed=2, jitter=jitter)) is None


@pytest.mark.parametrize("period_s", [0.4, 1.5])
def test_a_heading_that_swings_with_a_period_has_a_rhythm(period_s):
    table = measured(NOMINAL, trials=30, seed=2)
    phase = 2 * np.pi * (table.t_s + 0.37 * table.trial) / period_s
    autocorrelation = largest(table.assign(heading_rad=table.heading_rad + 0.02 * np.sin(phase)))
    assert (autocorrelation.direction, autocorrelation.scale) == ("heading", "within")
    if period_s < 1.0:  # most commands are over before the longer one is
        assert autocorrelation.period_s == pytest.approx(period_s, rel=0.05)
        assert "in heading swings to and fro with a period of about 0.4 s, 2.5 Hz" in autocorrelation.in_words


def steered(table):
    """The same robot by a driver who gives a command a frame."""
    return table.assign(left_m_s=table.left_m_s + 1e-6 * (np.arange(len(table)) % 2))


@pytest.mark.parametrize("jitter", [0.002, 0.02])
def test_motors_that_vary_have_no_rhythm_where_somebody_steers_all_the_time(jitter):
    assert largest(steered(measured(NOMINAL, trials=30, seed=2, jitter=jitter))) is None


@pytest.mark.parametrize("period_s", [0.4, 1.25])
def test_a_heading_that_swings_has_a_rhythm_where_somebody_steers_all_the_time(period_s):
    """No command lasts long enough to see it."""
    table = steered(measured(NOMINAL, trials=30, seed=2))
    phase = 2 * np.pi * (table.t_s + 0.37 * table.trial) / period_s
    found = largest(table.assign(heading_rad=table.heading_rad + 0.02 * np.sin(phase)))
    assert (found.direction, found.scale) == ("heading", "within")
    assert found.period_s == pytest.approx(period_s, rel=0.05)
    assert Diagnosis("unlisted", None, rest=Unexplained((), found, ())).behaviour == (found.clause,)
    period = f"{found.period_s:.2g} s, {1 / found.period_s:.2g} Hz"
    assert found.clause == f"the motion in heading swings to and fro with a period of about {period}"
    assert Diagnosis("unlisted", None, rest=Unexplained((), replace(found, period_s=None), ())).behaviour == ()


def correlogram(r, z=100.0):
    return [Autocorrelation("", "", lag, float(value), float(z * value)) for lag, value in enumerate(r, start=1)]


@pytest.mark.parametrize("period", [6.0, 10.3, 17.0, 30.0])
@pytest.mark.parametrize("damping", [0.0, 0.03])
def test_the_period_is_read_off_the_correlations_at_all_lags(period, damping):
    lag = np.arange(1, 51)
    wobble = 0.02 * np.random.default_rng(3).standard_normal(50)  # later troughs may be the deepest
    r = 0.8 * np.exp(-damping * lag) * np.cos(2 * np.pi * lag / period) + wobble
    assert _period(correlogram(r)) == pytest.approx(period, rel=0.08)


@pytest.mark.parametrize(
    "r",
    [
        0.9 ** np.arange(1, 51),  # drifts
        np.where(np.arange(1, 51) == 4, -0.4, 0.0),  # swings back, and that is all
        np.cos(2 * np.pi * np.arange(1, 51) / 90),  # swings more slowly than can be seen
    ],
)
def test_what_is_not_alike_again_has_no_period(r):
    assert _period(correlogram(r)) is None
    swing = np.cos(np.arange(1, 51))
    assert _period(correlogram(swing)) == pytest.approx(2 * np.pi, rel=0.05)
    assert _period(correlogram(swing, z=1.0)) is None
    assert _period([replace(one, z=min(one.z, 1.0)) for one in correlogram(swing)]) is None  # alike again only by chance


def test_a_motion_that_is_opposed_later_is_said_to_swing_back():
    def said(scale, correlation, period_s=None):
        return Autocorrelation("left", scale, 5, correlation, -30.0, period_s).in_words

    assert said("within", -0.45) == (
        "The unexplained motion sideways is opposite 5 frames later (correlation -0.45): something swings back that "
        "no logged variable shows."
    )
    assert said("between", 0.3).startswith("The unexplained motion sideways is alike in the next command (correlation +0.30")
    swings = "The unexplained motion sideways swings to and fro with a period of about 0.41 s, 2.5 Hz"
    assert said("within", -0.45, 0.408).startswith(swings)
    assert not any("repeats" in said(scale, -0.4) for scale in ("within", "between"))


@pytest.mark.parametrize("memory", [0.5, 0.6, 0.9])
def test_a_tracker_whose_errors_have_a_memory_has_no_rhythm(memory):
    """Frames share errors of the tracker, as under filters that smooth poses."""
    table = measured(NOMINAL, trials=40, seed=2, commands=8, jitter=0.002)
    rng, off = np.random.default_rng(1), np.zeros((len(table), 3))
    fresh = rng.standard_normal(off.shape) * np.sqrt(1 - memory**2)
    for k in range(1, len(off)):
        off[k] = memory * off[k - 1] + fresh[k]
    x_m, y_m, heading_rad = (np.array([0.005, 0.005, 0.05]) * off).T
    assert largest(table.assign(x_m=table.x_m + x_m, y_m=table.y_m + y_m, heading_rad=table.heading_rad + heading_rad)) is None


def test_opposed_ways_are_a_motion_where_no_errors_of_a_tracker_could_be_so_opposed():
    rng, trials = np.random.default_rng(0), 40
    opposed = Autocorrelation("heading", "within", 3, -0.2, -9.0)
    swing = [np.cos(2 * np.pi * np.arange(200) / 6 + phase) for phase in rng.uniform(0, 6, trials)]
    moves = [np.repeat((s + rng.standard_normal(200))[:, None], 3, axis=1) for s in swing]
    assert _moves(moves, 2, opposed)
    errors = np.zeros((trials, 201))  # the memory with which they are opposed most, three frames later
    for k in range(1, 201):
        errors[:, k] = 2 / 3 * errors[:, k - 1] + rng.standard_normal(trials)
    assert not _moves([np.repeat(np.diff(e)[:, None], 3, axis=1) for e in errors], 2, opposed)


@pytest.mark.parametrize("seed", range(20))
def test_stationary_errors_of_short_trials_are_no_motion_however_opposed_by_chance(seed):
    rng, errors = np.random.default_rng(seed), np.zeros((40, 101))
    for k in range(1, 101):
        errors[:, k] = 2 / 3 * errors[:, k - 1] + rng.standard_normal(40)
    ways = [np.repeat(np.diff(e)[:, None], 3, axis=1) for e in errors]
    assert not _moves(ways, 2, Autocorrelation("heading", "within", 3, -0.2, -9.0))


def variables_of(left_m_s, command_s=0.4):
    """Of one trial of these left speeds in turn; the right wheel stands."""
    t = np.arange(0, len(left_m_s) * command_s + 1e-9, FRAME_S)
    force = np.minimum((t / command_s + 1e-9).astype(int), len(left_m_s) - 1)
    rows = {"trial": 0, "t_s": t, "left_m_s": np.array(left_m_s)[force], "right_m_s": 0.0}
    table = pd.DataFrame(rows | {"x_m": 0.0, "y_m": 0.0, "heading_rad": 0.0})
    predictor = WheelPredictor(tracks_of(table))
    return {name: values[0] for name, values in predictor.variables().items()}, predictor.grid.node_s[0][:-1]


def test_a_reversal_is_fresh_and_fades():
    seen, at_s = variables_of([0.1, 0.05, -0.1, 0.0, -0.1, 0.1])
    turned = seen["left_reversed"]
    assert (turned[at_s < 0.8 - 1e-6] == 0).all()  # faster or slower is no reversal
    first = np.argmin(np.abs(at_s - 0.8))
    assert turned[first] == pytest.approx(-np.exp(-FRAME_S / 2 / RECENT_S))
    later = np.argmin(np.abs(at_s - 1.6))  # after a halt the same way again: no new reversal
    assert -0.01 < turned[later] < 0
    again = np.argmin(np.abs(at_s - 2.0))
    assert turned[again] == pytest.approx(np.exp(-FRAME_S / 2 / RECENT_S))
    assert (seen["right_reversed"] == 0).all()


def test_a_change_of_command_is_fresh_and_fades():
    seen, at_s = variables_of([0.1, 0.04])
    change = seen["left_change_m_s"]
    second = np.argmin(np.abs(at_s - 0.4))
    assert change[0] == pytest.approx(0.1 * np.exp(-FRAME_S / 2 / RECENT_S))
    assert change[second] == pytest.approx(-0.06 * np.exp(-FRAME_S / 2 / RECENT_S))
    assert seen["just_started"][0] == pytest.approx(np.exp(-FRAME_S / 2 / RECENT_S))
    assert seen["just_started"][second] < 0.1


def test_a_share_of_the_motion_scales_ways_and_turns_alike():
    predictor = WheelPredictor(tracks_of(measured(NOMINAL, trials=3)))
    everywhere = np.ones_like(predictor.grid.step_s)
    before = predictor.steps(NOMINAL).body
    after = predictor.steps(NOMINAL.with_active(probe_effect(SHARE, everywhere, 0 * everywhere), (-0.2,))).body
    assert after[:, 2] == pytest.approx(0.8 * before[:, 2])
    assert np.hypot(*after[:, :2].T) == pytest.approx(0.8 * np.hypot(*before[:, :2].T), abs=2e-6)


@pytest.mark.parametrize(
    ("se", "chance", "share", "stays"),
    [(0.2, 1e-4, 0.01, True), (0.5, 1e-4, 0.01, False), (0.2, 0.1, 0.01, False), (0.2, 1e-4, 0.001, False)],
)
def test_a_pattern_must_be_earned_in_many_trials_and_large(se, chance, share, stays):
    found = ResidualDependence("speed_m_s", "yaw_rad_s", PairedComparison(1.0, se, chance), share)
    assert significant_dependence([found]) == ([found] if stays else [])


def test_what_is_left_follows_a_variable_in_words():
    along = ResidualDependence("time_in_command_s", SHARE, PairedComparison(1.0, 0.1, 1e-5), 0.115)
    said = "the error of the whole motion follows time in the command: a free curve along it removes 11.5% of the loss"
    assert along.in_words == said
    only = Diagnosis("unlisted", None, rest=replace(NOTHING, residual_dependence=(along, along)))
    assert only.behaviour == (said,)
    assert replace(only, terms_in_words=("slower",)).behaviour == ("slower",)  # a term that stands says it better


def test_a_moment_that_begins_and_ends_where_it_is_predicted_says_how_far_the_track_strayed():
    table = measured(NOMINAL, trials=1, seed=3, noise=(1e-6, 1e-6), jitter=0.0)
    table.loc[30:31, "y_m"] += 0.017
    predictor = WheelPredictor(tracks_of(table))
    problem = problem_for(predictor, NOMINAL)
    fit = problem.fit(NOMINAL)
    within, at_end = moment_at(problem, fit, 26, 9.0), moment_at(problem, fit, 31 - WIDTH + 1, 9.0)
    assert within.strayed_m == pytest.approx(0.017, abs=1e-4)
    assert within.in_words.endswith("°, but up to 17 mm from where it was predicted on the way")
    assert at_end.strayed_m == pytest.approx(0.017, abs=1e-4)
    assert "on the way" not in at_end.in_words
    opposite = replace(within, moved_m=0.056, predicted_m=0.056, ended_m=0.11)
    assert opposite.in_words.endswith("°, in another direction: it ended 110 mm from there")
    shorter = replace(within, moved_m=0.03, predicted_m=0.056, ended_m=0.03)
    assert shorter.in_words.endswith("°")
