"""A robot does not outlive its supervisor, on any link; `python -m tests.hardware.outlive 20` measures."""

import fcntl
import itertools
import json
import os
import re
import shutil
import signal
import socket
import subprocess
import sys
import time
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace

import pytest

from bns.errors import HardwareError, TrialPausedError
from bns.hardware.clock import RealClock
from bns.hardware.emulators.devices.terminal import PseudoTerminal
from bns.hardware.guard import client as guard_client
from bns.hardware.guard import process as guard_process
from bns.hardware.guard import signs
from bns.hardware.guard import standby as standby_process
from bns.hardware.guard.client import Guard, GuardedClock, GuardedPlatform
from bns.hardware.guard.holder import CODE
from bns.hardware.guard.order import StopOrder
from bns.hardware.guard.recipe import bridge_recipe, bus_recipe, khepera_recipe
from bns.hardware.link.hardware_log import HardwareLog
from bns.hardware.link.serial_link import NoReplyError, SerialLink
from bns.hardware.rig import shipped_rig
from bns.hardware.safety import Stopping
from bns.hardware.servos.bridge import BridgeChain
from bns.hardware.servos.dynamixel import DynamixelChain
from bns.hardware.stop import Stop
from bns.hardware.wheels.khepera import BAUD, KheperaIII
from bns.trial.session import TrialSetup, open_rig

from .. import outlive
from ..robots_on_the_line import LINKS, ManualRobot, Robot

HANGS_S = 30.0
RECIPES = {
    "serial": khepera_recipe(BAUD, 720),
    "bus": bus_recipe(range(1, 13)),
    "bridge": bridge_recipe(115200, 12),
}


@pytest.fixture(scope="module")
def nursery():
    found = outlive.Nursery()
    yield found
    found.close()


@pytest.fixture
def held(tmp_path):
    """held(link) -> a robot and its guard, in this process."""
    opened = []

    def build(link, silent_s=HANGS_S):
        robot = Robot(link, tmp_path)
        guard = Guard(str(robot.path), RECIPES[link], silent_s, tmp_path / "guard.jsonl")
        opened.append((robot, guard))
        return robot, guard

    yield build
    for robot, guard in opened:
        if guard._control.fileno() >= 0:
            guard.still()
            guard.close()
        else:  # the trial has vanished
            guard._process.kill()
            guard._process.wait(HANGS_S)
        robot.close()


def driver_of(link, guard, clock):
    journal = HardwareLog(None, clock)
    if link == "serial":
        return KheperaIII(SerialLink(guard.path, BAUD, clock, journal), clock, journal)
    if link == "bus":
        return DynamixelChain(guard.path, range(1, 13), clock, journal)
    return BridgeChain(guard.path, 12, clock, journal)


def set_off(link, driver):
    if link == "serial":
        driver.set_speed_m_s(0.1, 0.08)
    else:
        driver.arm()
        driver.move([0.5] * 12, [1.0] * 12)


def until(true):
    end_s = time.monotonic() + HANGS_S
    while not true():
        assert time.monotonic() < end_s
        time.sleep(0.01)


def trial_dies(guard):
    guard._control.close()
    guard._watch.close()
    guard._next.end()


@pytest.mark.parametrize(("link", "kind"), [*((link, Robot) for link in LINKS), ("serial", ManualRobot), ("bus", ManualRobot)])
def test_a_robot_stands_when_its_trial_is_killed(tmp_path, nursery, link, kind):
    seen = outlive.outlived(nursery, link, "SIGKILL", tmp_path, kind=kind, patient=True)
    assert seen.ended == -signal.SIGKILL
    assert [e["kind"] for e in seen.events] == ["tripped", "stopped"]
    assert seen.events[0]["why"] == "the trial's process is gone"


@pytest.mark.parametrize(
    ("cause", "link", "why"),
    [
        ("SIGSTOP", "bus", "the trial's process was stopped"),
        ("hang", "serial", "the trial gave no sign of life for "),
    ],
)
def test_a_robot_stands_when_its_trial_is_there_and_does_nothing(tmp_path, nursery, cause, link, why):
    seen = outlive.outlived(nursery, link, cause, tmp_path, patient=cause != "hang")
    assert seen.events[0]["why"].startswith(why)
    if cause == "hang":  # at least: a busy computer looks later
        said, allowed_s = seen.events[0]["why"].removeprefix(why), shipped_rig("khepera").limits.silent_s
        assert float(said.split()[0]) >= allowed_s
        assert said.endswith(f" s (the rig's silent_s allows {allowed_s:g} s)")
    assert "stopped" in [e["kind"] for e in seen.events]


