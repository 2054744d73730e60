"""The benchmark of proposed experiments: its worlds are driven as planned, and its figure says what was measured."""

import numpy as np
import pandas as pd
import pytest

from bns.diagnose.design.sequences import Sequences
from tests.hidden_effects.deciding import Open, is_right
from tests.hidden_effects.experiment import Look, carried_out, plan_in
from tests.hidden_effects.listed import cause
from tests.hidden_effects.proposing import CAMERA, CASES, JITTER, ROBOT, Case, driven, first_look, minutes_until_decided
from tests.hidden_effects.robot_time import figure, intervals, ratios, summary, times

LOOK = Look(ROBOT.wheelbase_m, CAMERA, CASES[0].layout, JITTER)
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


def test_the_minutes_are_those_of_the_commands_that_it_took(monkeypatch):
    plan = Sequences(*(np.full((6, 2), v) for v in (0.1, 0.1, 15.0)))
    case, old = CASES[0], driven(CASES[0], STRAIGHT, (0, 0, 0), 0, "old")
    new = driven(case, plan, (0, 0, 0), 0, "new")
    rows = len(old)
    for needed, minutes in ((2, 0.25), (4, 0.75), (9, 1.5), (18, 3.0), (19, np.inf)):  # three rows a trial: its start, two ends
        enough = lambda d, c, table, n=needed: len(table) - rows >= n  # noqa: E731
        monkeypatch.setattr("tests.hidden_effects.proposing.decided", enough)
        assert minutes_until_decided(None, case, old, new, plan) == minutes


def test_an_answer_is_right_when_the_truth_alone_is_left_or_what_is_alike_has_been_called_so():
    delay, clock = frozenset({"command-delay"}), frozenset({"clock-offset"})
    both = {delay, clock}
    said = ["tie", "clock-offset", "command-delay"]
    for alike, told, answer, right in (
        ({delay}, set(), ["effects", "command-delay"], True),
        ({delay}, set(), ["effects", "motor-lag"], False),
        ({delay}, {frozenset({"command-delay", "clock-offset"})}, said, False),
        (both, {frozenset({"command-delay", "clock-offset"})}, said, True),
        (both, set(), said, False),
        (both, set(), ["unlisted"], False),
    ):
        assert is_right(Open("w", delay, frozenset(alike), pd.DataFrame(), (), LOOK, ()), answer, told) is right


def test_proposed_commands_are_driven_from_where_they_are_to_start(tmp_path):
    table = pd.DataFrame({"trial": [0, 0, 1], "left_m_s": 0.1, "right_m_s": 0.1, "duration_s": [1.0, 0.6, 2.0]})
    table.assign(start_x_m=0.3, start_y_m=-0.2, start_heading_rad=np.pi / 2).to_csv(tmp_path / "next.csv", index=False)
    plan, start = plan_in(tmp_path / "next.csv")
    assert plan.lasting_s == pytest.approx([1.6, 2.0])
    assert start == pytest.approx((0.3, -0.2, np.pi / 2))
    ends = carried_out(plan, start, [cause("speed-gain", {"gain": 1.5})], LOOK, 0, ("w",)).groupby("trial").last()
    assert ends["y_m"].tolist() == pytest.approx([-0.2 + 0.15 * 1.6, -0.2 + 0.15 * 2.0], abs=0.02)


FOUND = [{"truth": "a", "rival": "b", "proposed": p, "random": r} for p, r in ((0.5, 1.0), (0.5, 2.0), (2.0, 1.0), (1.0, np.inf))]


def test_the_summary_says_both_sides_and_how_sure_it_is():
    minutes = times(FOUND, 8.0)
    assert ratios(minutes) == {"of the totals": 3.0, "of the medians": 2.0, "median of the ratios": 3.0}
    for name, (low, high) in intervals(minutes).items():
        assert low <= ratios(minutes)[name] <= high
        assert low < high
    said = summary(FOUND, 8.0)
    assert "4 worlds" in said
    assert "random sooner in 1, half the time or less in 3" in said
    assert "12.0, 1.50, never in 1" in said


def test_the_figure_shows_what_was_not_decided_beyond_the_rest(tmp_path):
    assert figure(FOUND, 8.0, tmp_path / "robot-time").stat().st_size > 5_000
