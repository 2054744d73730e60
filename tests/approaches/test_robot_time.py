"""Curves over robot time, by hand."""

import numpy as np
import pandas as pd
import pytest
from scipy.stats import CensoredData, ecdf

from analysis.intervals import resampled
from analysis.robot_time import minutes_until_lasting, of_latest, restricted_mean, success_by_minute, survival


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


def test_success_of_the_latest_evaluations_is_averaged_within_a_run():
    both = pd.concat([evals("a", [1, 2, 3, 4], [1, 0, 0, 1]), evals("b", [1, 2], [0, 1])], ignore_index=True)
    assert of_latest(both, 2).tolist() == [1, 0.5, 0, 0.5, 0, 0.5]
    shuffled = both.iloc[[4, 0, 1, 5, 2, 3]]
    assert of_latest(shuffled, 2).tolist() == of_latest(both, 2)[shuffled.index].tolist()
    assert success_by_minute(both.assign(success=of_latest(both, 2)), [2.0]).successes.tolist() == [1.0]


def test_the_restricted_mean_is_the_area_below_scipy_s_curve():
    random = np.random.default_rng(1)
    minutes, ended = random.integers(1, 12, 30).astype(float), random.random(30) < 0.6
    curve = ecdf(CensoredData(minutes[ended], right=minutes[~ended])).sf
    fine = np.arange(0, 9, 0.001) + 0.0005
    area = 0.001 * curve.evaluate(fine).sum()
    assert restricted_mean(minutes, ended, 9.0)[0] == pytest.approx(area, abs=0.002)
    assert restricted_mean([3.0, 5.0], [False, False], 4.0)[0] == 4.0


def test_a_bootstrap_sample_of_the_restricted_mean_is_that_of_its_runs():
    minutes, ended = np.array([2.0, 3.0, 3.0, 5.0, 8.0]), np.array([True, True, False, True, False])
    weights = resampled(5, 20)
    drawn = restricted_mean(minutes, ended, 6.0, weights)
    for row, area in zip(weights.astype(int), drawn, strict=True):
        own = np.repeat(np.arange(5), row)
        assert area == pytest.approx(restricted_mean(minutes[own], ended[own], 6.0)[0])
