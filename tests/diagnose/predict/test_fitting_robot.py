"""Whether a model is of the robot that was measured is judged by factors alone, never by what an effect does."""

from dataclasses import replace

import numpy as np
import pandas as pd
import pytest

from bns.api.common.prepared import prepared
from bns.diagnose.comparison import compare
from bns.diagnose.data.tracks import tracks_of
from bns.diagnose.predict.check_robot import _scale, check_same_robot, suggested_wheelbase_m
from bns.diagnose.predict.wheels import WheelPredictor
from bns.errors import DataError
from bns.physics.wheels.differential_drive import track
from tests.diagnose.worlds import FRAME_S, NOMINAL, hidden, measured


def predictor(model):
    """A converged run: each trial drives nearly the same turns, a strong one and a weak one back, by turns."""
    rng, tables = np.random.default_rng(0), []
    for trial in range(12):
        left = np.tile([0.03, 0.08], 3) + rng.normal(0, 0.001, 6)
        right = np.tile([0.12, 0.055], 3)
        seen = track(model, [left], [right], [np.ones(6)], dense_dt_s=FRAME_S)
        force = np.minimum((seen.t_s[0] + 1e-9).astype(int), 5)
        columns = {"t_s": seen.t_s[0], "left_m_s": left[force], "right_m_s": right[force]}
        poses = dict(zip(("x_m", "y_m", "heading_rad"), seen.poses[0].T, strict=True))
        tables.append(pd.DataFrame({"trial": trial, **columns, **poses}))
    return WheelPredictor(tracks_of(pd.concat(tables, ignore_index=True)))


@pytest.mark.parametrize("tau_s", [0.1, 0.25, 0.4, 0.6, 0.9])
def test_motors_that_follow_late_are_no_other_robot(tau_s):
    check_same_robot(predictor(hidden(motor_lag={"tau_s": tau_s})), NOMINAL)


@pytest.mark.parametrize("factor", [0.25, 4.0])
def test_another_wheelbase_is_another_robot(factor):
    other = replace(NOMINAL, wheelbase_m=factor * NOMINAL.wheelbase_m)
    with pytest.raises(DataError, match=r"A wheelbase of about 0.088\d* m would fit: --wheelbase 0.088"):
        check_same_robot(predictor(NOMINAL), other)


@pytest.mark.parametrize("effects", [{"motor_lag": {"tau_s": 0.5}}, {"command_delay": {"delay_s": 0.3}}, {}])
def test_the_wheelbase_that_is_suggested_is_that_of_the_robot_however_late_it_turns(effects):
    late = WheelPredictor(tracks_of(measured(hidden(**effects), trials=20, speeds=(-0.2, 0.2))))
    assert suggested_wheelbase_m(late.tracks) == pytest.approx(NOMINAL.wheelbase_m, rel=0.03)


def test_an_error_suggests_the_same_wheelbase():
    late = predictor(hidden(motor_lag={"tau_s": 0.1}))
    with pytest.raises(DataError, match=rf"would fit: --wheelbase {suggested_wheelbase_m(late.tracks):.4g} "):
        check_same_robot(late, replace(NOMINAL, wheelbase_m=4 * NOMINAL.wheelbase_m))


@pytest.mark.parametrize(("factor", "asked"), [(1.0, False), (1.1, False), (1.5, True), (1.81, True), (0.6, False)])
def test_compare_asks_about_a_wheelbase_that_is_probably_wrong(factor, asked):
    other = replace(NOMINAL, wheelbase_m=factor * NOMINAL.wheelbase_m)
    hint = compare(predictor(hidden(motor_lag={"tau_s": 0.1})), other).hint
    assert ("Is the wheelbase right?" in hint) == asked
    assert not asked or float(hint.split("--wheelbase ")[1].split()[0]) == pytest.approx(NOMINAL.wheelbase_m, rel=0.15)


@pytest.mark.parametrize("tau_s", [0.25, 0.6])
def test_compare_does_not_take_a_lag_for_a_wheelbase(tau_s):
    assert compare(predictor(hidden(motor_lag={"tau_s": tau_s})), NOMINAL).hint == ""


def test_compare_asks_only_from_a_factor_on():
    other = replace(NOMINAL, wheelbase_m=1.15 * NOMINAL.wheelbase_m)
    assert compare(predictor(NOMINAL), other).hint == ""
    assert compare(predictor(NOMINAL), replace(NOMINAL, wheelbase_m=1.35 * NOMINAL.wheelbase_m)).hint != ""


def in_unit(table, size):
    """The same log with wheels in another unit of speed."""
    return WheelPredictor(tracks_of(table.assign(left_m_s=table.left_m_s / size, right_m_s=table.right_m_s / size)))


@pytest.mark.parametrize(
    ("size", "unit"), [(1 / 3.6, "left_m_s and right_m_s look like km/h"), (39.37, "x_m and y_m look like inches")]
)
def test_distances_are_judged_before_turns_and_name_the_unit(size, unit):
    table = measured(NOMINAL, trials=12, commands=12, straight=0.5)
    moved = table if size < 1 else table.assign(x_m=table.x_m * size, y_m=table.y_m * size)
    with pytest.raises(DataError, match=rf"times as far as commanded\. {unit}\. In the mapping .* unit: "):
        check_same_robot(in_unit(moved, min(size, 1.0)), NOMINAL)


def test_no_wheelbase_is_suggested_that_no_model_may_have():
    table = measured(NOMINAL, trials=12)
    noise = table.assign(heading_rad=np.random.default_rng(1).normal(0, 1e-3, len(table)))
    tracks = tracks_of(noise)
    with pytest.raises(DataError, match=r"No wheelbase from 0\.001 to 10 m would fit: is heading_rad") as error:
        check_same_robot(WheelPredictor(tracks), NOMINAL)
    assert "--wheelbase" not in str(error.value)
    assert suggested_wheelbase_m(tracks) is None


def test_a_factor_on_turns_is_the_one_that_most_of_the_turning_agrees_on():
    predicted = np.array([1.0, 0.1, -0.1, 0.2])
    assert _scale(predicted * [3.0, 2.0, 1.0, 0.5], predicted) == 3.0
    assert _scale(predicted[1:] * [2.0, 1.0, 0.5], predicted[1:]) == 0.5


@pytest.mark.parametrize(
    ("seen", "said"),
    [
        (lambda x, y: (x, -y), "y_m runs the wrong way"),
        (lambda x, y: (-x, y), "x_m runs the wrong way"),
        (lambda x, y: (y, x), "x_m and y_m are exchanged: exchange"),
        (lambda x, y: (-y, -x), "x_m and y_m are exchanged, and run the wrong way"),
        (lambda x, y: (0.6 * x + 0.8 * y, 0.8 * x - 0.6 * y), "in the entry y_m (or x_m)"),  # a mirror that stands askew
    ],
)
def test_positions_that_are_mirrored_are_told_how(seen, said):
    table = measured(NOMINAL, trials=12, commands=8)
    x, y = seen(table.x_m, table.y_m)
    with pytest.raises(DataError) as refused:
        prepared(table.assign(x_m=x, y_m=y), NOMINAL)
    assert "Positions are mirrored against headings" in str(refused.value)
    assert said in str(refused.value)
