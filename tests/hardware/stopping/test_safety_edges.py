"""The limits of a drive to the last digit, and every signal by its name."""

import signal
import threading
from dataclasses import FrozenInstanceError

import numpy as np
import pytest

from bns.errors import TrialPausedError
from bns.hardware import safety
from bns.hardware.safety import DriveEnded, Limits, OutOfSight, Stopping, Surface, Watch
from bns.hardware.tracking.sight import Sight

SURFACE = Surface(-1.0, 2.0, -0.5, 0.75)
BEGIN_S = 64.0  # these times are sums of powers of two: they are exact


class Hands:
    """A clock that stands where it is put."""

    def __init__(self):
        self.t_s = BEGIN_S

    def now_s(self):
        return self.t_s


@pytest.fixture
def hands():
    return Hands()


def watch(hands, **limits):
    return Watch(Limits(SURFACE, **limits), hands, Stopping())


def seen(t_s, x=0.0, y=0.0):
    return Sight(t_s, np.array([x, y, 0.0]))


def test_limits_are_those_of_the_docs():
    limits = Limits(SURFACE)
    times_s = limits.lost_s, limits.picture_s, limits.disagree_s, limits.late_s, limits.silent_s, limits.gives_up_s
    assert times_s == (0.5, 0.25, 0.5, 1.0, 0.3, 14400.0)


@pytest.mark.parametrize(("x", "y"), [(-1.0, 0.0), (2.0, 0.0), (0.0, -0.5), (0.0, 0.75), (2.0, 0.75), (-1.0, -0.5)])
def test_the_edge_belongs_to_the_surface(x, y):
    assert SURFACE.holds(x, y)


@pytest.mark.parametrize(("x", "y"), [(-1.01, 0.0), (2.01, 0.0), (0.0, -0.51), (0.0, 0.76)])
def test_each_side_has_its_own_limit(hands, x, y):
    assert not SURFACE.holds(x, y)
    with pytest.raises(DriveEnded, match=rf"the robot left the surface at \({x:.2f}, {y:.2f}\) m"):
        watch(hands).check(seen(BEGIN_S, x, y))


def test_a_picture_may_be_as_old_as_the_limit_and_no_older(hands):
    looked = watch(hands)
    hands.t_s = BEGIN_S + 0.25
    looked.check(seen(hands.t_s), picture_s=BEGIN_S)
    hands.t_s = BEGIN_S + 0.375
    with pytest.raises(DriveEnded, match=r"no new picture for 0\.38 s"):
        looked.check(seen(hands.t_s), picture_s=BEGIN_S)


def test_a_picture_of_before_the_drive_is_as_old_as_the_drive(hands):
    looked = watch(hands)
    hands.t_s = BEGIN_S + 0.25
    looked.check(seen(hands.t_s), picture_s=BEGIN_S - 10.0)
    looked.check(seen(hands.t_s), picture_s=None)
    hands.t_s = BEGIN_S + 0.5
    looked.check(seen(hands.t_s), picture_s=BEGIN_S + 0.25)
    looked.check(seen(hands.t_s), picture_s=None)
    with pytest.raises(DriveEnded, match=r"no new picture for 10\.50 s"):
        looked.check(seen(hands.t_s), picture_s=BEGIN_S - 10.0)


def test_a_robot_that_stands_is_filmed_but_need_not_be_seen(hands):
    looked = watch(hands)
    for step in range(1, 9):
        hands.t_s = BEGIN_S + 0.25 * step
        looked.still_filmed(hands.t_s)
    hands.t_s += 0.5
    with pytest.raises(DriveEnded, match=r"no new picture for 0\.50 s"):
        looked.still_filmed(hands.t_s - 0.5)


def test_a_robot_may_be_out_of_sight_as_long_as_the_limit_and_no_longer(hands):
    looked = watch(hands)
    hands.t_s = BEGIN_S + 0.5
    looked.check(None)
    hands.t_s = BEGIN_S + 0.625
    with pytest.raises(OutOfSight, match=r"not seen the robot for 0\.6 s"):
        looked.check(None)


def test_what_was_seen_last_counts_and_an_older_sight_does_not_take_it_back(hands):
    looked = watch(hands)
    hands.t_s = BEGIN_S + 0.5
    looked.check(seen(BEGIN_S + 0.5))
    looked.check(seen(BEGIN_S + 0.125))
    hands.t_s = BEGIN_S + 1.0
    looked.check(None)
    hands.t_s = BEGIN_S + 1.125
    with pytest.raises(OutOfSight, match=r"for 0\.6 s"):
        looked.check(None)


def test_a_drive_begins_anew(hands):
    looked = watch(hands)
    hands.t_s = BEGIN_S + 8.0
    looked.begin()
    hands.t_s += 0.25
    looked.check(None, picture_s=BEGIN_S)


