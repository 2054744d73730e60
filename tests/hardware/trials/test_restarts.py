"""A Khepera that restarts in mid drive: its wheels stop, its counters begin again at zero, and the trial says so."""

import pytest

from bns.hardware.link.hardware_log import events
from bns.hardware.wheels.khepera import KheperaIII
from bns.trial.folder import past_evaluations

from .calls import call, faults, journal_of


@pytest.mark.parametrize("silent_s", [0.05, 0.3, 2.0])
@pytest.mark.parametrize(("at_s", "kept"), [(4.0, 0), (13.0, 1)])
def test_a_restart_is_told_as_such_and_its_drive_is_not_kept(tmp_path, capsys, silent_s, at_s, kept):
    drives = tmp_path / "commands.csv"
    drives.write_text("trial,left_m_s,right_m_s,duration_s\n" + "1,0.06,0.1,1\n" * 6 + "2,0.06,0.1,1\n" * 6)
    asked = ["trial", "--robot", "khepera", "--emulated", "--yes", "--speed", "inf", "--results", tmp_path, "--commands", drives]
    assert call(*asked, *faults(tmp_path, {"kind": "brown-out", "at_s": at_s, "for_s": silent_s})) == 3
    said = capsys.readouterr().err
    assert "the robot has restarted during the drive: its counters of the wheels began again at zero" in said
    assert "charge it" in said
    assert len(past_evaluations(journal_of(tmp_path))) == kept
    assert all(stop["confirmed"] for stop in events(journal_of(tmp_path), "stop"))
    assert call(*asked, "--resume") == 0
    assert len(past_evaluations(journal_of(tmp_path))) == 2


@pytest.mark.parametrize("after_s", [0.05, 0.4, 0.8])
def test_a_restart_soon_after_the_first_drive_began_is_seen(tmp_path, capsys, after_s):
    """Its counters were at zero before, too, and the next command has it drive on at once."""
    drives = tmp_path / "commands.csv"
    drives.write_text("trial,left_m_s,right_m_s,duration_s\n" + "1,0.06,0.1,0.3\n" * 4 + "1,0.06,0.1,2\n")
    asked = ["trial", "--robot", "khepera", "--emulated", "--yes", "--speed", "inf", "--commands", drives]
    assert call(*asked, "--results", tmp_path / "first") == 0
    began_s = next(iter(events(journal_of(tmp_path / "first"), "command")))["t_s"]
    plan = faults(tmp_path, {"kind": "brown-out", "at_s": began_s + after_s, "for_s": 0.001})
    assert call(*asked, "--results", tmp_path / "second", *plan) == 3
    assert "the robot has restarted during the drive: its counters of the wheels began again at zero" in capsys.readouterr().err


def test_counters_that_leap_where_no_restart_brings_them_are_not_called_a_restart(tmp_path, capsys, monkeypatch):
    drives = tmp_path / "commands.csv"
    drives.write_text("trial,left_m_s,right_m_s,duration_s\n1,0.06,0.1,1\n")
    asked = ["trial", "--robot", "khepera", "--emulated", "--yes", "--speed", "inf", "--results", tmp_path, "--commands", drives]
    answers = iter([(100.0, 100.0)])  # before the drive
    monkeypatch.setattr(KheperaIII, "encoders_m", lambda _self: next(answers, (4.6e6, -4.6e6)))
    assert call(*asked) == 3
    said = capsys.readouterr().err
    assert "the counters of the robot's wheels leapt by 4600100.0 m during the drive" in said
    assert "restarted" not in said
    assert not past_evaluations(journal_of(tmp_path))


@pytest.mark.parametrize("kind", ["hang-up", "bus-fault"])
def test_a_robot_that_was_away_has_not_restarted(tmp_path, capsys, kind):
    drives = tmp_path / "commands.csv"
    drives.write_text("trial,left_m_s,right_m_s,duration_s\n" + "1,0.06,0.1,1\n1,-0.06,-0.1,1\n" * 3)
    asked = ["trial", "--robot", "khepera", "--emulated", "--yes", "--speed", "inf", "--results", tmp_path, "--commands", drives]
    assert call(*asked, *faults(tmp_path, {"kind": kind, "at_s": 4.0, "for_s": 1.5})) == 3
    assert "the robot was lost" in capsys.readouterr().err


@pytest.mark.parametrize("back", ["-0.08,-0.08,1", "-0.2,-0.2,0.4", "-0.05,-0.05,1.6"])
def test_a_robot_that_drives_back_to_where_its_counters_were_at_zero_has_not_restarted(tmp_path, back):
    """Its speed is asked for in longer commands alone: what it told is no way."""
    drives = tmp_path / "commands.csv"
    drives.write_text("trial,left_m_s,right_m_s,duration_s\n" + f"1,0.2,0.2,0.4\n1,{back}\n" * 4)
    asked = ["trial", "--robot", "khepera", "--emulated", "--yes", "--speed", "inf", "--results", tmp_path, "--commands", drives]
    assert call(*asked) == 0