@pytest.mark.parametrize(
    ("cause", "link", "why"),
    [
        ("camera frozen (scene)", "serial", "the picture shows no motion"),
        ("camera frozen (scene)", "bus", "same picture again and again|the picture shows both markers where they were"),
    ],
)
def test_a_camera_that_hangs_under_a_running_clock_pauses_the_trial(tmp_path, nursery, cause, link, why):
    seen = outlive.outlived(nursery, link, cause, tmp_path, patient=True)
    assert seen.ended == 3
    assert re.search(why, seen.said)


@pytest.mark.parametrize("link", ["serial", "bridge"])
def test_a_camera_that_sends_its_last_picture_again_stops_the_robot(tmp_path, nursery, link):
    seen = outlive.outlived(nursery, link, "camera frozen (bits)", tmp_path, patient=True)
    assert seen.ended == 0  # the drive is over before its commands are
    assert seen.events == []


def test_a_guard_has_the_patience_of_its_rig(tmp_path, monkeypatch):
    class EnoughError(Exception):
        pass

    def begun(port, recipe, silent_s, log, gives_up_s):
        raise EnoughError(port, silent_s, log, gives_up_s)

    monkeypatch.setattr("bns.trial.session.Guard", begun)
    shipped = shipped_rig("khepera")
    rig = replace(shipped, port="/dev/pts/x", limits=replace(shipped.limits, silent_s=0.7, gives_up_s=50.0))
    how, journal = TrialSetup(rig, yes=True), tmp_path / "journal.jsonl"
    with pytest.raises(EnoughError) as asked, Stopping() as stopping, open_rig(how, 0, journal, stopping):
        pass
    assert asked.value.args == ("/dev/pts/x", 0.7, tmp_path / "guard.jsonl", 50.0)


@pytest.mark.parametrize(
    ("cause", "link", "said"),
    [("Ctrl-Z", "bridge", "suspended"), ("Ctrl-\\", "bus", "quit"), ("terminal closed", "serial", "the terminal was closed")],
)
def test_what_the_terminal_does_stops_the_robot_first(tmp_path, nursery, cause, link, said):
    """Ctrl-Z suspends the process once the robot stands (the helper sees to it); gone on with, the trial is paused."""
    seen = outlive.outlived(nursery, link, cause, tmp_path, patient=True)
    assert (seen.ended, seen.said) == (3, said)


@pytest.mark.skipif(shutil.which("gcc") is None, reason="needs gcc, for clocks that say that the computer slept")
@pytest.mark.parametrize("link", ["serial", "bus"])
def test_a_computer_that_slept_stops_the_robot_first(tmp_path, nursery, link):
    """Trial and guard stand still for 0.02 s, and the clocks say ten minutes: no other cause is there."""
    seen = outlive.outlived(nursery, link, outlive.SLEPT, tmp_path, patient=True)
    assert seen.ended == 3
    assert seen.events[0]["why"] == "the computer slept for 600.0 s"
    assert "the computer slept for 600.0 s" in seen.said


def test_who_stands_by_stops_the_robot_where_trial_and_guard_are_stopped_together(tmp_path, nursery):
    """When the trial goes on, it ends as by any other stop."""
    seen = outlive.outlived(nursery, "bus", outlive.HELD, tmp_path)
    assert (seen.ended, seen.said) == (3, "the guard of the robot's port had ended")
    assert seen.events[0]["kind"] == "tripped"
    assert {e["kind"] for e in seen.events[1:]} & {"stopped", "taken-back"}  # the trial may go on before two readings say so
    assert seen.events[0]["why"] == "the robot's guard was stopped"


@pytest.mark.parametrize(("link", "how"), [("bridge", "killed"), ("serial", "stopped")])
def test_a_trial_whose_guard_is_lost_is_paused(tmp_path, nursery, link, how):
    seen = outlive.outlived(nursery, link, f"the guard is {how}", tmp_path)
    assert (seen.ended, seen.said) == (3, "the guard of the robot's port had ended")
    assert seen.events[0]["why"] in {f"the robot's guard was {how}", "the robot's guard was killed"}  # by the trial, perhaps


