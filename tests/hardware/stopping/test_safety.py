"""What ends a drive, who is asked, and what must be confirmed."""

import os
import signal
import time

import numpy as np
import pytest

from bns.errors import StopNotConfirmedError, TrialPausedError
from bns.hardware.safety import DriveEnded, Limits, Stopping, StopsAtTheEnd, Surface, Watch
from bns.hardware.stop import Stop
from bns.hardware.tracking.sight import Sight, unwrapped
from bns.trial.operator import TerminalOperator, UnattendedOperator

LIMITS = Limits(Surface(-1, 1, -0.5, 0.5), lost_s=0.5, late_s=1.0)


def sight(clock, x=0.0, y=0.0):
    return Sight(clock.now_s(), np.array([x, y, 0.0]))


def test_a_watch_lets_a_drive_go_on(clock):
    watch = Watch(LIMITS, clock, Stopping())
    for _ in range(20):
        clock.sleep(0.1)
        watch.check(sight(clock, 0.9, -0.4))


@pytest.mark.parametrize(("x", "y"), [(1.01, 0.0), (0.0, -0.51)])
def test_leaving_the_surface_ends_it(clock, x, y):
    with pytest.raises(DriveEnded, match="left the surface"):
        Watch(LIMITS, clock, Stopping()).check(sight(clock, x, y))


def test_out_of_sight_for_too_long_ends_it(clock):
    watch, old = Watch(LIMITS, clock, Stopping()), sight(clock)
    for seen in (None, old, None):
        clock.sleep(0.15)
        watch.check(seen)
    clock.sleep(0.15)
    with pytest.raises(DriveEnded, match=r"not seen the robot for 0\.6 s"):
        watch.check(old)  # an old sight is no new one


def test_a_computer_that_is_too_busy_pauses_the_trial(clock):
    watch = Watch(LIMITS, clock, Stopping())
    clock.sleep(1.2)
    with pytest.raises(TrialPausedError, match=r"the program did not check the robot for 1\.2 s"):
        watch.check(sight(clock))


@pytest.mark.parametrize("found", [None, "the guard stopped the robot: the trial was asked to stop"])
def test_a_signal_while_causes_are_asked_for_is_neither_lost_nor_called_otherwise(found):
    stopping = Stopping()
    stopping.causes.append(lambda: (stopping._handle(signal.SIGQUIT, None), found)[1])
    with pytest.raises(TrialPausedError, match=r"^quit$"):
        stopping.check()


@pytest.mark.parametrize(("number", "word"), [(signal.SIGINT, "interrupted"), (signal.SIGTERM, "terminated")])
def test_signals_are_noted_and_handlers_put_back(clock, number, word):
    before = signal.getsignal(number)
    with Stopping() as stopping:
        stopping.check()
        os.kill(os.getpid(), number)
        with pytest.raises(TrialPausedError, match=word):
            Watch(LIMITS, clock, stopping).check(sight(clock))
    assert signal.getsignal(number) == before


def test_a_trial_begun_by_nohup_outlives_its_terminal():
    before = signal.signal(signal.SIGHUP, signal.SIG_IGN)
    try:
        with Stopping() as stopping:
            os.kill(os.getpid(), signal.SIGHUP)
            stopping.check()
        assert signal.getsignal(signal.SIGHUP) is signal.SIG_IGN
    finally:
        signal.signal(signal.SIGHUP, before)


def test_ctrl_c_ends_a_question_at_once(monkeypatch):
    def slow(_question):
        os.kill(os.getpid(), signal.SIGINT)
        time.sleep(5)

    monkeypatch.setattr("builtins.input", slow)
    began = time.monotonic()
    with Stopping() as stopping, pytest.raises(TrialPausedError, match="paused by the operator"):
        TerminalOperator(stopping.ask).accept("evaluation 1", ())
    assert time.monotonic() - began < 4


@pytest.mark.parametrize(("number", "word"), [(signal.SIGTERM, "terminated"), (signal.SIGHUP, "the terminal was closed")])
def test_a_signal_that_ends_a_question_is_named_and_not_the_operator(monkeypatch, number, word):
    monkeypatch.setattr("builtins.input", lambda _question: os.kill(os.getpid(), number) or time.sleep(5))
    with Stopping() as stopping, pytest.raises(TrialPausedError, match=word):
        TerminalOperator(stopping.ask, stopping.check).accept("evaluation 1", ())


def test_a_terminal_that_is_closed_ends_the_input_too(monkeypatch):
    def ended(_question):
        stopping.request("the terminal was closed")
        raise EOFError

    with Stopping() as stopping, pytest.raises(TrialPausedError, match="the terminal was closed"):
        TerminalOperator(ended, stopping.check).accept("evaluation 1", ())


