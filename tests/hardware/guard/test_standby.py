"""Who stands by stops the robot where its guard is lost, whatever becomes of the trial."""

import os
import re
import signal
import socket
import subprocess
import time
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager
from types import SimpleNamespace

import pytest

from bns.errors import HardwareError
from bns.hardware.clock import RealClock
from bns.hardware.guard import client as guard_client
from bns.hardware.guard import process as guard_process
from bns.hardware.guard import standby as standby_process
from bns.hardware.guard.client import Guard

from .. import outlive
from ..robots_on_the_line import LINKS
from .held import HANGS_S, RECIPES, armed_guard, driver_of, moving, set_off, until, vanish


def test_a_trial_that_ends_leaves_no_guard(held):
    _, guard = held("serial")
    standby = guard._next.process
    assert guard.close()
    assert not os.path.lexists(guard.path)
    assert standby.returncode == 0


def test_a_guard_that_goes_on_after_its_trial_keeps_who_stands_by(tmp_path, held):
    """The port is away at the end of the trial; then the guard is killed, and the port comes back."""
    robot, guard, standby = moving(held)
    process = guard._process
    robot.line.cut()
    until(guard.tripped)
    assert not guard.close()
    assert guard.left == [process.pid, standby.process.pid]
    for each in (process, standby.process):
        each.returncode = None  # they are this test's to wait for
    os.kill(process.pid, signal.SIGKILL)
    assert process.wait(HANGS_S) == -signal.SIGKILL
    robot.plug_in()
    robot.until(False)
    assert standby.process.wait(HANGS_S) == 0
    assert outlive._events(tmp_path)[-1]["kind"] == "stopped"


def test_what_stands_by_is_not_needed_once_a_guard_that_went_on_has_stopped_the_robot(held):
    robot, guard, standby = moving(held)
    process = guard._process
    robot.line.cut()
    until(guard.tripped)
    assert not guard.close()
    for each in (process, standby.process):
        each.returncode = None
    robot.plug_in()
    robot.until(False)
    assert process.wait(HANGS_S) == 0
    assert standby.process.wait(HANGS_S) == 0


def test_what_stands_by_ends_even_if_it_was_stopped(held):
    _, guard = held("serial")
    standby = guard._next.process
    standby.send_signal(signal.SIGSTOP)
    assert guard.close()
    assert standby.returncode == -signal.SIGKILL


def test_what_stands_by_ends_when_the_trial_is_gone_and_the_guard_has_stopped_the_robot(tmp_path, held):
    robot, guard = held("serial")
    driver = driver_of("serial", guard, RealClock())
    guard.arm()
    set_off("serial", driver)
    robot.until(True)
    standby = guard._next
    vanish(guard)
    robot.until(False)
    assert standby.process.wait(HANGS_S) == 0
    assert [event["kind"] for event in outlive._events(tmp_path)] == ["tripped", "stopped"]
    assert outlive._events(tmp_path)[0]["guard"] == guard.process


@pytest.mark.parametrize("link", LINKS)
@pytest.mark.parametrize(
    ("signal_", "hangs", "why"),
    [
        (signal.SIGKILL, False, "are gone|was killed"),  # which of them it sees first
        (signal.SIGKILL, True, "the robot's guard was killed"),
        (signal.SIGSTOP, False, "the robot's guard was stopped"),
        (signal.SIGSTOP, True, "the robot's guard was stopped"),
    ],
)
def test_what_stands_by_stops_the_robot_where_nothing_comes_of_the_guard_and_the_trial(tmp_path, held, link, signal_, hangs, why):
    """The trial is killed as well, or does nothing."""
    robot, guard, standby = moving(held, link)
    os.kill(guard.process, signal_)
    if not hangs:
        vanish(guard)
    robot.until(False)
    until(lambda: outlive._events(tmp_path)[-1]["kind"] == "stopped")
    first = outlive._events(tmp_path)[0]
    assert re.search(why, first["why"])
    assert first["guard"] == standby.process.pid
    if hangs:
        assert standby.process.poll() is None  # it keeps the port, for a trial that may go on
        vanish(guard)
    assert standby.process.wait(HANGS_S) == 0