@pytest.mark.parametrize("link", LINKS)
def test_a_link_that_comes_back_after_the_trial_has_gone_carries_the_stop(tmp_path, nursery, link):
    seen = outlive.outlived(nursery, link, "link gone, then SIGKILL", tmp_path)
    assert [e["kind"] for e in seen.events][-2:] == ["port-back", "stopped"]


def test_a_driver_that_does_not_know_cannot_go_on(held):
    """What it orders does not reach the robot, until it orders a stop."""
    robot, guard = held("serial")
    clock = RealClock()
    driver = driver_of("serial", guard, clock)
    guard.arm()
    set_off("serial", driver)
    robot.until(True)
    guard.stop_now()
    robot.until(False)
    until(guard.tripped)
    with pytest.raises(NoReplyError):
        driver._link.exchange(b"D,l20000,l20000\n", 0.3)
    assert not robot.moves()
    assert driver.stop(HANGS_S).confirmed
    assert driver.battery_v() > 7


@pytest.mark.parametrize("link", LINKS)
def test_a_driver_can_stop_what_the_guard_has_stopped(held, link):
    robot, guard = held(link)
    driver = driver_of(link, guard, RealClock())
    guard.arm()
    set_off(link, driver)
    guard.stop_now()
    robot.until(False)
    assert driver.stop(HANGS_S).confirmed
    if link != "serial":
        driver.close()


@pytest.mark.parametrize("both", [False, True])
def test_a_guard_that_is_killed_is_replaced_by_one_that_stops_the_robot(tmp_path, held, both):
    robot, guard = held("serial")
    clock = GuardedClock(guard)
    driver = driver_of("serial", guard, clock)
    guard.arm()
    set_off("serial", driver)
    robot.until(True)
    first, standby = guard.process, guard._next.process
    if both:
        standby.kill()
        standby.wait(HANGS_S)
    os.kill(first, signal.SIGKILL)
    until(guard.tripped)
    assert guard.tripped() == "the guard of the robot's port had ended"
    assert guard.process != first
    assert (guard.process == standby.pid) is not both
    until(lambda: outlive._events(tmp_path))
    why = "the guard of the robot's port had ended" if both else "the robot's guard was killed"
    assert outlive._events(tmp_path)[0]["why"] == why
    robot.until(False)  # before its driver asks for that
    assert driver.stop(HANGS_S).confirmed
    assert not robot.moves()


@pytest.mark.parametrize("number", [signal.SIGHUP, signal.SIGINT, signal.SIGQUIT, signal.SIGTSTP])
def test_a_guard_is_deaf_to_the_terminal(held, number):
    _, guard = held("serial")
    os.kill(guard.process, number)
    assert driver_of("serial", guard, RealClock()).battery_v() > 7
    assert os.getsid(guard.process) != os.getsid(0)


def test_a_guard_that_is_terminated_stops_the_robot_first(held):
    robot, guard = held("serial")
    guard.arm()
    set_off("serial", driver_of("serial", guard, RealClock()))
    robot.until(True)
    os.kill(guard.process, signal.SIGTERM)
    assert guard._process.wait(HANGS_S) == 0
    assert not robot.moves()


@pytest.mark.parametrize(("boot", "slept"), [((101.0, 101.0), 0.0), ((701.0, 701.0), 600.0)])
def test_a_process_that_is_stopped_between_two_clocks_takes_that_for_no_sleep(monkeypatch, boot, slept):
    """It is for one second, at the first reading."""
    steady, since_boot = iter([100.0, 101.0, 101.0, 101.0]), iter(boot)
    clocks = SimpleNamespace(CLOCK_BOOTTIME=7, monotonic=lambda: next(steady), clock_gettime=lambda _: next(since_boot))
    monkeypatch.setattr(signs, "time", clocks)
    assert signs.slept_s() == slept


@contextmanager
def armed_guard(tmp_path):
    """In this process, told to watch over it; nothing is at its port."""
    near, far = socket.socketpair()
    with near, far:
        setup = {"process": os.getpid(), "silent_s": HANGS_S, "log": None, "link": str(tmp_path / "x" / "y")}
        setup |= {"port": "none", "sysfs": "/sys", "identity": None, "gives_up_s": HANGS_S}
        guard = guard_process.Guard(setup | {"stop": RECIPES["serial"].as_json()}, far, near)
        near.send(b"a")
        guard._turn(1.0)
        yield guard


