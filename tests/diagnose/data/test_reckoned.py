"""Poses that were computed from the commands are told as such; what a tracker saw is not."""

import numpy as np
import pandas as pd
import pytest

from bns.diagnose.data.checks import checked
from tests.diagnose.worlds import BASE_M, hidden, measured

ODD = "look computed from the commands"


def integrated(late=0, factor=1.0, base_m=BASE_M, noise_m=0.0, seed=0):
    """By this test's own sums: each command holds from its row on, or (``late``) until it."""
    rng, trials = np.random.default_rng(seed), []
    for trial in range(4):
        t = np.cumsum(rng.uniform(0.03, 0.06, 80))
        told = np.repeat(rng.uniform(-0.2, 0.3, (8, 2)), 10, axis=0)
        held = told[1:] if late else told[:-1]
        steps = np.diff(t)[:, None] * held * factor
        turned = np.concatenate([[0.0], np.cumsum((steps[:, 1] - steps[:, 0]) / base_m)])
        middle = (turned[1:] + turned[:-1]) / 2.0
        way = steps.mean(axis=1)
        x, y = (np.concatenate([[0.0], np.cumsum(way * of(middle))]) for of in (np.cos, np.sin))
        pose = np.column_stack([x, y, turned]) + noise_m * rng.standard_normal((80, 3))
        trials.append(np.column_stack([np.full(80, trial), t, told, pose]))
    table = pd.DataFrame(np.concatenate(trials), columns=["trial", "t_s", "left_m_s", "right_m_s", "x_m", "y_m", "heading_rad"])
    return table.astype({"trial": int})


def said(table):
    return [finding.text for finding in checked(table)[1] if ODD in finding.text]


@pytest.mark.parametrize("late", [0, 1])
@pytest.mark.parametrize("factor", [1.0, 0.93])
def test_dead_reckoning_is_told_whatever_its_wheelbase_and_whenever_commands_begin(late, factor):
    (text,) = said(integrated(late, factor, base_m=0.1))
    assert "dead reckoning" in text
    assert "camera" in text


def test_the_least_noise_of_a_tracker_is_enough():
    assert not said(integrated(noise_m=1e-4))
    assert said(integrated(noise_m=1e-7))


def test_a_robot_that_is_its_model_under_a_camera_is_not_meant():
    assert not said(measured(hidden(), trials=8, noise=(0.0003, 0.001), jitter=0.0))


def test_a_few_steps_tell_nothing():
    assert not said(integrated().groupby("trial").head(4))


def test_poses_on_rows_without_commands_of_their_own_count_as_well():
    """Many logs give a command only where it changes, and poses on rows between."""
    table = integrated()
    rare = table.copy()
    rare.loc[rare.index % 2 == 1, ["x_m", "y_m", "heading_rad"]] = np.nan
    assert said(rare)


def test_a_robot_told_to_stand_has_no_way_to_compare():
    table = integrated().assign(left_m_s=0.0, right_m_s=0.0, x_m=0.0, y_m=0.0)
    table["heading_rad"] = 1e-9 * np.arange(len(table))
    assert not said(table)
