"""What firmware, drives and bearings do to commands, and scrubbing to turns: each is named with its numbers."""

import numpy as np
import pandas as pd
import pytest

from bns.diagnose.data.tracks import tracks_of
from bns.diagnose.diagnosing import diagnose
from bns.diagnose.estimate.problem import problem_for
from bns.diagnose.estimate.starts import fit_extended, fit_with, listed
from bns.diagnose.predict.wheels import WheelPredictor
from bns.physics.effects import command_rate, effect_named
from bns.physics.signals import Conditions, Wheels
from tests.diagnose.worlds import BASE_M, FRAME_S, NOMINAL, all_but_rivals_of, hidden, measured


def driven(trials=20, **effects):
    """Without scatter of the motors: it would act before the commands are rounded."""
    return WheelPredictor(tracks_of(measured(hidden(**effects), trials=trials, seed=4, speeds=(-0.2, 0.2), jitter=0.0)))


@pytest.mark.slow
@pytest.mark.parametrize(
    ("name", "values"),
    [
        ("command-truncation", {"step_m_s": 0.013, "share": 1.0}),
        ("command-quantisation", {"step_m_s": 0.027, "share": 1.0}),
        ("reversal-pause", {"pause_s": 0.15}),
        ("start-delay", {"wait_s": 0.15}),
        ("turn-dead-zone", {"width_rad_s": 0.2}),
        ("compass-deviation", {"cosine_share": 0.1, "sine_share": -0.06}),
        ("reverse-gain", {"gain": 0.9}),
        ("dead-zone-mismatch", {"width_m_s": 0.01, "left_share": 1.8}),
        ("speed-limit-mismatch", {"max_m_s": 0.12, "left_spare": 0.25}),
        ("carpet-drift", {"x_share": 0.05, "y_share": -0.03}),
        ("command-timeout", {"timeout_s": 0.8}),
        ("overload-trip", {"step_m_s": 0.13, "off_s": 0.2}),
        ("supply-trip", {"step_m_s": 0.2, "off_s": 0.3}),
    ],
)
def test_each_is_named_with_its_numbers(name, values):
    found = diagnose(driven(trials=14, **{name.replace("-", "_"): values}), NOMINAL)
    assert (found.verdict, found.effects) == ("effects", (name,))
    assert {key: one["value"] for key, one in found.numbers[name].items()} == pytest.approx(values, rel=0.03)


@pytest.mark.slow
def test_friction_that_falls_over_a_session_is_named_with_its_numbers():
    """The dead zone is constant within each trial: trials are short compared with the time constant."""
    trials = []
    for i in range(24):
        width = 0.006 + 0.012 * np.exp(-(30 * i + 3) / 240)
        one = measured(hidden(dead_zone={"width_m_s": width}), trials=1, seed=i, speeds=(-0.2, 0.2), jitter=0.002)
        trials.append(one.assign(trial=i, session_s=one["t_s"] + 30 * i))
    found = diagnose(WheelPredictor(tracks_of(pd.concat(trials, ignore_index=True))), NOMINAL)
    assert (found.verdict, found.effects) == ("effects", ("friction-warm-up",))
    numbers = {key: one["value"] for key, one in found.numbers["friction-warm-up"].items()}
    assert numbers == pytest.approx({"width_m_s": 0.006, "cold_m_s": 0.012, "time_s": 240.0}, rel=0.15)


@pytest.mark.parametrize("step_m_s", [0.0113, *(pytest.param(step, marks=pytest.mark.slow) for step in (0.027, 0.045))])
@pytest.mark.parametrize("name", ["command-truncation", "command-quantisation"])
def test_a_step_is_found_that_is_no_round_number(name, step_m_s):
    """The loss has a valley for each number of steps below the fastest speed."""
    predictor = driven(trials=8, **{name.replace("-", "_"): {"step_m_s": step_m_s, "share": 1.0}})
    problem = problem_for(predictor, NOMINAL)
    found = fit_with(problem, problem.fit(NOMINAL), listed(NOMINAL, None, predictor.tracks)[name])
    assert found.values == pytest.approx([step_m_s, 1.0], rel=0.05)