@pytest.mark.parametrize("signal_", [signal.SIGKILL, signal.SIGSTOP])
def test_a_trial_brings_in_a_new_process_where_guard_and_who_stands_by_are_lost(held, signal_):
    robot, guard, standby = moving(held)
    lost = [standby.process.pid, guard.process]  # in this order: else the first may have taken over before it is lost
    for process in lost:
        os.kill(process, signal_)
    until(lambda: guard.beat() or (guard.tripped() and guard.process not in lost))
    robot.until(False)
    assert guard._next.process.pid not in lost


def test_a_guard_that_is_lost_while_its_port_is_away_is_followed_by_one_that_waits_for_the_port(held):
    robot, guard, standby = moving(held)
    robot.line.cut()
    os.kill(guard.process, signal.SIGKILL)
    until(lambda: guard.beat() or guard.process == standby.process.pid)
    end_s = time.monotonic() + 0.5
    while time.monotonic() < end_s:
        guard.beat()
        time.sleep(0.01)
    robot.plug_in()
    robot.until(False)
    assert guard.process == standby.process.pid


@pytest.mark.parametrize("signal_", [signal.SIGKILL, signal.SIGSTOP])
def test_who_stands_by_is_replaced_when_it_was_killed_or_stopped(tmp_path, held, signal_):
    robot, guard, standby = moving(held)
    standby.process.send_signal(signal_)
    until(lambda: guard.beat() or guard._next.process.pid != standby.process.pid)
    assert guard.tripped() is None
    assert robot.moves()
    second = guard._next
    os.kill(guard.process, signal.SIGKILL)
    vanish(guard)
    robot.until(False)
    assert second.process.wait(HANGS_S) == 0
    assert outlive._events(tmp_path)[0]["guard"] == second.process.pid


def test_who_stands_by_and_did_not_run_takes_a_guard_that_lives_for_one_that_lives(tmp_path, held):
    robot, guard, standby = moving(held)
    standby.process.send_signal(signal.SIGSTOP)
    time.sleep(2 * standby_process._HANGS_S)
    standby.process.send_signal(signal.SIGCONT)
    time.sleep(10 * standby_process.TICK_S)
    assert guard.tripped() is None
    assert robot.moves()
    assert not outlive._events(tmp_path)


def test_who_stands_by_and_was_held_up_together_with_the_guard_takes_that_for_no_hang():
    """As on a computer that was frozen: nothing has come, for the guard did not run either."""
    (trial, control), (ends, watched) = socket.socketpair(), socket.socketpair()
    with trial, control, ends, watched, subprocess.Popen(["sleep", "60"]) as sleeper:
        standby = standby_process.Standby(sleeper.pid, control, watched)
        trial.send(b"a")
        standby._turn()
        standby._looked_s -= 5.0
        standby._lived_s -= 5.0
        standby._turn()
        assert not standby._why
        standby._lived_s -= 5.0  # now it did run
        standby._turn()
        assert standby._why == "the robot's guard hung"
        assert sleeper.wait(HANGS_S) == -signal.SIGKILL


def test_a_trial_kills_a_guard_that_was_stopped(held):
    """Before who stands by does."""
    robot, guard, standby = moving(held)
    stopped, guard._next = guard.process, None
    standby.end()
    os.kill(stopped, signal.SIGSTOP)
    until(lambda: guard.beat() or guard.tripped())
    robot.until(False)
    assert guard.process != stopped


def test_who_stands_by_and_was_stopped_is_not_waited_for(held):
    _, guard = held("serial")
    standby = guard._next
    os.kill(standby.process.pid, signal.SIGSTOP)
    began_s = time.monotonic()
    assert standby.first_word(4 * HANGS_S) == b""
    assert time.monotonic() - began_s < HANGS_S


@pytest.mark.parametrize("signal_", [signal.SIGKILL, signal.SIGSTOP])
def test_a_trial_that_can_start_no_process_any_more_ends_its_drive(held, monkeypatch, signal_):
    robot, guard, standby = moving(held)

    def fails(*_watched):
        raise OSError("too many open files")

    monkeypatch.setattr(guard_client._Process, "begun", fails)
    os.kill(standby.process.pid, signal_)
    until(lambda: guard.beat() or guard.tripped())
    assert guard.tripped() == "no process can be started that stands by for the robot's guard: too many open files"
    guard.beat()
    assert guard._next is None
    guard.stop_now()
    robot.until(False)


