"""Commands of 0 for a moment, between two that are alike: as in the logs of the iRobot Create robots of UTIAS MRCLAM."""

import numpy as np
import pandas as pd
import pytest

from bns.diagnose.data.apply_mapping import applied
from bns.diagnose.data.checks import checked, rows_by_trial
from bns.diagnose.data.guess.mapping import guessed
from bns.diagnose.data.mapping import load_mapping
from bns.diagnose.data.odd_commands import lost_commands
from bns.errors import DataError

STEP_S = 0.01


def log(zeros, after=0.058, trials=("a", "b")):
    """Two trials of 10 s at 0.057 m/s; ``zeros``: how many moments without a command in the second, each of how many rows."""
    count, rows = zeros
    parts = []
    for name in trials:
        speed = np.full(1000, 0.057)
        if name == "b":
            for moment in range(count):
                begin = 100 + 80 * moment
                speed[begin : begin + rows] = 0.0
                speed[begin + rows : begin + 40] = after
        t = STEP_S * np.arange(1000)
        parts.append(pd.DataFrame({"trial": name, "t_s": t, "left_m_s": speed, "right_m_s": speed, "x_m": 0.057 * t}))
    return pd.concat(parts, ignore_index=True).assign(y_m=0.0, heading_rad=0.0)


def told(table):
    return lost_commands(table, rows_by_trial(table))


@pytest.mark.parametrize("rows", [1, 5])
def test_moments_without_a_command_are_told_with_the_way_that_they_take(rows):
    row, text = told(log((8, rows)))
    assert row == 1100
    assert f"8 times both commands are 0 for {10 * rows} to {10 * rows} ms" in text
    share = 8 * rows * STEP_S * 0.057 / (20 * 0.057)
    assert f"the first time here: {share:.1%} of the way" in text


@pytest.mark.parametrize(
    "table",
    [log((2, 2)), log((8, 9)), log((8, 2), after=0.064), log((8, 2), after=-0.057), log((0, 0))],
    ids=["twice", "long enough to follow", "then faster", "then back", "none"],
)
def test_commands_that_may_be_meant_are_not(table):
    assert told(table) is None


def test_a_moment_of_another_speed_is_not():
    table = log((8, 2))
    table[["left_m_s", "right_m_s"]] = table[["left_m_s", "right_m_s"]].replace(0.0, 0.03)
    assert told(table) is None


def test_moments_that_take_hardly_any_way_are_not_told():
    table = log((8, 2))
    assert told(table) is not None
    fast = table.assign(**{name: table[name].where(table["trial"] == "b", 20.0) for name in ("left_m_s", "right_m_s")})
    assert told(fast) is None


def test_they_are_found_in_a_log_and_change_nothing():
    table = log((8, 2))
    table.loc[3, "t_s"] = table.loc[2, "t_s"]  # a row that is left out does not shift the others' numbers
    usable, findings = checked(table)
    assert [(one.trial, one.row) for one in findings if "both commands are 0" in one.text] == [("b", 1100)]
    assert usable[["left_m_s", "right_m_s"]].equals(table.loc[usable.index, ["left_m_s", "right_m_s"]])


def test_rows_without_a_command_hold_the_last_one():
    table = log((8, 2))
    empty = table.index % 5 == 4
    table.loc[empty, ["left_m_s", "right_m_s"]] = np.nan
    assert "8 times" in told(table)[1]


def test_the_command_before_can_be_put_in_their_place():
    table = log((8, 2))
    held = applied(table, {"columns": {}, "lost_commands": "held"})
    assert (held[["left_m_s", "right_m_s"]] > 0).all(axis=None)
    lost = table["left_m_s"] == 0
    assert held.loc[~lost].equals(applied(table, {"columns": {}}).loc[~lost])
    assert set(held.loc[lost, "left_m_s"]) == {0.057}  # and not 0.058, which comes after
    stops = log((8, 9))
    assert applied(stops, {"columns": {}, "lost_commands": "held"}).equals(applied(stops, {"columns": {}}))


def test_the_mapping_knows_the_words(tmp_path):
    (tmp_path / "m.yaml").write_text("columns: {}\nlost_commands: drop\n")
    with pytest.raises(DataError, match=r"m\.yaml, line 2: unknown word for lost_commands 'drop'. Valid: held, kept"):
        load_mapping(tmp_path / "m.yaml")


@pytest.mark.parametrize("wrong", [{"left_m_s": "fast"}, {}])
def test_columns_that_are_lacking_or_no_numbers_are_left_to_the_checks(wrong):
    table = log((8, 2)).drop(columns="left_m_s").assign(**wrong)
    assert applied(table, {"columns": {}, "lost_commands": "held"}).equals(applied(table, {"columns": {}}))


@pytest.mark.parametrize("zeros", [(8, 2), (2, 2)])
def test_a_proposal_keeps_the_command_before_in_force(zeros):
    table = log(zeros, trials=("b",)).rename(columns={"t_s": "time [ms]", "left_m_s": "v", "x_m": "x", "y_m": "y"})
    table = table.assign(**{"time [ms]": 1e3 * table["time [ms]"], "w": 0.0}).drop(columns=["right_m_s", "trial"])
    guess = guessed(table)
    assert {"forward_m_s", "turn_rad_s"} <= set(guess.mapping["columns"])
    assert guess.mapping.get("lost_commands") == ("held" if zeros[0] == 8 else None)
    assert any("8 times both commands are 0 for a moment" in said for said in guess.remarks) == (zeros[0] == 8)


def test_a_proposal_looks_at_each_trial_by_itself():
    """Times begin again in each: one trial's stand lies between another's commands."""
    table = log((0, 0), trials=tuple("abcd"))
    stands = table["trial"].isin(["b", "c"])
    table.loc[stands, ["left_m_s", "right_m_s"]] = 0.0
    table.loc[stands, "t_s"] += 0.003
    assert "lost_commands" not in guessed(table).mapping
    assert guessed(log((8, 2))).mapping["lost_commands"] == "held"
