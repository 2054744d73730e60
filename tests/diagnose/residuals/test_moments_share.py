"""What moments that stand out share: one property of the commands before them, with a limit, or nothing."""

from dataclasses import dataclass, replace

import numpy as np
import pandas as pd
import pytest

from bns.diagnose.data.tracks import tracks_of
from bns.diagnose.estimate.problem import problem_for
from bns.diagnose.predict.wheels import WheelPredictor
from bns.diagnose.residuals import moments_share
from bns.diagnose.residuals.moments_share import (
    _PROPERTIES,
    FEWEST,
    PURE,
    SharedCause,
    _Changes,
    _followed,
    _pure,
    shared_cause,
)
from bns.diagnose.residuals.outliers import WIDTH, JudgedWindows, judged_windows
from bns.diagnose.residuals.unexplained import unexplained
from tests.diagnose.worlds import BASE_M, FRAME_S, NOMINAL


@dataclass
class OneTrial:
    """As much of `Tracks` as is asked here."""

    t_s: np.ndarray
    trial: np.ndarray

    def __len__(self):
        return 1


LASTS = 20
STEP_S = FRAME_S / LASTS
CUT_S = 0.2


def driven(cut, trials=14, commands=12, seed=0):
    """By this test's own integrator: `cut` (both wheels before, after) says whether the motors stop for `CUT_S` then."""
    rng, rows = np.random.default_rng(seed), []
    for trial in range(trials):
        told = rng.uniform(-0.2, 0.2, (commands, 2))
        starts = np.concatenate([[0.0], np.cumsum(rng.choice([1.2, 1.6, 2.0], commands - 1))])
        t_s = np.arange(0.0, starts[-1] + 1.6, STEP_S)
        of = np.searchsorted(starts, t_s + 1e-9, side="right") - 1
        scattered = told * (1 + 0.004 * rng.standard_normal(told.shape))
        speed = scattered[of]
        for k in range(1, commands):
            if cut(told[k - 1], told[k]):
                speed[(t_s >= starts[k]) & (t_s < starts[k] + CUT_S)] = 0.0
        heading = rng.uniform(-3, 3) + np.concatenate([[0.0], np.cumsum((speed[:, 1] - speed[:, 0]) / BASE_M * STEP_S)[:-1]])
        ahead = speed.mean(axis=1)
        x_m, y_m = (np.concatenate([[0.0], np.cumsum(ahead * f(heading) * STEP_S)[:-1]]) for f in (np.cos, np.sin))
        seen = slice(None, None, LASTS)
        poses = np.column_stack([x_m, y_m, heading])[seen] + rng.standard_normal((len(t_s[seen]), 3)) * [1e-3, 1e-3, 4e-3]
        rows.append(
            pd.DataFrame(
                {
                    "trial": trial,
                    "t_s": t_s[seen],
                    "left_m_s": told[of[seen], 0],
                    "right_m_s": told[of[seen], 1],
                    "x_m": poses[:, 0],
                    "y_m": poses[:, 1],
                    "heading_rad": poses[:, 2],
                }
            )
        )
    return pd.concat(rows, ignore_index=True)


def left_in(table):
    problem = problem_for(WheelPredictor(tracks_of(table)), NOMINAL)
    return problem, problem.fit(NOMINAL)


def asked(table):
    problem, fit = left_in(table)
    return shared_cause(problem, judged_windows(problem, fit))


def steps(before, after):
    return float(np.abs(after - before).sum())


def test_motors_that_stop_after_large_steps_are_told_by_the_size_of_the_step():
    found = asked(driven(lambda before, after: steps(before, after) > 0.25))
    assert "change both wheels' speeds by {0} in all" in found.clause
    assert found.above
    assert found.limit == pytest.approx(0.25, abs=0.02)
    assert found.followed >= PURE * found.beyond
    assert found.others_followed <= 0.1 * found.others


def test_motors_that_stop_as_a_wheel_turns_back_are_told_by_that():
    found = asked(driven(lambda before, after: np.abs(after[before * after < 0]).max(initial=0.0) > 0.06))
    assert "reverse a wheel" in found.clause
    assert found.limit == pytest.approx(0.06, abs=0.02)