def test_a_guard_that_cannot_be_started_is_told_of(tmp_path, monkeypatch):
    def fails(*_watched):
        raise OSError("too many open files")

    monkeypatch.setattr(guard_client._Process, "begun", fails)
    (tmp_path / "port").touch()
    with pytest.raises(HardwareError, match=r"no process can be started that guards .*too many open files"):
        Guard(str(tmp_path / "port"), RECIPES["serial"], HANGS_S)


def test_a_trial_that_gets_no_new_guard_goes_on_to_say_that_its_port_is_gone(held, monkeypatch):
    _, guard, standby = moving(held)
    monkeypatch.setattr(Guard, "_adopted", lambda self, begun, _: bool(begun.end() or self._control.close()))
    os.kill(guard.process, signal.SIGKILL)
    until(lambda: guard.beat() or guard.tripped())
    for _ in range(5):
        time.sleep(guard_client._BEAT_S)
        guard.beat()
    assert guard.tripped() == "the guard of the robot's port had ended"
    assert standby.process.returncode is not None


@contextmanager
def beside_a_guard():
    """Sockets of who stands by for a process that sleeps; (trial's end, guard's end, what it is told, its answer)."""
    (trial, control), (ends, watched) = socket.socketpair(), socket.socketpair()
    with trial, control, ends, watched, subprocess.Popen(["sleep", "60"]) as sleeper, ThreadPoolExecutor(1) as pool:
        answer = pool.submit(standby_process.Standby(sleeper.pid, control, watched).lost)
        yield trial, ends, sleeper, answer
        sleeper.kill()


def test_a_guard_that_opens_a_port_may_take_long(monkeypatch):
    """A Bluetooth link is made then, in seconds; killed meanwhile, it would never come back."""
    monkeypatch.setattr(standby_process, "_HANGS_S", 0.2)
    with beside_a_guard() as (trial, ends, sleeper, answer):
        trial.send(b"a")
        ends.send(b"..o")
        time.sleep(1.0)
        assert not answer.done()
        assert sleeper.poll() is None
        ends.send(b".")
        assert answer.result(HANGS_S).why == "the robot's guard hung"


def test_a_guard_says_when_it_opens_and_loses_a_port(tmp_path):
    with armed_guard(tmp_path) as guard:
        sent = []
        guard._ends = SimpleNamespace(send=lambda what, *_: sent.append(what))
        with pytest.raises(OSError, match="none"):
            guard._plug()
        guard._lose()
        assert sent == [b"o", b"o"]


def test_a_guard_that_hangs_is_killed_by_who_stands_by():
    with beside_a_guard() as (trial, _, sleeper, answer):
        trial.send(b"a")
        assert answer.result(HANGS_S) == ("the robot's guard hung", True, False)
        assert sleeper.wait(HANGS_S) == -signal.SIGKILL


@pytest.mark.parametrize(
    ("said", "ended", "lost"),
    [
        (b"asg", b"", None),
        (b"a", b"d", ("the guard of the robot's port had ended", True, False)),
        (b"as", b"..d", ("the guard of the robot's port had ended", False, False)),
    ],
)
def test_what_stands_by_knows_whether_the_robot_may_move(said, ended, lost):
    with beside_a_guard() as (trial, ends, sleeper, answer):
        trial.send(said)
        time.sleep(0.2)
        if ended:
            ends.send(ended)
        assert answer.result(HANGS_S) == lost
        assert sleeper.poll() is None


def test_a_guard_gives_signs_of_life(tmp_path):
    with armed_guard(tmp_path) as guard:
        guard._lived_s = 0.0
        guard._ends = SimpleNamespace(send=lambda what, *_: sent.append(what))
        sent = []
        for _ in range(3):
            guard._turn(0.0)
        assert sent == [b"."]
        time.sleep(1.1 * guard_process.TICK_S)
        guard._turn(0.0)
        assert sent == [b".", b"."]


def test_a_robot_that_did_not_move_is_asked_to_stand_and_left_alone_where_both_are_killed(tmp_path, held):
    _, guard = held("serial")
    guard.arm()
    guard.still()
    standby = guard._next
    os.kill(guard.process, signal.SIGKILL)
    vanish(guard)
    assert standby.process.wait(HANGS_S) == 0
    assert outlive._events(tmp_path)[0]["kind"] == "tripped"
