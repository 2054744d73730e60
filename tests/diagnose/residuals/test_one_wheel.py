"""Moments in which one wheel alone does not turn as predicted: which one it is, and which way it is off."""

from dataclasses import replace

import numpy as np
import pandas as pd
import pytest

from bns.diagnose.data.tracks import tracks_of
from bns.diagnose.diagnosis import Diagnosis
from bns.diagnose.estimate.problem import problem_for
from bns.diagnose.predict.wheels import WheelPredictor
from bns.diagnose.residuals.outliers import Outlier, one_wheel, outliers
from bns.diagnose.residuals.unexplained import NOTHING
from tests.diagnose.worlds import FRAME_S, NOMINAL

MOMENT = Outlier("3", 1.0, 9.0, 0.4, 0.0, 0.0, 0.03, 0.0, 0.05, 0.0)


def slipping(side, speed, trials=14):
    """Robots told to drive straight on for four seconds, of which one wheel stands for a quarter of a second; arcs, by hand."""
    rng, rows = np.random.default_rng(1), []
    for trial in range(trials):
        wheels = np.full((100, 2), speed) * (1 + 0.004 * rng.normal(size=2))
        began = rng.integers(20, 80)
        wheels[began : began + 6, side] = 0.0
        heading = np.concatenate([[0.0], np.cumsum((wheels[:, 1] - wheels[:, 0]) / NOMINAL.wheelbase_m * FRAME_S)])
        middle, way = (heading[1:] + heading[:-1]) / 2, wheels.mean(axis=1) * FRAME_S
        x, y = (np.concatenate([[0.0], np.cumsum(way * axis(middle))]) for axis in (np.cos, np.sin))
        seen = np.column_stack([x, y, heading]) + rng.normal(size=(101, 3)) * [0.0005, 0.0005, 0.003]
        told = {"trial": trial, "t_s": FRAME_S * np.arange(101), "left_m_s": speed, "right_m_s": speed}
        rows.append(pd.DataFrame(seen, columns=["x_m", "y_m", "heading_rad"]).assign(**told))
    return pd.concat(rows, ignore_index=True)


@pytest.mark.parametrize(("side", "speed"), [(0, 0.12), (1, 0.12), (1, -0.12)])
def test_the_wheel_that_slips_is_named_whichever_way_it_drives(side, speed):
    problem = problem_for(WheelPredictor(tracks_of(slipping(side, speed))), NOMINAL)
    found = outliers(problem, problem.fit(NOMINAL))
    assert len(found) >= 10
    said = one_wheel(found)
    assert said.endswith(f"of these moments the {('left', 'right')[side]} wheel alone turned less than predicted")
    assert int(said.split()[1]) >= 0.8 * len(found)


@pytest.mark.parametrize(
    ("left", "right", "said"),
    [
        (7, 0, "in 7 of these moments the left wheel alone turned more than predicted"),
        (6, 0, ""),
        (1, 10, "in 10 of these moments the right wheel alone turned more than predicted"),
        (3, 10, ""),
        (0, 0, ""),
    ],
)
def test_that_it_is_the_same_wheel_must_be_rarer_than_chance(left, right, said):
    """Heads and tails: 7 of 7 have a chance of 1.6 % either way, 6 of 6 of 3.1 %, 10 of 11 of 1.2 %, 10 of 13 of 9 %."""
    moments = [replace(MOMENT, left_m=0.02)] * left + [replace(MOMENT, right_m=0.02)] * right
    both = [replace(MOMENT, left_m=0.02, right_m=0.01)] * 5
    assert one_wheel([*moments, *both]) == said


def test_it_is_among_what_is_said_of_moments():
    moments = tuple(replace(MOMENT, right_m=-0.02) for _ in range(8))
    tracks = WheelPredictor(tracks_of(slipping(1, 0.12, trials=8)))
    problem = problem_for(tracks, NOMINAL)
    selection = type("Selection", (), {"problem": problem})()
    found = Diagnosis("unlisted", selection, rest=replace(NOTHING, outliers=moments))
    assert found.moments[1] == "in 8 of these moments the right wheel alone turned less than predicted"


def test_a_wheel_that_turns_less_at_times_and_more_at_others_is_not_named():
    """A marker that is mistaken behind a line does that, at the way there and at the way back."""
    less, more = replace(MOMENT, left_m=-0.02), replace(MOMENT, left_m=0.02)
    assert one_wheel([less] * 12 + [more] * 9) == ""
    assert one_wheel([less] * 12 + [more]) == "in 12 of these moments the left wheel alone turned less than predicted"