def by_joystick(step_m_s, cut, trials=20, frames=240, gap_at=()):
    """By this test's own integrator: commands that change with every frame, rounded by `cut` (np.trunc, np.rint)."""
    rng, rows, within = np.random.default_rng(7), [], 10
    for trial in range(trials):
        time = np.arange(frames) * FRAME_S
        waves = (rng.uniform(low, high, (2, 1)) for low, high in 2 * [(0.03, 0.09), (0.5, 3.0), (0.0, 6.0)])
        told = sum(next(waves) * np.sin(next(waves) * time + next(waves)) for _ in range(2))
        left, right = np.repeat(step_m_s * cut(told / step_m_s), within, axis=1)
        dt = FRAME_S / within
        heading = np.append(0.0, np.cumsum((right - left) / BASE_M * dt)[:-1])
        x_m, y_m = (np.append(0.0, np.cumsum((left + right) / 2 * f(heading) * dt)[:-1]) for f in (np.cos, np.sin))
        seen = np.column_stack([x_m, y_m, heading])[::within] + rng.normal(size=(frames, 3)) * [1e-3, 1e-3, 4e-3]
        columns = {"trial": trial, "t_s": time, "left_m_s": told[0], "right_m_s": told[1]}
        one = pd.DataFrame(columns | dict(zip(("x_m", "y_m", "heading_rad"), seen.T, strict=True)))
        one.loc[[*gap_at], ["x_m", "y_m", "heading_rad"]] = np.nan
        rows.append(one)
    return WheelPredictor(tracks_of(pd.concat(rows, ignore_index=True)))


@pytest.mark.parametrize(("name", "cut"), [("command-truncation", np.trunc), ("command-quantisation", np.rint)])
@pytest.mark.parametrize("gap_at", [(), range(100, 120)])
def test_a_step_is_found_in_commands_that_change_all_the_time(name, cut, gap_at):
    """No command is driven for long enough to say anything by itself."""
    predictor = by_joystick(0.0317, cut, gap_at=gap_at)
    problem = problem_for(predictor, NOMINAL)
    found = fit_with(problem, problem.fit(NOMINAL), listed(NOMINAL, None, predictor.tracks)[name])
    assert found.values == pytest.approx([0.0317, 1.0], rel=0.05)


@pytest.mark.slow
def test_commands_of_a_joystick_that_are_cut_off_are_no_friction_and_steps():
    found = diagnose(by_joystick(0.03, np.trunc), NOMINAL)
    assert (found.verdict, found.effects) == ("effects", ("command-truncation",))


def on_ticks(period_s, tau_s=0.0, trials=30, lasting_s=9.0, seed=11):
    """By this test's own integrator: commands of 0.3 to 0.9 s, taken at the ticks of a clock, and followed with a lag."""
    rng, rows, within = np.random.default_rng(seed), [], 60
    dt = FRAME_S / within
    for trial in range(trials):
        at = np.append(0.0, np.cumsum(rng.uniform(0.3, 0.9, 40)))
        at = at[at < lasting_s]
        told = rng.uniform(-0.25, 0.25, (len(at), 2))
        frames = int(lasting_s / FRAME_S)
        times = np.arange(frames * within) * dt
        taken = told[np.searchsorted(at, np.floor(times / period_s + 1e-9) * period_s + 1e-9, side="right") - 1]
        speed = taken if not tau_s else np.zeros_like(taken)
        for k in range(1, len(times) if tau_s else 0):
            speed[k] = taken[k] + (speed[k - 1] - taken[k]) * np.exp(-dt / tau_s)
        heading = np.append(0.0, np.cumsum((speed[:, 1] - speed[:, 0]) / BASE_M * dt)[:-1])
        x_m, y_m = (np.append(0.0, np.cumsum(speed.mean(axis=1) * f(heading) * dt)[:-1]) for f in (np.cos, np.sin))
        seen = np.column_stack([x_m, y_m, heading])[::within] + rng.normal(size=(frames, 3)) * [1e-3, 1e-3, 4e-3]
        poses = pd.DataFrame(seen, columns=["x_m", "y_m", "heading_rad"]).assign(t_s=np.arange(frames) * FRAME_S)
        commands = pd.DataFrame(told, columns=["left_m_s", "right_m_s"]).assign(t_s=at)
        rows.append(pd.concat([commands, poses]).sort_values("t_s", kind="stable").assign(trial=trial))
    table = pd.concat(rows, ignore_index=True)
    table[["left_m_s", "right_m_s"]] = table[["left_m_s", "right_m_s"]].ffill()
    return WheelPredictor(tracks_of(table))


