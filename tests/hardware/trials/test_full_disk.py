"""Trials whose files cannot be written any more."""

import errno
import os
import resource
import subprocess
import sys
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

from bns.cli.main import main
from bns.errors import StopNotConfirmedError, TrialFileError
from bns.hardware.clock import EmulatedClock
from bns.hardware.link import hardware_log
from bns.hardware.link.hardware_log import HardwareLog, events
from bns.hardware.rig import shipped_rig
from bns.hardware.safety import Stopping
from bns.trial.folder import measurements_however_it_ends, past_evaluations
from bns.trial.session import TrialSetup, open_rig

from .. import soak

TRIAL = ["trial", "--robot", "khepera", "--emulated", "--yes", "--speed", "inf", *soak.QUICK, "--evaluations", "5"]


def journal_of(results):
    [journal] = (results / "trials").glob("*/journal.jsonl")
    return journal


def with_files_of_at_most(size, *arguments):
    return subprocess.run(
        [sys.executable, "-m", "bns", *map(str, arguments)], capture_output=True, text=True, check=False, timeout=600,
        preexec_fn=lambda: resource.setrlimit(resource.RLIMIT_FSIZE, (size, size)),
    )  # fmt: skip


@pytest.mark.slow
def test_a_full_disk_stops_the_robot_and_the_trial_is_gone_on_with(tmp_path, capsys):
    # First of all the kernels: a process that may write nothing long cannot keep what it compiles.
    assert main([*TRIAL[:-1], "1", "--results", str(tmp_path / "other")]) == 0
    asked, most = [*TRIAL, "--results", str(tmp_path)], int(2.5 * journal_of(tmp_path / "other").stat().st_size)
    done = with_files_of_at_most(most, *asked)
    assert done.returncode == 5, done.stderr
    journal = journal_of(tmp_path)
    [line] = done.stderr.splitlines()
    assert f"cannot write {journal}: File too large. The robot stands" in line
    assert "continue with --resume" in line
    assert journal.stat().st_size <= most
    before = past_evaluations(journal)  # whole: every line has its checksum
    assert 1 <= len(before) < 5
    assert main([*asked, "--resume"]) == 0, capsys.readouterr().err
    after = past_evaluations(journal)
    assert len(after) == 5
    for old, new in zip(before, after, strict=False):
        np.testing.assert_array_equal(old.poses, new.poses)


def test_results_that_cannot_be_stored_leave_a_trial_to_be_gone_on_with(tmp_path, capsys):
    (tmp_path / "journal").write_text("in the way of the store's own folder")
    asked = [*TRIAL, "--results", str(tmp_path)]
    assert main(asked) == 5
    said = capsys.readouterr().err
    assert str(tmp_path / "journal") in said
    assert "The robot stands" in said
    assert "continue with --resume" in said
    (tmp_path / "journal").unlink()
    driven = len(list(events(journal_of(tmp_path), "driven")))
    assert main([*asked, "--resume"]) == 0
    assert len(list(events(journal_of(tmp_path), "driven"))) == driven  # nothing is driven again


