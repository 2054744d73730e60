"""Logs of real robots, where they are at hand: small slices of them, diagnosed as the page does."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from analysis.real_robots.__main__ import main
from analysis.real_robots.cases import cases, diagnosed, measured, table_of, with_start
from bns.diagnose.data.apply_mapping import applied
from bns.diagnose.data.checks import checked
from bns.diagnose.data.tracks import tracks_of
from bns.diagnose.estimate.clocks.trial_clock_test import fit_trial_clocks, steps_of
from bns.diagnose.estimate.cross_validation import held_out_steps
from bns.diagnose.estimate.problem import problem_for
from bns.diagnose.predict.paired_errors import paired_errors
from bns.diagnose.predict.wheels import WheelPredictor
from bns.errors import DataError
from bns.physics.model import Model

DATA = Path(__file__).parents[3] / "shared" / "data"
HERE = all((DATA / case.file).is_file() for case in cases().values())
at_hand = pytest.mark.skipif(not HERE, reason="no logs of real robots in ../shared/data")


def some(name, every, most):
    """Some trials of a case, evenly chosen."""
    table = table_of(cases()[name], DATA)
    chosen = table["trial"].unique()[::every][:most]
    return table[table["trial"].isin(chosen)].reset_index(drop=True)


def test_without_data_it_says_what_to_do_and_writes_nothing(tmp_path, capsys):
    assert main(["--data", str(tmp_path), "--out", str(tmp_path / "out")]) == 2
    assert (
        "Give the folder that holds diff_drive_optitrack.parquet: make real-robots DATA=dir" in capsys.readouterr().err
    )
    assert not (tmp_path / "out").exists()
    assert main(["--data", str(tmp_path), "--only", "moon"]) == 2
    assert "unknown case 'moon'" in capsys.readouterr().err


def test_windows_begin_with_what_was_in_force_before():
    table = pd.DataFrame(
        {
            "trial": ["a", "a", "b", "b"],
            "transient": [1, 1, 0, 0],
            "left_m_s": [-1.0, 0.5, 0.8, 0.8],
            "right_m_s": 0.1,
            "left_cmd_m_s": 1.0,
            "right_cmd_m_s": 0.2,
        }
    )
    out = with_start(table)
    assert list(out["start_left_m_s"]) == [-1.0, -1.0, 1.0, 1.0]
    assert list(out["start_right_m_s"]) == [0.1, 0.1, 0.2, 0.2]
    assert "start_left_m_s" not in with_start(table.drop(columns="transient")).columns


@at_hand
def test_optitrack_clocks_are_found_once_the_wheels_are_right():
    table = table_of(replace(cases()["optitrack"], every=1), DATA)
    chosen = [name for name in table["trial"].unique() if name.startswith("circular-250620")][::2]
    tracks = tracks_of(checked(table[table["trial"].isin(chosen)])[0]).thinned(8)
    predictor = WheelPredictor(tracks)
    plain = Model(wheelbase_m=0.2)
    extended = plain.with_effect("wheelbase", factor=1.0).with_effect("camera-rotation", angle_rad=0.0).arranged()
    problem = problem_for(predictor, problem_for(predictor, extended).fit(extended).model)
    fit = problem.fit(extended)
    clocks = fit_trial_clocks(problem, fit)
    assert clocks is not None
    assert clocks.paired_comparison.p_value < 0.01
    assert clocks.paired_comparison.elpd_diff > 0
    steps = [
        ("plain", predictor.steps(plain)),
        ("extended", held_out_steps(predictor, problem.pose_filter, fit.model)),
        ("with clocks", steps_of(predictor, problem.pose_filter, clocks.fit.model)),
    ]
    errors = paired_errors(predictor, steps)
    assert errors.of("extended")["trial"].rms_m < 0.5 * errors.of("plain")["trial"].rms_m
    assert errors.of("with clocks")["1s"].rms_m < errors.of("plain")["1s"].rms_m


@pytest.mark.slow
@at_hand
def test_warthog_errors_halve_and_nothing_is_claimed_of_its_clocks(tmp_path):
    answer = diagnosed(cases()["asphalt-commands"], some("asphalt-commands", 3, 50), tmp_path)
    assert answer["verdict"] in {"unlisted", "effects", "tie"}
    assert answer["error"]["1s"]["after"] < 0.75 * answer["drawn"]["1s"]
    assert "clock-offset" not in answer["effects"]
    assert (tmp_path / "asphalt-commands.txt").read_text().startswith("verdict: ")


@at_hand
def test_variants_of_real_logs_are_refused_or_read_alike(tmp_path):
    case, table = cases()["optitrack"], some("optitrack", 4, 4)
    plain = measured(case, table, tmp_path).tracks
    strange = table.assign(
        t_s=table["t_s"] * 1e9, x_m=table["x_m"] * 100, heading_rad=90 - np.degrees(table["heading_rad"])
    )
    mapping = {
        "t_s": {"from": "t_s", "unit": "ns"},
        "x_m": {"from": "x_m", "unit": "cm"},
        "heading_rad": {"from": "heading_rad", "unit": "deg", "clockwise": True, "zero_deg": 90},
    }
    back = measured(replace(case, mapping={"columns": mapping}), strange, tmp_path).tracks
    assert abs(back.pose - plain.pose).max() < 1e-3
    for wrong, words in (
        (table.assign(heading_rad=table["heading_rad"] * 57.3), "looks like degrees"),
        (table.assign(t_s=table["t_s"] * 1e9), "nanoseconds"),
        (table.assign(t_s=table["t_s"] * 1e6), "microseconds"),
        (table.assign(x_m=table["x_m"] * 1000, y_m=table["y_m"] * 1000), "millimetres"),
        (table.assign(left_m_s=table["right_m_s"], right_m_s=table["left_m_s"]), "turns opposite to the wheels"),
    ):
        with pytest.raises(DataError, match=words):
            checked(applied(wrong, {"columns": {}}))


@pytest.mark.slow
@at_hand
def test_an_effect_that_predicts_better_than_a_curve_is_not_given_up_for_it(tmp_path):
    """On ice a curve of the heading stands in for the acceleration limit, and predicts worse."""
    case = cases()["ice-commands"]
    answer = diagnosed(case, table_of(case, DATA), tmp_path)
    assert answer["effects"] == ["acceleration-limit"]
    assert answer["error"]["trial"]["after"] < 0.5 * answer["error"]["trial"]["before"]