@pytest.mark.parametrize("fault", [None, RuntimeError("broken"), KeyboardInterrupt()])
def test_a_stop_not_confirmed_is_louder_than_any_fault(fault):
    def inside():
        with StopsAtTheEnd(lambda: Stop(False, 5.0, None, "the port is gone")):
            if fault is not None:
                raise fault

    with pytest.raises(StopNotConfirmedError, match=r"CUT THE POWER NOW.*5\.0 s: the port is gone") as caught:
        inside()
    assert caught.value.__cause__ is fault
    assert ("It was being stopped because" in str(caught.value)) == (fault is not None)


def test_who_asked_for_the_stop_is_named_and_not_the_silence_of_a_port_that_the_guard_has_taken():
    def inside():
        with StopsAtTheEnd(lambda: Stop(False, 5.0, None, "the port is gone"), lambda: "interrupted"):
            raise RuntimeError("servo 2 does not answer")

    with pytest.raises(StopNotConfirmedError, match=r"It was being stopped because interrupted\.$"):
        inside()


def test_a_robot_that_is_not_seen_to_stand_is_cried_out_at_once_and_once(capsys):
    """The second attempt, when the rig is closed, takes five seconds more; nobody may wait for it to hear the first."""
    heard = []

    def again():
        heard.append(capsys.readouterr().err)
        return Stop(False, 5.0, None, "still gone")

    def inside():
        with StopsAtTheEnd(again), StopsAtTheEnd(lambda: Stop(False, 5.0, None, "the port is gone")):
            raise RuntimeError("broken")

    with pytest.raises(StopNotConfirmedError, match=r"5\.0 s: the port is gone\. It was being stopped because broken\.$"):
        inside()
    assert heard == ["bns: THE ROBOT MAY STILL BE MOVING: CUT THE POWER NOW.\n"]
    assert capsys.readouterr().err == ""


def test_a_confirmed_stop_lets_the_fault_through():
    stops = []

    def stop():
        stops.append(1)
        return Stop(True, 0.1, 0.02)

    with pytest.raises(RuntimeError, match="broken"), StopsAtTheEnd(stop):
        raise RuntimeError("broken")
    with StopsAtTheEnd(stop) as guard:
        pass
    assert len(stops) == 2
    assert guard.last.confirmed


def test_the_operator_is_asked_until_the_answer_makes_sense(capsys):
    answers = iter(["x", "r"])
    assert TerminalOperator(lambda _q: next(answers)).accept("evaluation 1", ()) == ("repeat", ())
    assert "'x' is none of" in capsys.readouterr().err
    assert TerminalOperator(lambda _q: "").accept("", ()) == ("next", ())
    assert TerminalOperator(lambda _q: "s").accept("", ()) == ("skip", ())
    with pytest.raises(TrialPausedError, match="paused by the operator"):
        TerminalOperator(lambda _q: "p").place(np.zeros(3), "why")


def test_with_nobody_there_a_misplaced_robot_pauses_the_trial():
    with pytest.raises(TrialPausedError, match=r"stands 30 cm away, and with --yes there is no operator .*--resume"):
        UnattendedOperator().place(np.zeros(3), "The robot stands 30 cm away")
    with pytest.raises(TrialPausedError, match=r"is it stuck\? With --yes there is no operator to put it back\. Do so"):
        UnattendedOperator().place(np.zeros(3), "servo 9 has used 100% of its torque for 1.2 s; is it stuck?")
    assert UnattendedOperator().accept("", ()) == ("next", ())


def test_the_operator_names_the_cycles_that_were_unstable(capsys):
    answers = iter(["u", "none", "3, 9", "3 and 1"])
    asked = []
    said = TerminalOperator(lambda q: (asked.append(q), next(answers))[1]).accept("evaluation 1", [(0.0, 1.0)] * 4)
    assert said == ("next", (1, 3))
    assert "Which of the cycles 1 to 4" in asked[1]
    assert capsys.readouterr().err.count("write numbers from 1 to 4") == 2


def test_where_nothing_can_be_unstable_nobody_is_asked():
    answers = iter(["u", ""])
    asked = []
    assert TerminalOperator(lambda q: (asked.append(q), next(answers))[1]).accept("", ()) == ("next", ())
    assert not any("unstable" in question for question in asked)


def test_headings_go_on_over_the_turn():
    assert unwrapped(-3.1, 3.1) == pytest.approx(2 * np.pi - 3.1)
    assert unwrapped(0.1, 12.5) == pytest.approx(0.1 + 4 * np.pi)
