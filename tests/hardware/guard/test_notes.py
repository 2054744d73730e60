"""What a guard did stands in a file, and no disk that hangs holds up a guard."""

import os
import signal
import time
from types import SimpleNamespace

import pytest

from bns.hardware.clock import RealClock
from bns.hardware.guard.client import Guard
from bns.hardware.guard.notes import Notes

from .. import outlive
from ..robots_on_the_line import Robot
from .held import HANGS_S, RECIPES, armed_guard, driver_of, set_off, trial_dies, until, vanish


def test_there_is_a_file_once_there_is_a_line_and_lines_are_added_to_it(tmp_path):
    file = tmp_path / "it's a guard's $HOME.jsonl"
    idle = Notes(str(file))
    idle.close()
    assert not file.exists()
    for lines in ((b"one\n",), (b"two\\n\n", b"%s three\n")):
        notes = Notes(str(file))
        for line in lines:
            notes.write(line)
        notes.close()
    assert file.read_bytes() == b"one\ntwo\\n\n%s three\n"


def test_a_guard_without_a_file_or_without_a_program_that_writes_says_nothing(tmp_path, monkeypatch):
    def fails(*_command, **_more):
        raise OSError("no more processes")

    monkeypatch.setattr(os, "posix_spawn", fails)
    for notes in (Notes(None), Notes(str(tmp_path / "guard.jsonl"))):
        notes.write(b"nothing\n")
        notes.close()
    assert not list(tmp_path.iterdir())


def test_lines_that_nobody_takes_hold_nobody_up(tmp_path):
    os.mkfifo(tmp_path / "hangs")
    notes = Notes(str(tmp_path / "hangs"))
    for _ in range(100):
        notes.write(b"x" * 4095 + b"\n")
    writer = notes._writer
    notes.close()
    os.kill(writer, signal.SIGKILL)
    os.waitpid(writer, 0)


@pytest.mark.parametrize("lost", ["trial", "guard", "both"])
def test_a_robot_is_stopped_where_the_disk_of_the_results_hangs(tmp_path, lost):
    robot = Robot("serial", tmp_path)
    os.mkfifo(tmp_path / "hangs")
    guard = Guard(str(robot.path), RECIPES["serial"], HANGS_S, tmp_path / "hangs")
    guard.arm()
    set_off("serial", driver_of("serial", guard, RealClock()))
    robot.until(True)
    if lost != "trial":
        os.kill(guard.process, signal.SIGKILL)
    if lost == "trial":
        trial_dies(guard)
    elif lost == "both":
        vanish(guard)
    else:
        until(lambda: guard.beat() or guard.tripped())
    robot.until(False)
    if lost == "guard":
        guard.still()
        guard.close()
    processes = [guard._process, *([guard._next.process] if lost == "both" else [])]
    with (tmp_path / "hangs").open(encoding="utf-8") as read:  # the writers end
        assert "tripped" in read.readline()
    for process in processes:
        process.wait(HANGS_S)
    robot.close()


def test_a_trial_that_is_gone_does_not_take_its_robot_back(tmp_path):
    """Its own order to stop may be among the last bytes that it wrote: that it arrives is not known."""
    near, far = os.pipe()
    os.write(far, b"D,l0,l0\n")
    with armed_guard(tmp_path) as guard:
        sent = []
        guard._line = SimpleNamespace(near=near, to_robot=lambda data: sent.append(data) or True)
        guard._gone = True
        guard._trip("the trial's process is gone")
        guard._from_driver()
        assert guard.why
        assert not sent
        guard._gone = False
        os.write(far, b"D,l0,l0\n")
        guard._from_driver()
        assert not guard.why
        assert sent == [b"D,l0,l0\n"]
    os.close(near)
    os.close(far)


def test_a_guard_is_needed_as_long_as_its_robot_may_move(tmp_path):
    with armed_guard(tmp_path) as guard:
        assert not guard.needless
        guard._done = True
        assert guard.needless
        guard._done = guard._armed = False
        assert guard.needless


def test_the_events_of_a_guard_are_all_in_its_file_when_it_has_ended(tmp_path, held):
    robot, guard = held("serial")
    guard.arm()
    set_off("serial", driver_of("serial", guard, RealClock()))
    robot.until(True)
    began_s = time.monotonic()
    trial_dies(guard)
    assert guard._process.wait(HANGS_S) == 0
    assert [event["kind"] for event in outlive._events(tmp_path)] == ["tripped", "stopped"]
    assert time.monotonic() - began_s < HANGS_S
