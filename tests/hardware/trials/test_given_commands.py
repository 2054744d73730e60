"""Trials of commands that a file gives."""

import numpy as np
import pandas as pd
import pytest

from bns.errors import HardwareError
from bns.hardware.clock import EmulatedClock
from bns.hardware.link.hardware_log import HardwareLog
from bns.robots import load_robot
from bns.trial.experiment import _driven_before, read_commands

from .calls import call, faults


def test_given_commands_are_driven_and_measured(tmp_path, capsys):
    file = tmp_path / "proposed.csv"
    file.write_text("trial,left_m_s,right_m_s,duration_s\n1,0.1,0.1,1.0\n1,0.05,0.1,0.5\n2,0.15,0.1,2.0\n")
    asked = ["trial", "--robot", "khepera", "--emulated", "--yes", "--speed", "inf", "--results", tmp_path]
    assert call(*asked, "--commands", file) == 0
    assert "2 trials driven" in capsys.readouterr().out
    table = pd.read_csv(tmp_path / "trials" / "experiment-proposed-emulated" / "measurements.csv")
    assert table["trial"].unique().tolist() == [1, 2]
    first = table[table["trial"] == 1]
    assert first["y_m"].iloc[-1] - first["y_m"].iloc[0] == pytest.approx(0.13, abs=0.02)
    assert call(*asked, "--commands", file) == 2
    assert "already; resume it with --resume, move it away" in capsys.readouterr().err


def test_speeds_that_the_firmware_does_not_regulate_are_told_once(tmp_path, capsys):
    file = tmp_path / "slow.csv"
    file.write_text("trial,left_m_s,right_m_s,duration_s\n1,0.02,0.02,1\n2,0.0,0.02,1\n3,0.013,0.02,1\n4,0.02,-0.01,1\n")
    asked = ["trial", "--robot", "khepera", "--emulated", "--yes", "--speed", "inf", "--results", tmp_path]
    assert call(*asked, "--commands", file) == 0
    told = [line for line in capsys.readouterr().err.splitlines() if "does not regulate" in line]
    assert len(told) == 1
    assert told[0].startswith("evaluation 3: some commands are slower than 0.014 m/s, which the robot's firmware does not")


def test_given_commands_are_gone_on_with(tmp_path, capsys):
    file = tmp_path / "proposed.csv"
    file.write_text("trial,left_m_s,right_m_s,duration_s\n" + "".join(f"{n},0.1,0.08,3.0\n" for n in range(1, 5)))
    asked = ["trial", "--robot", "khepera", "--emulated", "--yes", "--speed", "inf", "--results", tmp_path, "--commands", file]
    assert call(*asked, "--resume") == 2
    assert "nothing to resume" in capsys.readouterr().err
    assert call(*asked, *faults(tmp_path, {"kind": "hang-up", "at_s": 6, "for_s": 2})) == 3
    table = tmp_path / "trials" / "experiment-proposed-emulated" / "measurements.csv"
    assert 1 <= pd.read_csv(table)["trial"].max() < 4
    assert call(*asked, "--resume") == 0
    assert pd.read_csv(table)["trial"].unique().tolist() == [1, 2, 3, 4]
    journal = table.with_name("journal.jsonl")
    whole = journal.read_bytes()
    for lines in (0, 2):
        journal.write_bytes(b"".join(whole.splitlines(keepends=True)[:lines]))
        assert call(*asked, "--resume") == 2
        assert "has lost its last lines, or was cut: it holds 0 rows" in capsys.readouterr().err
    journal.write_bytes(whole)
    file.write_text("trial,left_m_s,right_m_s,duration_s\n1,0.1,0.1,3.0\n")
    assert call(*asked, "--resume") == 2
    assert "drove other commands than the file holds now" in capsys.readouterr().err


def test_given_commands_start_where_the_file_says(tmp_path, capsys):
    file, names = tmp_path / "proposed.csv", "trial,left_m_s,right_m_s,duration_s,start_x_m,start_y_m,start_heading_rad"
    file.write_text(f"{names}\n1,0.1,0.1,0.5,0.3,-0.2,0.0\n2,0.1,0.1,0.5,-0.3,0.1,1.5\n")
    asked = ["trial", "--robot", "khepera", "--emulated", "--yes", "--speed", "inf", "--results", tmp_path, "--commands", file]
    assert call(*asked) == 0
    table = pd.read_csv(tmp_path / "trials" / "experiment-proposed-emulated" / "measurements.csv")
    first = table.groupby("trial")[["x_m", "y_m", "heading_rad"]].first()
    np.testing.assert_allclose(first, [[0.3, -0.2, 0.0], [-0.3, 0.1, 1.5]], atol=0.12)
    file.write_text(f"{names}\n1,0.1,0.1,0.5,3.0,0.0,0.0\n")
    assert call(*asked[:-1], file.rename(tmp_path / "far.csv")) == 2
    assert "starts a trial at (3.00, 0.00) m, off the surface x -0.9 to 0.9 m" in capsys.readouterr().err