def test_a_computer_that_slept_stops_the_robot_when_it_wakes(tmp_path, monkeypatch):
    slept = iter([0.0, 0.0, 0.05, 31.0, 31.0])
    monkeypatch.setattr(guard_process, "slept_s", lambda: next(slept))
    with armed_guard(tmp_path) as guard:
        for why in ("", "", "the computer slept for 30.9 s"):  # the clocks differ by a little at all times
            guard._judge()
            assert guard.why.startswith(why[:25])
        assert guard.why.startswith("the computer slept for 3")


def test_a_computer_that_sleeps_while_its_guard_looks_at_the_trial_is_said_to_have_slept(tmp_path, monkeypatch):
    """The trial that is found stopped then is so because of that."""
    clock = {"slept_s": 0.0}

    def sleeps(_process):
        clock["slept_s"] = 31.0
        return signs.STOPPED

    monkeypatch.setattr(guard_process, "slept_s", lambda: clock["slept_s"])
    with armed_guard(tmp_path) as guard:
        monkeypatch.setattr(guard_process, "not_running", sleeps)
        guard._judge()
        assert guard.why == "the computer slept for 31.0 s"



def test_a_process_that_is_dead_is_not_taken_for_one_that_was_stopped():
    """Until its parent asks after it, it is still listed."""
    with subprocess.Popen([sys.executable, "-c", "input()"], stdin=subprocess.PIPE) as child:
        assert signs.not_running(child.pid) == ""
        for signal_, state in ((signal.SIGSTOP, "was stopped"), (signal.SIGKILL, "is gone")):
            child.send_signal(signal_)
            until(lambda state=state: signs.not_running(child.pid) == state)
    assert signs.not_running(child.pid) == ""


def test_a_robot_is_stopped_over_a_slow_link(tmp_path):
    """Answers that take 0.3 s: the guard waits longer each time."""
    robot = Robot("serial", tmp_path)
    robot._device._latency_s = 0.3
    guard = Guard(str(robot.path), RECIPES["serial"], HANGS_S)
    line = os.open(guard.path, os.O_RDWR | os.O_NOCTTY)
    os.write(line, b"D,l20000,l20000\n")
    robot.until(True)
    guard.arm()
    trial_dies(guard)
    robot.until(False)
    assert guard._process.wait(HANGS_S) == 0
    os.close(line)
    robot.close()


def test_a_robot_whose_trial_dies_before_it_armed_the_guard_is_ordered_to_stop(tmp_path):
    """A driver's first orders may be on their way by then."""
    robot = Robot("serial", tmp_path)
    guard = Guard(str(robot.path), RECIPES["serial"], HANGS_S, tmp_path / "guard.jsonl")
    line = os.open(guard.path, os.O_RDWR | os.O_NOCTTY)
    os.write(line, b"D,l20000,l20000\n")
    robot.until(True)
    trial_dies(guard)
    assert guard._process.wait(HANGS_S) == 0
    assert [e["why"] for e in outlive._events(tmp_path) if e["kind"] == "tripped"] == ["the trial's process is gone"]
    robot.until(False)
    assert b"D,l0,l0\n" in b"".join(data for _, data in robot.heard)
    os.close(line)
    robot.close()


def test_places_before_a_round_without_an_answer_confirm_no_stop():
    order = StopOrder(RECIPES["bus"].as_json())
    assert [order.confirmed(places) for places in ([5], None, [5], [5], [5])] == [False, False, False, False, True]


def test_a_trial_that_ends_leaves_no_guard(held):
    _, guard = held("serial")
    standby = guard._next.process
    assert guard.close()
    assert not os.path.lexists(guard.path)
    assert standby.returncode == 0


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


def vanish(guard):
    """The trial is gone, as far as guard and who stands by can tell."""
    for one in (guard._control, guard._watch, guard._next.control, guard._next.watch):
        one.close()


def moving(held, link="serial"):
    """A robot that moves, its guard, and who stands by."""
    robot, guard = held(link)
    driver = driver_of(link, guard, RealClock())
    guard.arm()
    set_off(link, driver)
    robot.until(True)
    return robot, guard, guard._next


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


