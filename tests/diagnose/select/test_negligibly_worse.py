"""An explanation that does nearly as much as the accepted one, and that no error speaks against, is part of the tie."""

from types import SimpleNamespace

import numpy as np
import pandas as pd
import pytest

from bns.diagnose.data.tracks import tracks_of
from bns.diagnose.diagnosing import diagnose
from bns.diagnose.predict.horizons import Errors
from bns.diagnose.predict.wheels import WheelPredictor
from bns.diagnose.select import negligible
from bns.diagnose.select.negligible import LEAST_FALL, NEARLY, negligibly_worse
from bns.physics.model import Model
from tests.diagnose.worlds import all_but_rivals_of

FIT = SimpleNamespace(held_out=np.arange(60.0), free=("a",))
WITHOUT = SimpleNamespace(held_out=FIT.held_out + 100.0, free=())
WINDOWS = 90_000
"""So many that a tenth of a per cent of luck is left."""


def losing(share, free=("b",)):
    return SimpleNamespace(held_out=FIT.held_out + 100.0 * share, free=free)


def windows(rms=1.0, heading=1.0, median=1.0, bad=0.0):
    """Errors of which a tenth is large; so many times their root mean square (by the large), heading and median (by the small
    ones). ``bad``: that of as many windows more, of another trial."""
    large_m = 0.05 * np.sqrt((rms**2 * 34 - 9) / 25)
    position = np.where(np.arange(WINDOWS) % 10 == 0, large_m, 0.01 * median)
    position, turn = (np.concatenate([own, np.full(WINDOWS, bad)]) for own in (position, np.full(WINDOWS, 0.1 * heading)))
    trial = np.repeat([0, 1], WINDOWS)
    return Errors(trial, trial, trial, position, 0 * position, turn)


def worse(monkeypatch, tried, counted=(1.0, 0.0), bad=0.0, **errors):
    """The answer where the errors with ``tried`` are so many times those with the accepted explanation."""
    tracks = SimpleNamespace(trial=np.array([0, 1]))
    predictor = SimpleNamespace(tracks=tracks, horizons=("1s",), counted=None if counted is None else np.array(counted))
    tried.model, FIT.model = windows(**errors, bad=bad), windows(bad=bad)
    monkeypatch.setattr(negligible, "held_out_steps", lambda _predictor, _filter, model: model)
    monkeypatch.setattr(negligible, "judged_windows", lambda _predictor, steps, _horizon: steps)
    return negligibly_worse(SimpleNamespace(predictor=predictor, pose_filter=None), tried, FIT, WITHOUT)


@pytest.mark.parametrize(("share", "tie"), [(0.9 * NEARLY, True), (1.1 * NEARLY, False), (-0.5, True)])
def test_it_must_do_nearly_all_that_the_accepted_one_does(monkeypatch, share, tie):
    assert worse(monkeypatch, losing(share)) is tie


@pytest.mark.parametrize("what", ["rms", "heading", "median"])
def test_no_error_may_show_what_it_lacks(monkeypatch, what):
    assert worse(monkeypatch, losing(0.01), **{what: 1 + 0.9 * LEAST_FALL})
    assert not worse(monkeypatch, losing(0.01), **{what: 1 + 1.1 * LEAST_FALL})
    assert worse(monkeypatch, losing(0.01), **{what: 0.9})


def test_a_trial_that_counts_nothing_hides_nothing(monkeypatch):
    assert not worse(monkeypatch, losing(0.01), bad=9.0, rms=1.5, heading=1.5, median=1.5)
    assert worse(monkeypatch, losing(0.01), bad=9.0, counted=None, rms=1.5, heading=1.5)  # it does where it counts
    assert worse(monkeypatch, losing(0.01), bad=9.0)


def test_one_with_more_numbers_that_does_less_is_no_rival(monkeypatch):
    assert not worse(monkeypatch, losing(0.01, free=("b", "c")))


NOISE = [1e-4, 1e-4, 3e-4]
STEP_S, FRAME_STEPS, BASE_M, LOOP_S = 0.001, 40, 0.25, 0.003


def followed(told):
    """Wheel speeds (steps,) of a speed loop with two equal time constants, each step exact for a command that stays."""
    out, first, second = np.zeros(len(told)), 0.0, 0.0
    decay = np.exp(-STEP_S / LOOP_S)
    for i, u in enumerate(told):
        a, b = first - u, second - u
        first, second = u + a * decay, u + (b + a * STEP_S / LOOP_S) * decay
        out[i] = second
    return out


def driven(number, rng):
    left, right = (np.repeat(rng.uniform(0.1, 0.5, 8), 1000) for _ in range(2))
    wheels = [np.concatenate([[0.0], followed(told)]) for told in (left, right)]
    on_left, on_right = ((w[1:] + w[:-1]) / 2 for w in wheels)
    turn = np.concatenate([[0.0], np.cumsum((on_right - on_left) / BASE_M * STEP_S)])
    middle = (turn[1:] + turn[:-1]) / 2
    way = (on_left + on_right) / 2 * STEP_S
    x, y = (np.concatenate([[0.0], np.cumsum(way * direction(middle))]) for direction in (np.cos, np.sin))
    at = np.arange(0, len(left) + 1, FRAME_STEPS)
    poses = np.column_stack([x, y, turn])[at] + rng.normal(size=(len(at), 3)) * NOISE
    now = np.minimum(at, len(left) - 1)
    table = {"trial": number, "t_s": at * STEP_S, "left_m_s": left[now], "right_m_s": right[now]}
    return pd.DataFrame(table | dict(zip(("x_m", "y_m", "heading_rad"), poses.T, strict=True)))


@pytest.mark.slow
def test_a_speed_loop_of_six_milliseconds_is_a_lag_a_delay_or_a_clock():
    """Its response is neither of them; in 40 ms from picture to picture none can be seen to be it."""
    rng = np.random.default_rng(4)
    table = pd.concat([driven(number, rng) for number in range(40)], ignore_index=True)
    barred = all_but_rivals_of("motor-lag", "command-delay", "clock-offset")
    found = diagnose(WheelPredictor(tracks_of(table)), Model(wheelbase_m=BASE_M), barred=barred)
    assert found.verdict == "tie"
    assert {names[-1] for names in found.as_json()["explanations"]} == {"clock-offset", "command-delay", "motor-lag"}
