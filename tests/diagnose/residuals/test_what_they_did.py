"""Moments in which the robot stood still, or did what it had been told shortly before: lost and late commands, by hand."""

from dataclasses import replace

import numpy as np
import pandas as pd
import pytest

from bns.diagnose.data.tracks import tracks_of
from bns.diagnose.diagnosis import Diagnosis
from bns.diagnose.estimate.problem import problem_for
from bns.diagnose.predict.wheels import WheelPredictor
from bns.diagnose.residuals.outliers import LATE, STOOD, Outlier, outliers, what_they_did
from bns.diagnose.residuals.unexplained import NOTHING
from tests.diagnose.worlds import FRAME_S, NOMINAL

MOMENT = Outlier("3", 1.0, 9.0, 0.4, 0.0, 0.0, 0.03, 0.0, 0.05, 0.0)


def faulty(fault, trials=14):
    """Robots told a new pair of wheel speeds every second, six times. Once in a trial ``fault`` changes what the wheels do."""
    rng, rows = np.random.default_rng(4), []
    for trial in range(trials):
        told = np.repeat(rng.uniform(-0.12, 0.12, (6, 2)), 25, axis=0)
        wheels = fault(told.copy(), 25 * rng.integers(2, 5)) * (1 + 0.004 * rng.normal(size=2))
        heading = np.concatenate([[0.0], np.cumsum((wheels[:, 1] - wheels[:, 0]) / NOMINAL.wheelbase_m * FRAME_S)])
        middle, way = (heading[1:] + heading[:-1]) / 2, wheels.mean(axis=1) * FRAME_S
        x, y = (np.concatenate([[0.0], np.cumsum(way * axis(middle))]) for axis in (np.cos, np.sin))
        seen = np.column_stack([x, y, heading]) + rng.normal(size=(len(x), 3)) * [0.0005, 0.0005, 0.003]
        said = {"left_m_s": np.append(told[:, 0], told[-1, 0]), "right_m_s": np.append(told[:, 1], told[-1, 1])}
        table = pd.DataFrame(seen, columns=["x_m", "y_m", "heading_rad"])
        rows.append(table.assign(trial=trial, t_s=FRAME_S * np.arange(len(x)), **said))
    return pd.concat(rows, ignore_index=True)


def stands(wheels, at):
    """A second without any motion."""
    wheels[at + 4 : at + 29] = 0.0
    return wheels


def late(wheels, at):
    """A command that comes half a second late."""
    wheels[at : at + 13] = wheels[at - 1]
    return wheels


def slips(wheels, at):
    """A second in which one wheel turns backwards."""
    wheels[at + 4 : at + 29, 0] *= -1.0
    return wheels


@pytest.mark.parametrize(("fault", "did", "said"), [(stands, STOOD, STOOD), (late, LATE, "commands come late"), (slips, "", "")])
def test_what_the_robot_did_is_said(fault, did, said):
    problem = problem_for(WheelPredictor(tracks_of(faulty(fault))), NOMINAL)
    found = outliers(problem, problem.fit(NOMINAL))
    assert len(found) >= 9
    assert sum(moment.did == did for moment in found) >= 0.7 * len(found)
    assert (said in what_they_did(found)) if said else what_they_did(found) == ""


@pytest.mark.parametrize(
    ("stood", "came_late", "neither", "said"),
    [
        (8, 0, 4, "in 8 of these 12 moments the robot stood still, whatever it was told"),
        (7, 0, 5, ""),
        (3, 5, 4, "in 8 of these 12 moments the robot did what it had been told shortly before, or stood still: "
         "commands come late, or are lost"),
        (3, 4, 5, ""),
    ],
)  # fmt: skip
def test_it_is_said_of_two_thirds_of_the_moments(stood, came_late, neither, said):
    moments = [replace(MOMENT, did=STOOD)] * stood + [replace(MOMENT, did=LATE)] * came_late + [MOMENT] * neither
    assert what_they_did(moments) == said


def test_it_is_among_what_is_said_of_moments():
    problem = problem_for(WheelPredictor(tracks_of(faulty(stands, 8))), NOMINAL)
    selection = type("Selection", (), {"problem": problem})()
    found = Diagnosis("unlisted", selection, rest=replace(NOTHING, outliers=(replace(MOMENT, did=STOOD),) * 8))
    assert found.moments[1] == "in 8 of these 8 moments the robot stood still, whatever it was told"