@pytest.fixture
def full(monkeypatch):
    """full(log) -> from now on nothing more can be written into it, after half of the next bytes."""

    def fill(log):
        write = os.write

        def half(descriptor, data):
            if descriptor != log._descriptor:
                return write(descriptor, data)
            if len(data) > 1:
                return write(descriptor, data[: len(data) // 2])
            raise OSError(errno.ENOSPC, "No space left on device")

        monkeypatch.setattr("bns.hardware.link.hardware_log.os.write", half)

    return fill


def test_a_log_that_is_full_says_so_and_stays_a_log(tmp_path, full, monkeypatch):
    path = tmp_path / "journal.jsonl"
    log = HardwareLog(path, EmulatedClock(np.inf))
    log.note("one", number=1)
    log.sync()
    full(log)
    log.note("two", number=2)
    with pytest.raises(TrialFileError, match=r"cannot write .*journal\.jsonl: No space left on device\. The robot stands"):
        log.sync()
    monkeypatch.undo()  # there is room again: what was lost between must not be passed over
    for _ in range(500):
        log.note("three", number=3)  # a driver that stops its robot notes it
    with pytest.raises(TrialFileError):
        log.check()
    with pytest.raises(TrialFileError):
        log.close()
    assert [event["kind"] for event in events(path)] == ["one"]
    with HardwareLog(path, EmulatedClock(np.inf)) as again:
        again.note("four")
    assert [event["kind"] for event in events(path)] == ["one", "four"]


@pytest.mark.parametrize("folder", [False, True])
def test_a_log_that_was_deleted_meanwhile_is_written_again_and_ends_the_trial(tmp_path, folder):
    path = tmp_path / "trials" / "journal.jsonl"
    log = HardwareLog(path, EmulatedClock(np.inf))
    log.note("one", number=1)
    log.sync()
    path.unlink()
    if folder:
        path.parent.rmdir()
    log.note("two", number=2)
    said = r"journal\.jsonl: it was deleted while the trial ran, .* Correct that, then continue with --resume\.$"
    with pytest.raises(TrialFileError, match=said):
        log.sync()
    with pytest.raises(TrialFileError):
        log.close()
    assert [event["kind"] for event in events(path)] == ["one", "two"]


def test_a_log_whose_place_another_file_took_leaves_that_alone(tmp_path):
    path = tmp_path / "journal.jsonl"
    log = HardwareLog(path, EmulatedClock(np.inf))
    log.note("one")
    path.unlink()
    path.write_text("somebody's")
    with pytest.raises(TrialFileError, match="File exists"):
        log.close()
    assert path.read_text() == "somebody's"


def test_a_log_that_is_full_is_no_lost_link(bench, full):
    on = bench()
    full(on.link._journal)
    for _ in range(300):
        on.driver.speed_m_s()
    with pytest.raises(TrialFileError):
        on.link._journal.check()
    stop = on.driver.stop()
    assert stop.confirmed
    with pytest.raises(TrialFileError):
        on.link._journal.close()


def test_a_drive_ends_at_the_next_look_when_the_log_is_full(tmp_path, full):
    how = TrialSetup(shipped_rig("khepera"), emulated=True, speed=np.inf, yes=True)
    journal, closed = tmp_path / "journal.jsonl", pytest.raises(TrialFileError)  # once more, at the end
    with closed, Stopping() as stopping, open_rig(how, 0, journal, stopping) as opened:
        began_s = opened.clock.now_s()
        full(opened.log)
        with pytest.raises(TrialFileError):
            opened.platform.drive(np.array([[500.0, 500.0, 60_000.0]], np.float32))
        assert opened.clock.now_s() - began_s < 1.5  # of the minute that was asked for; 0.6 s of it are looks before and after
        assert opened.platform.stop().confirmed


def test_a_log_learns_within_a_moment_that_its_disk_takes_nothing_more(tmp_path, full):
    """However little is noted: a robot is driving."""
    clock = EmulatedClock(np.inf)
    log = HardwareLog(tmp_path / "journal.jsonl", clock)
    log.note("one")
    full(log)
    clock.sleep(0.2)
    log.note("two")
    with pytest.raises(TrialFileError, match="No space left on device"):
        log.check()
    with pytest.raises(TrialFileError):
        log.close()


@pytest.mark.skipif(not Path("/dev/full").exists(), reason="a device of Linux")
def test_the_exit_code_is_told_where_nothing_can_be_said(tmp_path):
    """Outputs may lie on the disk that is full."""
    rig = tmp_path / "rig.yaml"
    rig.write_text("nothing")
    with open("/dev/full", "w") as full:  # noqa: PTH123  # of no other use
        asked = [sys.executable, "-m", "bns", "trial", "--robot", "khepera", "--rig", rig, "--results", tmp_path]
        assert subprocess.run(asked, stdout=full, stderr=full, check=False, timeout=600).returncode == 2


@pytest.mark.skipif(not Path("/dev/full").exists(), reason="a device of Linux")
@pytest.mark.parametrize(
    ("streams", "kept"), [(("stdout",), 2), (("stderr",), 0), (("stdout", "stderr"), 0)], ids=["report", "notes", "both"]
)
@pytest.mark.slow
def test_a_trial_whose_outputs_cannot_be_written_does_not_say_that_nothing_has_moved(tmp_path, streams, kept):
    """A note is told after the first drive."""
    drives = tmp_path / "commands.csv"
    drives.write_text("trial,left_m_s,right_m_s,duration_s\n1,0.005,0.005,1\n2,0.005,0.005,1\n")
    asked = [sys.executable, "-m", "bns", "trial", "--robot", "khepera", "--emulated", "--yes", "--speed", "inf"]
    with open("/dev/full", "w") as full:  # noqa: PTH123  # of no other use
        outputs = {"stdout": subprocess.PIPE, "stderr": subprocess.PIPE} | dict.fromkeys(streams, full)
        done = subprocess.run(
            [*asked, "--results", tmp_path, "--commands", drives], **outputs, text=True, check=False, timeout=600
        )
    assert done.returncode == 5
    assert len(past_evaluations(journal_of(tmp_path))) == kept
    if "stderr" not in streams:
        assert "cannot write the output: No space left on device. The robot stands still" in done.stderr


def test_what_a_trial_ended_with_is_not_hidden_by_its_tables(tmp_path, monkeypatch, capsys):
    def nothing(*_):
        raise TrialFileError("cannot write the table")

    monkeypatch.setattr("bns.trial.folder.keep_measurements", nothing)
    with pytest.raises(StopNotConfirmedError), measurements_however_it_ends(tmp_path / "journal.jsonl", ()):
        raise StopNotConfirmedError("CUT THE POWER")
    assert "cannot write the table" in capsys.readouterr().err
    with pytest.raises(TrialFileError), measurements_however_it_ends(tmp_path / "journal.jsonl", ()):
        pass


def test_a_log_says_how_long_its_disk_has_held_up_whoever_noted_something(tmp_path, monkeypatch):
    now_s, takes_s, written = [0.0], [0.1], os.write

    def write(descriptor, data):
        now_s[0] += takes_s[0]
        return written(descriptor, data)

    monkeypatch.setattr(hardware_log, "time", SimpleNamespace(monotonic=lambda: now_s[0], time=lambda: 0.0))
    monkeypatch.setattr(hardware_log.os, "write", write)
    with HardwareLog(tmp_path / "journal.jsonl", EmulatedClock(np.inf)) as log:
        log.note("one")
        log.sync()
        assert log.held_up_s == 0.0
        takes_s[0] = 7.0
        log.note("two")
        log.sync()
        assert log.held_up_s == 7.0
        takes_s[0] = 0.1


def test_a_stop_that_a_hanging_disk_held_up_is_confirmed_all_the_same(bench):
    """The patience with the robot does not run out meanwhile."""
    rig = bench()
    rig.driver.set_speed_m_s(0.1, 0.1)
    journal = rig.driver._journal
    note = journal.note

    def hangs(kind, **what):
        journal.note = note
        rig.clock.sleep(20.0)
        journal.held_up_s += 20.0
        note(kind, **what)

    journal.note = hangs
    assert rig.driver.stop().confirmed