def test_a_look_may_come_as_late_as_the_limit_and_no_later(hands):
    looked = watch(hands, lost_s=99.0)
    hands.t_s = BEGIN_S + 1.0
    looked.check(None)
    hands.t_s = BEGIN_S + 2.0
    looked.check(None)
    hands.t_s = BEGIN_S + 3.125
    with pytest.raises(TrialPausedError, match=r"the program did not check the robot for 1\.1 s"):
        looked.check(None)


def test_every_cause_is_asked_at_every_look_and_the_first_reason_stays():
    stopping, asked = Stopping(), []
    stopping.causes = [lambda: asked.append(1), lambda: "the battery is low" if len(asked) > 1 else None]
    stopping.check()
    with pytest.raises(TrialPausedError, match="the battery is low"):
        stopping.check()
    stopping.request("somebody asked")
    with pytest.raises(TrialPausedError, match="the battery is low"):
        stopping.check()


@pytest.mark.parametrize(
    ("name", "word"),
    [
        ("SIGINT", "interrupted"),
        ("SIGTERM", "terminated"),
        ("SIGHUP", "the terminal was closed"),
        ("SIGQUIT", "quit"),
        ("SIGTSTP", "suspended"),
    ],
)
def test_a_signal_sounds_the_alarm_and_only_ctrl_z_suspends_and_only_in_the_end(monkeypatch, name, word):
    sent, alarms = [], []
    number = getattr(signal, name)
    before = signal.getsignal(number)
    with Stopping() as stopping:
        stopping.alarms = [lambda: alarms.append("a"), lambda: alarms.append("b")]
        signal.raise_signal(number)
        assert (stopping.reason, alarms) == (word, ["a", "b"])
        monkeypatch.setattr(safety.os, "kill", lambda _pid, given: sent.append(given))
        assert not sent
    assert sent == ([signal.SIGTSTP] if name == "SIGTSTP" else [])
    assert signal.getsignal(number) == before
    stopping.__exit__()
    assert len(sent) <= 1  # a second end suspends nothing more


def test_a_signal_after_the_question_ends_nothing_by_force(monkeypatch):
    monkeypatch.setattr("builtins.input", lambda question: question.upper())
    with Stopping() as stopping:
        assert stopping.ask("well?") == "WELL?"
        signal.raise_signal(signal.SIGINT)
        assert stopping.reason == "interrupted"


def test_another_thread_takes_no_signals_over():
    before, found = signal.getsignal(signal.SIGTERM), []

    def inside():
        with Stopping() as stopping:
            found.append(signal.getsignal(signal.SIGTERM))
            stopping.request("asked for")
            found.append(stopping.reason)

    thread = threading.Thread(target=inside)
    thread.start()
    thread.join()
    assert found == [before, "asked for"]


EARLY_S = 0.125  # no multiple of what follows: a remainder is no difference here


def test_the_next_look_is_after_a_tick_or_when_a_picture_is_overdue(hands):
    looked = watch(hands)
    assert looked.next_look_s(0.5, None) == 0.5
    assert looked.next_look_s(0.125, BEGIN_S) == 0.125
    assert looked.next_look_s(8.0, BEGIN_S) == pytest.approx(0.255)
    assert looked.next_look_s(8.0, BEGIN_S - 10.0) == pytest.approx(0.255)  # the drive began later than that picture
    hands.t_s = BEGIN_S + 0.125
    assert looked.next_look_s(8.0, BEGIN_S) == pytest.approx(0.13)
    assert looked.next_look_s(8.0, BEGIN_S + 0.0625) == pytest.approx(0.1925)
    hands.t_s = BEGIN_S + 1.0
    assert looked.next_look_s(8.0, BEGIN_S) == pytest.approx(0.005)


def test_a_picture_is_overdue_beyond_the_limit_and_not_on_it(hands):
    looked = watch(hands)
    assert not looked.overdue(BEGIN_S)
    hands.t_s = BEGIN_S + 0.25
    assert not looked.overdue(BEGIN_S)
    assert not looked.overdue(BEGIN_S - 10.0)
    hands.t_s = BEGIN_S + 0.375
    assert looked.overdue(BEGIN_S)
    assert looked.overdue(BEGIN_S - 10.0)
    assert not looked.overdue(BEGIN_S + 0.125)
    assert not looked.overdue(BEGIN_S + 0.25)


def test_pictures_are_timed_by_differences_from_the_first_second_on(hands):
    hands.t_s = EARLY_S
    looked = watch(hands)
    hands.t_s = 0.5
    assert looked.overdue(EARLY_S)
    with pytest.raises(DriveEnded, match=r"no new picture for 0\.45 s"):
        looked.check(seen(hands.t_s), picture_s=0.05)


@pytest.mark.parametrize("fixed", [SURFACE, Limits(SURFACE)])
def test_limits_cannot_be_changed_while_a_robot_drives(fixed):
    with pytest.raises(FrozenInstanceError):
        fixed.lost_s = 5.0
