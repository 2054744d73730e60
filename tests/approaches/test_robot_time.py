"""Curves over robot time, by hand."""

import numpy as np
import pandas as pd
import pytest

from analysis.robot_time import minutes_until_lasting, success_by_minute, survival


def evals(run, minutes, success):
    return pd.DataFrame({"run_id": run, "robot_s": 60.0 * np.array(minutes), "success": np.array(success, bool)})


def test_a_run_counts_with_its_latest_evaluation_and_only_while_it_lasts():
    both = pd.concat([evals("a", [1, 2, 4], [0, 1, 0]), evals("b", [2, 3], [1, 1])])
    rows = success_by_minute(both, [0, 1.5, 2, 3.5, 4.5])
    assert rows.minute.tolist() == [0, 1.5, 2, 3.5]
    assert rows.runs.tolist() == [2, 2, 2, 1]
    assert rows.successes.tolist() == [0, 0, 2, 1]
    assert ((rows.low <= rows.successes / rows.runs) & (rows.successes / rows.runs <= rows.high)).all()


def test_success_lasts_from_the_first_of_three_in_a_row():
    both = pd.concat([evals("a", [1, 2, 3, 4, 5, 6], [1, 1, 0, 1, 1, 1]), evals("b", [1, 2, 7], [0, 1, 1])])
    until = minutes_until_lasting(both)
    assert until.minutes.tolist() == [4, 7]
    assert until.ended.tolist() == [True, False]


def test_survival_is_that_of_kaplan_and_meier():
    """Their own way: at each end the share goes down by one over those still at risk; who leaves early only leaves the risk."""
    times, share = survival([2, 3, 3, 5, 6], [True, True, False, True, False])
    assert times.tolist() == [0, 2, 3, 5]
    assert share.tolist() == pytest.approx([1, 4 / 5, 4 / 5 * 3 / 4, 4 / 5 * 3 / 4 * 1 / 2])
    assert survival([4, 4], [False, False])[1].tolist() == [1]
