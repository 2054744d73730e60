"""The benchmark of proposed experiments: its worlds are driven as planned, and its figure says what was measured."""

import numpy as np

from bns.diagnose.sequences import Sequences
from tests.hidden_effects.proposing import CASES, Case, driven, figure, first_look, minutes_until_decided

STRAIGHT = Sequences(np.full((2, 1), 0.1), np.full((2, 1), 0.1), np.full((2, 1), 2.0))


def test_a_plan_is_driven_from_its_start_by_the_hidden_effect():
    table = driven(Case("speed-gain", {"gain": 1.5}, "dead-zone"), STRAIGHT, (0.2, 0.1, 0.0), 0, "new")
    for _, rows in table.groupby("trial"):
        assert np.allclose(rows[["x_m", "y_m"]].iloc[0], [0.2, 0.1], atol=0.015)
        assert np.allclose(rows["x_m"].iloc[-1] - rows["x_m"].iloc[0], 0.3, atol=0.02)


def test_first_looks_are_as_narrow_as_the_case_says_and_differ_between_seeds():
    for case in CASES:
        plan = first_look(case, 0)
        assert ((plan.left_m_s + plan.right_m_s) / 2 >= case.speeds[0] - 1e-9).all()
        assert (plan.right_m_s - plan.left_m_s <= case.turning[1] + 1e-9).all()
        assert not np.array_equal(plan.left_m_s, first_look(case, 1).left_m_s)


def test_the_minutes_are_those_of_the_trials_that_it_took(monkeypatch):
    plan = Sequences(*(np.full((6, 1), v) for v in (0.1, 0.1, 30.0)))
    case, old = CASES[0], driven(CASES[0], STRAIGHT, (0, 0, 0), 0, "old")
    new = driven(case, plan.only(np.arange(6)), (0, 0, 0), 0, "new")
    for needed, minutes in ((1, 0.5), (4, 2.0), (7, np.inf)):
        enough = lambda d, c, table, n=needed: table["trial"].nunique() - 2 >= n  # noqa: E731
        monkeypatch.setattr("tests.hidden_effects.proposing.decided", enough)
        assert minutes_until_decided(None, case, old, new, plan) == minutes


def test_the_figure_shows_what_was_not_decided_beyond_the_rest(tmp_path):
    found = [{"truth": "a", "rival": "b", "proposed": 0.5, "random": v} for v in (1.0, 2.0, np.inf)]
    assert figure(found, tmp_path / "robot-time").stat().st_size > 5_000