def test_a_port_in_use_is_named(tmp_path):
    robot = Robot("serial", tmp_path)
    holder = os.open(robot.path, os.O_RDWR | os.O_NOCTTY)
    fcntl.flock(holder, fcntl.LOCK_EX)
    with pytest.raises(HardwareError, match="is in use by another program"):
        Guard(str(robot.path), RECIPES["serial"], HANGS_S)
    os.close(holder)
    robot.close()
    with pytest.raises(HardwareError, match="there is no port"):
        Guard(str(tmp_path / "nowhere"), RECIPES["serial"], HANGS_S)


def test_a_guard_needs_no_package(tmp_path):
    """It starts with the standard library alone, in a process that has nothing to import from."""
    folder = Path(guard_process.__file__).parent.parent
    code = CODE.replace("main()", "assert not [name for name in sys.modules if name.startswith('bns')]")
    subprocess.run([sys.executable, "-I", "-S", "-c", code, str(folder)], check=True, cwd=tmp_path)


def test_a_bus_is_stopped_by_the_same_bytes_as_its_driver_writes(held):
    """Else the guard would not know that the driver stops it."""
    robot, guard = held("bus")
    driver = driver_of("bus", guard, RealClock())
    before = len(robot.heard)
    driver.stop(HANGS_S)
    assert robot.heard[before][1].startswith(RECIPES["bus"].steps[0][0])
    driver.close()


def test_bytes_pass_unchanged(tmp_path):
    with PseudoTerminal(outlive.Echo(), tmp_path, "echo") as line:
        guard = Guard(str(line.path), RECIPES["serial"], HANGS_S)
        near = os.open(guard.path, os.O_RDWR | os.O_NOCTTY)
        sent, heard = bytes(range(256)) * 3, b""
        os.write(near, sent)
        while len(heard) < len(sent):
            heard += os.read(near, 4096)
        os.close(near)
        guard.close()
    assert heard == sent


def test_what_a_guard_says_may_come_in_pieces_and_its_first_reason_stays():
    guard, (near, far) = Guard.__new__(Guard), socket.socketpair()
    guard._control, guard._said, guard._why = near, b"", None
    with near, far:
        for why in ("first", "second"):
            line = json.dumps({"kind": "tripped", "why": why}).encode() + b"\n"
            for piece in (line[:9], line[9:]):
                far.send(piece)
                said = guard.tripped()
    assert said == "the guard stopped the robot: first"


def test_a_long_sleep_gives_signs_of_life_all_along(monkeypatch):
    now_s, beats = [0.0], []
    ticking = SimpleNamespace(monotonic=lambda: now_s[0], sleep=lambda seconds: now_s.__setitem__(0, now_s[0] + seconds))
    monkeypatch.setattr(guard_client, "time", ticking)
    GuardedClock(SimpleNamespace(beat=lambda: beats.append(now_s[0]))).sleep(1.0)
    assert now_s[0] == pytest.approx(1.0)
    assert beats[-1] == now_s[0]
    assert max(after - before for before, after in itertools.pairwise(beats)) < 0.1


def guarded(told, check=lambda: None, **platform):
    """A platform whose guard writes down what it is told."""
    words = {name: lambda name=name: told.append(name) for name in ("arm", "still", "stop_now")}
    stopping = SimpleNamespace(causes=[], alarms=[], check=check)
    return GuardedPlatform(SimpleNamespace(**platform), SimpleNamespace(tripped=lambda: None, **words), stopping)


@pytest.mark.parametrize(("confirmed", "said"), [(True, ["arm", "still"]), (False, ["arm"])])
def test_a_robot_that_was_not_confirmed_to_stand_stays_guarded(confirmed, said):
    told = []
    assert guarded(told, stop=lambda: Stop(confirmed, 0.1, None)).stop().confirmed == confirmed
    assert told == said


def test_who_was_asked_to_stop_before_a_drive_does_not_begin_it():
    def asked_to_stop():
        raise TrialPausedError("interrupted")

    told, driven = [], []
    with pytest.raises(TrialPausedError, match="interrupted"):
        guarded(told, asked_to_stop, drive=driven.append).drive(None)
    assert (told, driven) == ([], [])
