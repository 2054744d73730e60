"""Where the moments that stand out begin: a narrow range of one coordinate, or nothing."""

from types import SimpleNamespace

import numpy as np
import pandas as pd
import pytest

from bns.diagnose import caveats
from bns.diagnose.data.tracks import tracks_of
from bns.diagnose.diagnosis import Diagnosis
from bns.diagnose.estimate.problem import problem_for
from bns.diagnose.predict.wheels import WheelPredictor
from bns.diagnose.residuals.outliers import JudgedWindows, judged_windows
from bns.diagnose.residuals.shared_place import (
    _HEADING,
    _TIME,
    _X,
    FEWEST,
    SESSION,
    SharedPlace,
    _largest_gap,
    _narrowest,
    shared_place,
)
from bns.diagnose.residuals.unexplained import unexplained
from tests.diagnose.worlds import BASE_M, FRAME_S, NOMINAL

LASTS = 20
STEP_S = FRAME_S / LASTS


def driven(dragged, trials=30, seed=0):
    """By this test's own integrator: trials that cross the floor this way and that; `dragged` (pose, t_s, luck) halves speeds."""
    rng, rows = np.random.default_rng(seed), []
    for trial in range(trials):
        pose, luck, t_s, seen = np.array([*rng.uniform(-0.3, 0.3, 2), rng.uniform(-3, 3)]), rng.uniform(), 0.0, []
        for k in range(160 * LASTS):
            if k % (20 * LASTS) == 0:
                told = rng.uniform(0.08, 0.16) + rng.uniform(-0.05, 0.05) * np.array([-1, 1])
                scattered = told * (1 + 0.004 * rng.standard_normal(2))
            if k % LASTS == 0:
                seen.append([trial, t_s, *told, *(pose + rng.standard_normal(3) * [5e-4, 5e-4, 2e-3])])
            left, right = scattered * (0.5 if dragged(pose, t_s, luck) else 1.0)
            ahead = (left + right) / 2
            pose = pose + STEP_S * np.array([ahead * np.cos(pose[2]), ahead * np.sin(pose[2]), (right - left) / BASE_M])
            t_s += STEP_S
        rows.append(pd.DataFrame(seen, columns=["trial", "t_s", "left_m_s", "right_m_s", "x_m", "y_m", "heading_rad"]))
    return pd.concat(rows, ignore_index=True).astype({"trial": int})


def some_of(seed):
    """Trials 18 to 29 of 40, and in each a moment of its own."""
    trial = [-1]

    def dragged(_, t_s, luck):
        if t_s == 0.0:
            trial[0] += 1
        return 18 <= trial[0] < 30 and 2.0 + 4.0 * luck < t_s < 2.5 + 4.0 * luck

    return driven(dragged, trials=40, seed=seed)


def left_in(dragged, **given):
    problem = problem_for(WheelPredictor(tracks_of(driven(dragged, **given))), NOMINAL)
    fit = problem.fit(NOMINAL)
    return problem, fit, shared_place(problem, judged_windows(problem, fit))


@pytest.mark.parametrize(
    ("dragged", "clause"),
    [
        (lambda pose, _, __: 0.05 < pose[0] < 0.12, "x is between"),
        (lambda pose, _, __: -0.1 < pose[1] < -0.03, "y is between"),
        (lambda pose, _, __: np.cos(pose[2]) < -0.985, "heading is between"),  # 170 to 190 degrees
        (lambda _, t_s, __: 5.0 < t_s < 5.5, "trial has lasted"),
    ],
)
def test_the_coordinate_that_the_moments_share_is_named(dragged, clause):
    problem, fit, found = left_in(dragged)
    assert clause in found.in_words
    assert found.inside >= 0.8 * found.moments
    assert found.usual < 0.3
    rest = unexplained(problem, fit, ())
    assert rest.place == found
    selection = type("Selection", (), {"problem": problem})()
    said = (rest.shared or found).in_words  # what commands have in common explains more
    assert Diagnosis("unlisted", selection, rest=rest).moments[-1] == said
    assert any(f"What they share: {said}." in note for note in caveats._on_rest(rest, problem.predictor.tracks))


def test_moments_at_random_share_nothing():
    _, __, found = left_in(lambda _, t_s, luck: 2.0 + 6.0 * luck < t_s < 2.5 + 6.0 * luck)
    assert found is None


def test_moments_in_a_part_of_the_session_are_told_by_it():
    problem = problem_for(WheelPredictor(tracks_of(some_of(seed=2))), NOMINAL)
    fit = problem.fit(NOMINAL)
    rest = unexplained(problem, fit, ())
    assert rest.place.clause == SESSION
    assert rest.place.in_words.startswith("all these 12 moments begin when the session has lasted ")
    assert rest.place.in_words.endswith("of what was driven is driven then")
    assert 0.25 < rest.place.usual < 0.32
    begin = problem.predictor.tracks.start_s
    assert begin[18] < rest.place.low < begin[19]
    assert begin[29] < rest.place.high
    (note,) = (one for one in caveats._on_rest(rest, problem.predictor.tracks) if "What they share" in one)
    assert note.endswith("a battery, heat, a hand.")


@pytest.mark.parametrize(("moments", "found"), [(FEWEST - 1, False), (FEWEST, True)])
def test_few_moments_could_share_one_by_chance(moments, found):
    """A trial each, of 100 windows along x; the one near 0.5 m stands out, in all that have one."""
    windows = np.arange(100 * moments)
    x = np.tile(np.linspace(0.0, 1.0, 100), moments)
    rng = np.random.default_rng(0)
    pose = np.column_stack([x, rng.uniform(size=len(x)), rng.uniform(-3, 3, len(x))])
    own_s = rng.uniform(0, 10, len(x))
    tracks = SimpleNamespace(trial=windows // 100, pose=pose, own_s=own_s, session_s=own_s, relative=False)
    tracks.trial = np.append(tracks.trial, moments - 1)  # windows begin at the frame after a pose
    stands_out = np.isin(windows % 100, [50])
    judged = JudgedWindows(windows + 1, np.where(stands_out, 9.0, 1.0), stands_out)
    place = shared_place(SimpleNamespace(predictor=SimpleNamespace(tracks=tracks)), judged)
    assert (place is not None) is found
    assert place is None or (place.inside, place.moments, place.usual) == (moments, moments, pytest.approx(0.01, rel=1e-3))


@pytest.mark.parametrize(
    ("clause", "low", "high", "inside", "said"),
    [
        (_X, 0.231, 0.276, 27, "all these 27 moments begin where x is between 0.23 and 0.28 m"),
        (_HEADING, 3.0, 3.4, 25, "25 of these 27 moments begin where the heading is between 172 and -165°"),
        (_TIME, 4.8, 4.81, 25, "25 of these 27 moments begin where the trial has lasted 4.8 s"),
    ],
)
def test_it_is_said_with_what_is_usual(clause, low, high, inside, said):
    assert SharedPlace(clause, low, high, inside, 27, 0.037).in_words == f"{said}; 4% of the same trials is driven there"


def test_ranges_hold_nearly_all_and_headings_are_cut_where_there_are_none():
    assert list(_narrowest(np.array([9.0, 1.0, 2.0, 3.0, 4.0]))) == [(1.0, 4.0), (1.0, 9.0)]
    assert _largest_gap(np.array([3.0, -3.0, 3.1, -3.1])) == pytest.approx(3.0)
