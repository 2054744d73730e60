"""Poses that take no part: single rows, what a finding is about, and trials cut shorter."""

import json

import numpy as np
import pandas as pd
import pytest

import bns
from bns.api.common.prepared import prepared
from bns.cli.main import main
from bns.diagnose.data.split_trials import split
from bns.diagnose.predict.paired_errors import judged_windows
from bns.errors import DataError
from bns.examples import FOLDER

LOG = FOLDER / "khepera-log.csv"


@pytest.fixture(scope="module")
def log():
    return bns.Measurements(LOG)


@pytest.fixture(scope="module")
def lagging():
    return bns.Model("khepera").with_effect("motor-lag", tau_s=0.3)


def frames_of(log, model, trial):
    """Times, poses and predicted displacements of a trial's frames."""
    predictor = prepared(log, model).predictor
    tracks = predictor.tracks
    number = tracks.names.index(trial)
    rows = slice(tracks.first[number], tracks.first[number + 1])
    return tracks.own_s[rows], tracks.pose[rows], predictor.steps(model).body[rows]


def test_a_trial_that_is_cut_goes_on_as_it_was_driven(log, lagging):
    name = str(log.trials["trial"].iloc[1])
    t_s, pose, body = frames_of(log, lagging, name)
    cut = log.cut({name: (2.0, 5.0)})
    less_s, less_pose, less_body = frames_of(cut, lagging, name)
    inside = (t_s >= 2.0) & (t_s <= 5.0)
    assert 10 < len(less_s) == inside.sum() < len(t_s)
    assert np.array_equal(less_s, t_s[inside])
    assert np.array_equal(less_pose, pose[inside])
    assert np.allclose(less_body[1:], body[inside][1:], atol=1e-12)
    others = [str(n) for n in log.trials["trial"] if str(n) != name]
    assert [len(frames_of(cut, lagging, n)[0]) for n in others] == [len(frames_of(log, lagging, n)[0]) for n in others]


def test_times_of_a_piece_of_a_log_begin_where_it_does_and_not_with_what_goes_before():
    t_s = np.arange(600) / 10
    drive = pd.DataFrame({"t_s": t_s, "left_m_s": 0.1, "right_m_s": 0.1, "x_m": 0.1 * t_s, "y_m": 0.0, "heading_rad": 0.0})
    log = bns.Measurements(split(drive, "lasting_s", 20.0))
    name = str(log.trials["trial"].iloc[1])
    rows, time_s = log.times_of(name)
    own = (log.frame["run_up"].iloc[rows] == 0).to_numpy()
    assert 0 < own.sum() < len(own)
    assert time_s[own][0] == 0.0
    assert (time_s[~own] < 0.0).all()
    cut = log.cut({name: (2.0, 5.0)})
    again, less_s = cut.times_of(name)
    left = cut.frame["left_out"].iloc[again].to_numpy() == 0
    assert (less_s[left].min(), less_s[left].max()) == (pytest.approx(2.0), pytest.approx(5.0))
    assert less_s[own][0] == 0.0


def test_no_window_spans_poses_that_were_left_out(log):
    name = str(log.trials["trial"].iloc[0])
    rows, time_s = log.times_of(name)
    out = rows[(time_s > 3.0) & (time_s < 3.5)]
    less = log.without_rows(out)
    ready = prepared(less, bns.Model("khepera"))
    tracks = ready.predictor.tracks
    errors = judged_windows(ready.predictor, ready.predictor.steps(ready.model), "1s")
    mine = errors.trial == tracks.names.index(name)
    spans = (tracks.own_s[errors.start[mine]] < 3.5) & (tracks.own_s[errors.end[mine]] > 3.0)
    assert mine.sum() > 3
    assert not spans.any()
    first = slice(tracks.first[0], tracks.first[1])
    assert not ((tracks.own_s[first] > 3.0) & (tracks.own_s[first] < 3.5)).any()
    assert less.frame["left_out"].sum() == len(out)
    assert less.frame["left_m_s"].notna().sum() == log.frame["left_m_s"].notna().sum()


def test_the_saved_table_reads_as_what_took_part(log, tmp_path, capsys):
    name = str(log.trials["trial"].iloc[2])
    less = log.without_rows(range(40, 60)).cut({name: (1.0, 6.0)})
    saved = tmp_path / "used.csv"
    less.frame.to_csv(saved, index=False)
    again = bns.Measurements(saved)
    assert again.sha256 == less.sha256
    assert again.findings.equals(less.findings)
    assert main(["compare", str(saved), "--model", "khepera", "--json"]) == 0
    said = json.loads(capsys.readouterr().out)["error"]
    mine = bns.compare(less, "khepera").to_json()["error"]
    assert said == json.loads(json.dumps(mine))
    assert mine != json.loads(json.dumps(bns.compare(log, "khepera").to_json()["error"]))