@pytest.mark.parametrize(("period_s", "tau_s"), [(0.1307, 0.0), (0.0913, 0.08), (0.2217, 0.15)])
def test_ticks_of_no_round_period_are_seen_before_any_fit(period_s, tau_s):
    """A tick late in a trial falls into the right frame only within a hundredth of a frame: 0.2 ms here."""
    predictor = on_ticks(period_s, tau_s, trials=12)
    found = predictor.starts_of(listed(NOMINAL, None, predictor.tracks)["command-rate"], NOMINAL)
    assert min(abs(one - period_s) for (one,) in found) < 0.1 * period_s**2 / 9.0
    untracked = Wheels(np.full((1, 4), 0.1), np.ones((1, 4)), np.ones((1, 4)), BASE_M)
    assert effect_named("command-rate").starts_from(untracked) == tuple((one,) for one in command_rate._ROUND)


def test_of_a_long_trial_only_the_beginning_is_looked_at(monkeypatch):
    """Of twenty minutes as of half a minute: the work grows with the square of the time."""
    asked = []
    monkeypatch.setattr(command_rate, "explained_by_ticks", lambda *given: asked.append(given[3:]) or np.zeros(len(given[3])))
    for steps in (600, 24_000):
        still = np.zeros((1, steps))
        seen = Conditions(seen=np.zeros((1, steps, 3)))
        command_rate.starts_from(Wheels(np.full((1, steps), 0.05), still, still, BASE_M, seen))
    short, long = asked[: len(asked) // 2], asked[len(asked) // 2 :]
    assert [(len(periods), until_s) for periods, _, until_s in long] == [(len(periods), until_s) for periods, _, until_s in short]
    assert {until_s for _, _, until_s in long} == {3.0, 30.0}


@pytest.mark.slow
def test_ticks_of_no_round_period_before_a_lag_are_named_with_their_numbers():
    """Beside a lag that stands for both, a period at whose ticks wheels are later fits only when the lag gives way."""
    found = diagnose(on_ticks(0.1307, 0.07, trials=14), NOMINAL, barred=all_but_rivals_of("command-rate", "motor-lag"))
    assert (found.verdict, set(found.effects)) == ("effects", {"command-rate", "motor-lag"})
    assert found.numbers["command-rate"]["period_s"]["value"] == pytest.approx(0.1307, abs=2e-4)
    assert found.numbers["motor-lag"]["tau_s"]["value"] == pytest.approx(0.07, rel=0.02)


def test_a_wheel_that_starts_late_is_found_from_one_that_stops_at_the_same_command():
    """The best single threshold, by which it is begun, lies far from both."""
    hides = hidden(breakaway={"threshold_m_s": 0.09, "stop_ratio": 0.4})
    predictor = WheelPredictor(tracks_of(measured(hides, trials=20, seed=4, speeds=(0.0, 0.2), jitter=0.0)))
    effects = listed(NOMINAL, None, predictor.tracks)
    problem = problem_for(predictor, NOMINAL)
    alike = fit_with(problem, problem.fit(NOMINAL), effects["dead-band"])
    assert alike.values[0] < 0.075
    found = fit_extended(problem, alike, effects["breakaway"])
    assert found.values == pytest.approx([0.09, 0.4], rel=0.1)