def test_an_experiment_that_could_not_begin_is_none(tmp_path, capsys):
    file, rig = tmp_path / "proposed.csv", tmp_path / "rig.yaml"
    file.write_text("trial,left_m_s,right_m_s,duration_s\n1,0.1,0.1,1.0\n")
    rig.write_text(
        "robot: khepera\nport: /dev/nowhere\nsurface_m: {x: [-1, 1], y: [-1, 1]}\n"
        "tracker: {kind: wii, device: x, height_m: 2.4, view_rad: 0.75}\n"
    )
    for _ in range(2):
        assert call("trial", "--robot", "khepera", "--rig", rig, "--commands", file, "--results", tmp_path) == 2
        assert "there is no port /dev/nowhere" in capsys.readouterr().err


def test_a_filmed_robot_is_seen_where_it_is_at_any_speed(tmp_path):
    file, rig = tmp_path / "straight.csv", tmp_path / "rig.yaml"
    file.write_text("trial,left_m_s,right_m_s,duration_s\n1,0.1,0.1,2.0\n")
    rig.write_text(
        "robot: khepera\nport: x\nsurface_m: {x: [-0.9, 0.9], y: [-0.7, 0.7]}\n"
        "tracker: {kind: colour, camera: 0, calibration: x, diameter_m: 0.04, height_m: 0.07, distance_m: 0.1}\n"
    )
    asked = ["trial", "--robot", "khepera", "--emulated", "--yes", "--speed", "inf", "--results", tmp_path]
    assert call(*asked, "--rig", rig, "--commands", file) == 0
    table = pd.read_csv(tmp_path / "trials" / "experiment-straight-emulated" / "measurements.csv")
    under_way = table[table["t_s"].between(0.6, 1.9)]
    speed_m_s = np.polyfit(under_way["t_s"], under_way["y_m"], 1)[0]
    assert speed_m_s == pytest.approx(0.1, abs=0.005)
    assert np.abs(under_way["y_m"] - np.polyval(np.polyfit(under_way["t_s"], under_way["y_m"], 1), under_way["t_s"])).max() < 0.01


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("trial,left_m_s,right_m_s\n1,0.1,0.1\n", "lacks the column duration_s"),
        ("trial;left_m_s;right_m_s;duration_s\n1;0,1;0,1;1\n", "is separated by semicolons; separate the columns by commas"),
        ("trial,left_m_s,right_m_s,duration_s\n1,0.1,0.1,1\n1,9,0.1,1\n", "line 3 of"),
        ("trial,left_m_s,right_m_s,duration_s\n1,0.1,x,1\n", "line 2 of"),
        ("", "is no table of comma-separated values. Commands of a khepera are a CSV file with trial"),
        ("a: 1\nb: 2\nc, d, e\n", "is no table of comma-separated values. Commands of a khepera are a CSV file with trial"),
    ],
)
def test_bad_commands_are_named_before_anything_moves(tmp_path, capsys, text, message):
    file = tmp_path / "bad.csv"
    file.write_text(text)
    asked = ["trial", "--robot", "khepera", "--emulated", "--results", tmp_path, "--commands", file]
    assert call(*asked) == 2
    assert message in capsys.readouterr().err
    assert not (tmp_path / "trials").exists()


NAMES, STARTS = "trial,left_m_s,right_m_s,duration_s", "start_x_m,start_y_m,start_heading_rad"


def test_a_trial_starts_where_its_first_line_says(tmp_path):
    file = tmp_path / "two.csv"
    file.write_text(f"{NAMES},{STARTS}\n1,0.1,0.1,1,0.2,0.1,0\n1,0.1,0.1,1,-0.5,-0.5,1\n2,0.1,0.1,1,0.3,0,0\n")
    trials = read_commands(file, load_robot("khepera"))
    assert [len(commands) for commands, _ in trials] == [2, 1]
    np.testing.assert_array_equal([start for _, start in trials], [[0.2, 0.1, 0.0], [0.3, 0.0, 0.0]])


def test_a_line_without_a_start_is_named_by_its_number_in_the_file(tmp_path):
    file = tmp_path / "gap.csv"
    file.write_text(f"{NAMES},{STARTS}\n1,0.1,0.1,1,0,0,0\n2,0.1,0.1,1,,0,0\n")
    with pytest.raises(HardwareError, match=r"^line 3 of .* has no number for each of start_x_m"):
        read_commands(file, load_robot("khepera"))


def test_commands_may_be_as_large_as_the_robot_s_limits(tmp_path):
    robot, file = load_robot("khepera"), tmp_path / "limits.csv"
    rows = [[trial, *(limit[side] for limit in robot.given_columns.values())] for trial, side in ((1, 0), (2, 1))]
    pd.DataFrame(rows, columns=["trial", *robot.given_columns]).to_csv(file, index=False)
    assert len(read_commands(file, robot)) == 2


def test_an_experiment_that_is_complete_is_resumed_with_nothing_left_to_drive(tmp_path):
    journal, commands = tmp_path / "journal.jsonl", np.array([[12000.0, 9000.0, 900.0]], np.float32)
    with HardwareLog(journal, EmulatedClock(np.inf)) as log:
        given = commands.tolist()
        log.note("driven", evaluation=1, picked=given, commands=given, poses=np.zeros((2, 3)).tolist(), rows=[])
    assert _driven_before(journal, [commands], resume=True) == 1
    with pytest.raises(HardwareError, match="drove other commands than the file holds now"):
        _driven_before(journal, [], resume=True)