def moved_away(log, from_row=130, by_m=2.0):
    """A log in which somebody carried the robot off, and a row before that was written twice."""
    table = log.frame
    trial = table["trial"].iloc[from_row]
    later = (table.index >= from_row) & (table["trial"] == trial)
    table.loc[later, "x_m"] += by_m
    table.loc[10, "t_s"] = table["t_s"].iloc[9]
    return pd.DataFrame(table), str(trial)


def test_a_finding_that_is_left_out_lets_the_rest_of_its_trial_take_part(log):
    table, name = moved_away(log)
    odd = bns.Measurements(table)
    jumps = odd.findings[odd.findings["text"].str.contains("jumps by")]
    assert list(jumps["row"]) == [130]
    around = odd.rows_around(130)
    assert 130 in around
    assert set(table["trial"].iloc[around].astype(str)) == {name}
    time_s = table["t_s"].iloc[around]
    assert time_s.max() - time_s.min() == pytest.approx(1.0, abs=0.2)
    less = odd.without_rows(around)
    assert not less.findings["text"].str.contains("jumps by").any()
    model = bns.Model("khepera")
    t_s, pose, _ = frames_of(less, model, name)
    before, _, _ = frames_of(odd, model, name)
    assert t_s[-1] > before[-1] + 1.0
    assert np.ptp(pose[:, 0]) > 1.5  # both sides of the jump are there, and it is nobody's error
    assert bns.compare(less, model).errors.loc["1s", "position_m"] < 0.05


def test_gaps_and_losses_that_were_left_out_are_no_findings_any_more(log):
    table = log.frame
    gone = table.drop(index=range(30, 50)).reset_index(drop=True)
    gone.loc[70:75, ["x_m", "y_m", "heading_rad"]] = np.nan
    odd = bns.Measurements(gone)
    found = odd.findings[odd.findings["row"] < 100]
    assert any("no row for" in text for text in found["text"])
    assert any("poses lost" in text for text in found["text"])
    rows = odd.rows_around(*found["row"])
    assert {29, 30, *range(70, 77)} <= set(rows)
    less = odd.without_rows(rows)
    assert not len(less.findings[less.findings["row"] < 100])


def test_what_cannot_be_left_out_is_said(log):
    with pytest.raises(DataError, match=r"There is no row 99999; the table has the rows 0 to \d+"):
        log.without_rows([99999])
    with pytest.raises(DataError, match="There is no row -1"):
        log.rows_around(-1)
    with pytest.raises(DataError, match="There is no trial 99"):
        log.cut({"99": (0, 1)})
    name = str(log.trials["trial"].iloc[0])
    with pytest.raises(DataError, match=r"has nothing from 500 s to 600 s; it lasts from 0 s to \d"):
        log.cut({name: (500, 600)})
    for ends in (3, (1, 2, 3), ("a", "b"), None):
        with pytest.raises(DataError, match=f"Trial {name} is to be kept for .*; give two times in seconds"):
            log.cut({name: ends})
    with pytest.raises(DataError, match="no tracked pose"):
        log.without_rows(range(len(log.frame)))
    assert log.without_rows([]) is log
    assert log.cut({}) is log


def test_a_cut_keeps_both_its_ends_and_what_was_left_out_before_stays_out(log):
    name = str(log.trials["trial"].iloc[1])
    rows, time_s = log.times_of(name)
    cut = log.without_rows([rows[0], rows[4]]).cut({name: (time_s[3], time_s[8])})
    assert np.flatnonzero(cut.frame["left_out"].iloc[rows].to_numpy() == 0).tolist() == [3, 5, 6, 7, 8]


def test_a_piece_of_a_log_lasts_as_long_as_itself_without_what_goes_before():
    t_s = np.arange(600) / 10
    drive = pd.DataFrame({"t_s": t_s, "left_m_s": 0.1, "right_m_s": 0.1, "x_m": 0.1 * t_s, "y_m": 0.0, "heading_rad": 0.0})
    log = bns.Measurements(split(drive, "lasting_s", 20.0))
    assert (log.frame["run_up"] != 0).any()
    assert log.trials["duration_s"].tolist() == pytest.approx([19.9, 39.9])  # too short a rest belongs to the piece before it
