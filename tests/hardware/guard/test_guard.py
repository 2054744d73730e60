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
from bns.hardware.guard.client import Guard, GuardedClock, GuardedPlatform
from bns.hardware.guard.holder import CODE
from bns.hardware.guard.order import StopOrder
from bns.hardware.link.serial_link import NoReplyError
from bns.hardware.rig import shipped_rig
from bns.hardware.safety import Stopping
from bns.hardware.stop import Stop
from bns.trial.session import TrialSetup, open_rig

from .. import outlive
from ..robots_on_the_line import LINKS, ManualRobot, Robot
from .held import HANGS_S, RECIPES, armed_guard, driver_of, set_off, trial_dies, until


@pytest.fixture(scope="module")
def nursery():
    found = outlive.Nursery()
    yield found
    found.close()


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