def test_motors_that_stop_after_the_change_of_a_wheel_is_small_are_told_by_the_smaller_change():
    found = asked(driven(lambda before, after: np.abs(after - before).min() < 0.04, trials=20))
    assert "the smaller change" in found.clause
    assert not found.above
    assert found.limit == pytest.approx(0.04, abs=0.01)


def test_motors_that_stop_for_no_reason_share_nothing():
    rng = np.random.default_rng(5)
    table = driven(lambda before, after: rng.random() < 0.3)
    problem, fit = left_in(table)
    judged = judged_windows(problem, fit)
    assert judged.stands_out.sum() >= FEWEST
    assert shared_cause(problem, judged) is None


def test_a_robot_that_does_as_it_is_told_has_nothing_to_share():
    assert asked(driven(lambda before, after: False)) is None


def test_few_moments_say_nothing():
    problem, fit = left_in(driven(lambda before, after: steps(before, after) > 0.25))
    judged = judged_windows(problem, fit)
    few = np.flatnonzero(judged.stands_out)[: FEWEST - 1]
    assert shared_cause(problem, replace(judged, stands_out=np.isin(np.arange(len(judged.start)), few))) is None


@pytest.mark.parametrize(("changes", "found"), [(16, False), (40, True)])
def test_each_limit_that_was_tried_is_a_chance(monkeypatch, changes, found):
    """Half of the changes are followed, just those above a limit. Of 16 that is 1 in 6,435, and some 400 limits were tried."""
    problem, fit = left_in(driven(lambda before, after: False))
    properties = np.zeros((changes, len(_PROPERTIES)))
    properties[:, :] = np.arange(changes)[:, None]
    asked_of = _Changes(np.zeros(changes, dtype=int), np.arange(changes), properties)
    monkeypatch.setattr(moments_share, "_changes", lambda tracks: asked_of)
    judged_as = np.ones(changes, dtype=bool), np.arange(changes) >= changes // 2
    monkeypatch.setattr(moments_share, "_followed", lambda *given: judged_as)
    assert (shared_cause(problem, judged_windows(problem, fit)) is not None) == found


def test_what_is_left_names_it():
    problem, fit = left_in(driven(lambda before, after: steps(before, after) > 0.25))
    rest = unexplained(problem, fit, ())
    assert rest.outliers
    assert "commands that change both wheels' speeds by more than about 0.2" in rest.shared.in_words


def test_a_moment_is_that_of_the_one_change_within_its_window_or_before_it():
    """Windows of 12 frames at 25 Hz: from 0 s with one change in it, from 0.48 s with two, from 0.96 s with none."""
    n, at_s = 3 * WIDTH + 1, np.array([0.1, 0.6, 0.8])
    tracks = OneTrial(FRAME_S * np.arange(n), np.zeros(n, dtype=int))
    changes = _Changes(np.zeros(3, dtype=int), at_s, np.zeros((3, len(_PROPERTIES))))
    start = 1 + WIDTH * np.arange(3)
    for stands_out, seen, followed in (
        ([False, False, False], [True, True, True], [False, False, False]),
        ([True, False, False], [True, True, True], [True, False, False]),
        ([False, True, False], [True, False, False], [False, False, False]),
        ([False, False, True], [True, True, True], [False, False, True]),
    ):
        given = JudgedWindows(start, np.zeros(3), np.array(stands_out))
        assert [one.tolist() for one in _followed(tracks, changes, given)] == [seen, followed]


@pytest.mark.parametrize(
    ("followed", "beyond", "others_followed", "right"),
    [(8, 10, 2, True), (8, 10, 3, False), (8, 11, 0, False), (10, 10, 0, True)],
)
def test_both_sides_of_the_limit_must_be_nearly_pure(followed, beyond, others_followed, right):
    assert PURE == 0.8
    assert _pure(SharedCause("change {0}", "m/s", 0.1, True, followed, beyond, others_followed, 50)) == right
