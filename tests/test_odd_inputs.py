"""Inputs that once ended in a traceback, took minutes, or passed for something else."""

import argparse
import time

import numpy as np
import pandas as pd
import pytest

from bns.api.add import add
from bns.cli.main import main
from bns.cli.options.option_types import interval
from bns.diagnose.data.checks import checked, rows_by_trial
from bns.diagnose.data.load import load_measured, measured_table
from bns.errors import ClusterError, DataError, ModelError, StoreError
from bns.store import Writer, query
from bns.sweep.jobs.dask_link import DaskLink
from tests.store.synthetic import records

HEAD = "trial,t_s,left_m_s,right_m_s,x_m,y_m,heading_rad\n"


def table(trials, steps):
    step = np.tile(np.arange(steps), trials)
    columns = {"trial": np.repeat(np.arange(trials), steps), "t_s": step / 10, "left_m_s": 0.1, "right_m_s": 0.1}
    return pd.DataFrame(columns | {"x_m": step / 100, "y_m": 0.0, "heading_rad": 0.0})


def log_of(tmp_path, text):
    path = tmp_path / "log.csv"
    path.write_text(HEAD + text)
    return path


def rows(trial, count, **changed):
    cells = {"t": lambda n: n / 10, "x": lambda n: n / 100} | changed
    return "".join(f"{trial},{cells['t'](n)},0.1,0.1,{cells['x'](n)},0,0\n" for n in range(count))


def test_trial_without_a_pose_is_left_out_and_listed(tmp_path, capsys):
    path = log_of(tmp_path, rows("a", 60, x=lambda n: "") + rows("b", 60) + rows("c", 60))
    measured = load_measured(path)
    assert measured.tracks.names == ("b", "c")
    assert [finding.trial for finding in measured.findings if "excluded" in finding.text] == ["a"]
    assert main(["compare", str(path), "--model", "khepera"]) == 0


def test_trials_that_are_too_short_for_the_horizon_are_compared(tmp_path):
    assert main(["compare", str(log_of(tmp_path, rows("a", 8) + rows("b", 8))), "--model", "khepera"]) == 0


@pytest.mark.parametrize(
    ("text", "message"),
    [
        (rows("a", 9, t=lambda n: n / 10 if n < 8 else 1e308), "Row 8: t_s is 1e[+]308; no measurement"),
        (rows("a", 9, t=lambda n: n / 10 if n < 8 else 1e12), "Trial a lasts 1e[+]12 s"),
        (rows("a", 9, x=lambda n: "here"), "Row 0: x_m is 'here'"),
        (rows("a", 9, x=lambda n: ""), "no tracked pose"),
        ("", "have no rows"),
    ],
)
def test_refusals_name_the_file(tmp_path, text, message):
    path = log_of(tmp_path, text)
    with pytest.raises(DataError, match=f"^{path}: .*{message}"):
        load_measured(path)


def test_tables_of_too_many_columns_are_refused_at_once(tmp_path):
    path = tmp_path / "wide.csv"
    path.write_text(",".join(f"c{n}" for n in range(200_000)) + "\n" + "1," * 199_999 + "1\n")
    began = time.process_time()
    with pytest.raises(DataError, match=f"{path} has .* columns or more.*; 2000 are allowed"):
        load_measured(path)
    assert time.process_time() - began < 2


def test_thousands_of_trials_are_read_in_seconds(tmp_path):
    began = time.process_time()
    assert len(measured_table(table(3000, 10), tmp_path / "x").tracks) == 3000
    assert time.process_time() - began < 10


def test_the_quick_look_at_trials_finds_what_the_slow_one_finds(monkeypatch):
    random = np.random.default_rng(4)
    log = table(40, 30)
    log["x_m"] += random.normal(0, 1e-4, len(log))
    for row in random.integers(len(log), size=25):  # jumps, losses, times that stand still
        log.loc[row, "x_m"] = random.choice([np.nan, log.loc[row, "x_m"] + 0.5])
    for row in (305, 911):
        log.loc[row, "t_s"] = log.loc[row - 1, "t_s"]
    quick, findings = checked(log.copy())
    monkeypatch.setattr("bns.diagnose.data.checks._is_sound", lambda t, pose: False)
    slow, all_findings = checked(log.copy())
    pd.testing.assert_frame_equal(quick, slow)
    assert findings == all_findings
    assert len(findings) > 20


def test_rows_by_trial_are_those_of_a_group():
    log = pd.DataFrame({"trial": ["b", "a", None, "b", "c", "a"]})
    groups = {str(name): rows.index.tolist() for name, rows in log.groupby("trial", sort=False)}
    assert {name: at.tolist() for name, at in rows_by_trial(log)} == groups == {"b": [0, 3], "a": [1, 5], "c": [4]}


def test_robot_is_refused_where_no_column_names_any(tmp_path):
    with pytest.raises(DataError, match="no column robot, so 'x' cannot be chosen"):
        load_measured(log_of(tmp_path, rows("a", 9)), robot="x")


def test_effect_given_twice_is_refused(tmp_path):
    with pytest.raises(ModelError, match="motor-lag is given 2 times"):
        add(log_of(tmp_path, rows("a", 9)), ["motor-lag", "motor-lag"], "khepera")


@pytest.mark.parametrize("address", ["garbage", "tcp:/host", "host:", "host:port", ""])
def test_scheduler_that_is_no_address_is_refused_at_once(address):
    with pytest.raises(ClusterError, match="is no address of a Dask scheduler; write HOST:PORT"):
        DaskLink(address, 1, 60.0).open()


def test_doctor_knows_the_robots(capsys):
    assert main(["doctor", "--robot", "nope"]) == 2
    assert "nope" in capsys.readouterr().err


@pytest.mark.parametrize("text", ["0s", "0", "0.5s"])
def test_looking_without_a_pause_is_refused(text):
    with pytest.raises(argparse.ArgumentTypeError, match="look every 1s or less often"):
        interval(text)
    assert interval("1s") == 1.0


def test_queries_without_end_stop_at_a_bound(tmp_path):
    with Writer(tmp_path, "s") as writer:
        writer.append(records(1)[0])
    for sql in ("SELECT * FROM range(1000000000000)", "SELECT repeat('x', 100000) FROM range(100000000)"):
        with pytest.raises(StoreError, match=r"rows or 512 MiB are fetched at most. Ask for fewer with WHERE or LIMIT"):
            query(tmp_path, sql)
    assert len(query(tmp_path, "SELECT * FROM range(1000000000000) LIMIT 7")) == 7
