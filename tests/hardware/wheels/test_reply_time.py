"""Time-outs that follow the link: the arithmetic of RFC 6298, and drives over links of every speed."""

from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest

from bns.errors import HardwareError, StopNotConfirmedError, TrialPausedError
from bns.hardware.clock import EmulatedClock, RealClock
from bns.hardware.emulators.devices.khepera import KheperaEmulator
from bns.hardware.emulators.devices.terminal import PseudoTerminal
from bns.hardware.emulators.faults import Fault, Faults
from bns.hardware.link.hardware_log import HardwareLog, events
from bns.hardware.link.reply_time import ReplyLimits, ReplyTime
from bns.hardware.link.serial_link import SerialLink
from bns.hardware.platforms import khepera as platform
from bns.hardware.rig import shipped_rig
from bns.hardware.safety import Stopping, StopsAtTheEnd
from bns.hardware.tracking.sight import Sight
from bns.hardware.wheels.khepera import BAUD, KheperaIII, firmware
from bns.hardware.wheels.khepera_settings import khepera_settings
from bns.hardware.wheels.wheel_drive import RobotLostError
from bns.trial.session import TrialSetup, open_rig

from ..robots_on_the_line import DistantRobot

MOST = ReplyLimits(1.0, 0.0, 100.0)
HANGS_S = 30.0
"""A computer this busy stops nothing."""


def test_the_time_out_is_that_of_the_rfc():
    """Section 2 worked by hand: 0.2 s first, then 0.1 s."""
    time = ReplyTime(MOST)
    assert time.timeout_s == 1.0
    time.measured(0.2)
    assert (time.smoothed_s, time.deviation_s) == (0.2, 0.1)
    assert time.timeout_s == pytest.approx(0.2 + 4 * 0.1)
    time.measured(0.1)
    assert time.deviation_s == pytest.approx(0.75 * 0.1 + 0.25 * 0.1)
    assert time.smoothed_s == pytest.approx(0.1875)
    time.measured(0.1)
    assert time.deviation_s == pytest.approx(0.75 * 0.1 + 0.25 * 0.0875)
    assert time.smoothed_s == pytest.approx(0.875 * 0.1875 + 0.125 * 0.1)


def test_a_steady_link_is_waited_for_little_longer_than_it_takes():
    time = ReplyTime(MOST)
    for _ in range(100):
        time.measured(0.05)
    assert time.timeout_s == pytest.approx(0.06)


@pytest.mark.parametrize(("trip_s", "timeout_s"), [(0.001, 0.03), (9.0, 0.8)])
def test_time_outs_stay_within_their_limits(trip_s, timeout_s):
    time = ReplyTime()
    for _ in range(100):
        time.measured(trip_s)
    assert time.timeout_s == timeout_s


def test_the_first_answer_of_a_slow_link_is_waited_for():
    """Nothing is known of the link yet: a round trip of 0.3 s with a tail as long must not be asked for twice."""
    assert ReplyTime().timeout_s > 0.3 + 2 * 0.3
    assert ReplyTime(khepera_settings({}).reply).timeout_s == ReplyTime().timeout_s
    assert ReplyTime().patience_s >= 4 * ReplyTime().timeout_s


class BodysEye:
    """A tracker that always knows."""

    def __init__(self, robot, clock):
        self._robot, self._clock = robot, clock

    def look(self):
        return Sight(self._clock.now_s(), self._robot.body.pose(self._robot.clock.now_s()))

    def close(self):
        pass


@pytest.mark.parametrize(
    ("delay_s", "jitter", "loss"), [(0.02, 1.0, 0.02), (0.11, 0.2, 0.0), (0.15, 0.3, 0.02), (0.3, 0.3, 0.02)]
)
@pytest.mark.slow
def test_a_slow_link_is_driven_over(tmp_path, monkeypatch, delay_s, jitter, loss):
    """On a real line in real time, guard and all: done or paused, and standing.

    A computer that stands still for a while pauses nothing here: without a loss, a pause is the link's.
    """
    robot = DistantRobot(tmp_path, delay_s, jitter, loss, seed=1)
    monkeypatch.setattr(platform, "open_tracker", lambda _settings, clock: BodysEye(robot, clock))
    shipped, commands = shipped_rig("khepera"), np.array(3 * [[9000.0, 6000.0, 1000.0]], np.float32)
    patient = replace(shipped.limits, silent_s=HANGS_S, late_s=HANGS_S, lost_s=HANGS_S)
    rig = replace(shipped, port=str(robot.path), limits=patient, driver={**shipped.driver, "most_reply_s": HANGS_S})
    try:
        with Stopping() as stopping, open_rig(TrialSetup(rig, yes=True), 0, tmp_path / "journal.jsonl", stopping) as opened:
            driven = opened.platform.drive(commands)
            assert driven.stop.confirmed
            assert len(driven.commands) == 3
    except TrialPausedError:
        assert loss
    assert not robot.moves()
    assert all(e["confirmed"] for e in events(tmp_path / "journal.jsonl", "stop"))
    robot.close()


def test_a_driver_that_waits_for_an_answer_gives_signs_of_life_all_the_while(tmp_path):
    """The guard hears of the trial whenever it asks the time: between any two waits, each far shorter than its patience."""
    robot, clock = DistantRobot(tmp_path, 0.15, 0.0, 0.0), RealClock()
    link = SerialLink(str(robot.path), BAUD, clock, HardwareLog(None, None))
    happened, now_s, read = [], clock.now_s, link._serial.read
    clock.now_s = lambda: happened.append("asked the time") or now_s()
    link._serial.read = lambda *size: happened.append("waited") or read(*size)
    link.exchange(b"E\n", HANGS_S)
    assert happened.count("waited") > 2
    without = sum(pair == ("waited", "waited") for pair in pairwise(happened))
    assert without <= len(b"e,0,0\r\n")  # the letters of the answer are read one by one, and are there
    assert link._serial.timeout < 0.1 * shipped_rig("khepera").limits.silent_s
    link.close()
    robot.close()


@pytest.mark.parametrize("latency_s", [0.02, 0.11, 0.15, 0.3])
def test_losses_on_a_slow_link_never_end_in_an_unconfirmed_stop(tmp_path, clock, body, latency_s):
    """Forty drives on the emulated clock; every twentieth exchange is lost, on its way there or back."""
    faults = Faults((Fault("lost-request", rate=0.025), Fault("lost-reply", rate=0.025)), 3, "khepera")
    lost = 0
    with PseudoTerminal(KheperaEmulator(body, clock, firmware(2, 4), faults, latency_s), tmp_path, "khepera") as line:
        journal = HardwareLog(None, clock)
        link = SerialLink(str(line.path), BAUD, clock, journal)
        driver = KheperaIII(link, clock, journal)
        for _ in range(40):
            try:
                driver.set_speed_m_s(0.1, 0.08)
                for _ in range(3):
                    clock.sleep(0.5)
                    driver.speed_m_s()
            except RobotLostError:
                lost += 1
            assert driver.stop().confirmed
        link.close()
    assert driver.retries > 2
    assert lost <= 4


def test_an_answer_to_what_was_asked_before_is_none_to_what_is_asked_now(tmp_path):
    """The answer to a D comes after the next question: a D's is not taken for it, an E's is waited for."""
    robot = DistantRobot(tmp_path, 0.4, 0.0, 0.0)
    clock = RealClock()
    journal = HardwareLog(tmp_path / "journal.jsonl", clock)
    link = SerialLink(str(robot.path), BAUD, clock, journal)
    with pytest.raises(Exception, match="no answer to"):
        link.exchange(b"D,l3000,l3000\n", 0.1)
    assert link.exchange(b"E\n", 1.0).startswith(b"e,")
    link.close()
    journal.close()
    robot.close()
    assert [e["data"] for e in events(tmp_path / "journal.jsonl", "passed-over")] == ["d\r\n"]


def test_the_second_answer_to_a_question_asked_twice_is_none_to_the_next(tmp_path):
    robot = DistantRobot(tmp_path, 0.3, 0.0, 0.0)
    clock = RealClock()
    journal = HardwareLog(tmp_path / "journal.jsonl", clock)
    link = SerialLink(str(robot.path), BAUD, clock, journal)
    with pytest.raises(Exception, match="no answer to"):
        link.exchange(b"V,0\n", 0.1)
    assert link.exchange(b"V,0\n", 5.0, again=True).startswith(b"v,")
    assert link.exchange(b"E\n", 5.0, again=True).startswith(b"e,")
    link.close()
    journal.close()
    robot.close()
    assert [e["data"][:2] for e in events(tmp_path / "journal.jsonl", "passed-over")] == ["v,"]


class EchoingLink:
    """In front of a robot: an adapter that hands back what it sends, before the answer."""

    def __init__(self, robot, end=b"\n"):
        self._robot, self._end, self.written = robot, end, robot.written

    def receive(self, data):
        return data.replace(b"\n", self._end) + self._robot.receive(data)


@pytest.mark.parametrize("end", [b"\n", b"\r\n"])
@pytest.mark.parametrize("loss", [0.0, 0.025])
def test_an_adapter_that_echoes_is_driven_like_any_other(tmp_path, clock, body, end, loss):
    faults = Faults((Fault("lost-request", rate=loss), Fault("lost-reply", rate=loss)), 3, "khepera")
    robot = KheperaEmulator(body, clock, firmware(2, 4), faults, 0.02)
    with PseudoTerminal(EchoingLink(robot, end), tmp_path, "khepera") as line:
        journal = HardwareLog(None, clock)
        link = SerialLink(str(line.path), BAUD, clock, journal)
        driver = KheperaIII(link, clock, journal)
        for speed_m_s in (0.1, 0.08, 0.05):
            driver.set_speed_m_s(speed_m_s, speed_m_s)
            clock.sleep(1.0)
            assert driver.speed_m_s() == pytest.approx((speed_m_s, speed_m_s), abs=0.01)
        assert driver.stop().confirmed
        link.close()


@pytest.mark.parametrize(
    ("driver", "message"),
    [
        ({"first_reply": 1.0}, "unknown setting 'first_reply'. Did you mean 'first_reply_s'"),
        ({"stop_s": -1}, "stop_s is -1; it must be a number of seconds above 0"),
        ({"stop_s": 5000}, "stop_s is 5000 s; at most 60. It is in seconds, not milliseconds"),
        ({"least_reply_s": 2.0}, "least_reply_s is 2, above its most_reply_s 0.8"),
    ],
)
def test_bad_settings_are_named(driver, message):
    with pytest.raises(HardwareError, match=message.replace("'", ".")):
        khepera_settings(driver)


def test_a_rigs_settings_reach_link_and_driver(tmp_path, monkeypatch):
    robot = DistantRobot(tmp_path, 0.02, 0.0, 0.0)
    monkeypatch.setattr(platform, "open_tracker", lambda _settings, clock: BodysEye(robot, clock))
    driver = {"first_reply_s": 0.5, "least_reply_s": 0.21, "most_reply_s": 0.7, "stop_s": 2.0}
    rig = replace(shipped_rig("khepera"), port=str(robot.path), driver=driver)
    with Stopping() as stopping, open_rig(TrialSetup(rig, yes=True), 0, None, stopping) as opened:
        link = opened.platform._platform._driver._link
        assert link.times.limits == ReplyLimits(0.5, 0.21, 0.7)
        assert link.times.timeout_s >= 0.21  # longer where this machine answers late
        quick = ReplyTime(link.times.limits)
        quick.measured(0.02)
        assert quick.timeout_s == 0.21
        opened.platform._platform._driver._link.times.measured(0.02)
        robot.body.order(0.1, 0.1, robot.clock.now_s())
        robot.body.order = lambda *_: None  # takes the order, does not carry it out
        stop = opened.platform._platform._driver.stop()
        assert not stop.confirmed
        assert 2.0 < stop.seconds < 5.0  # as long as without the setting
        del robot.body.order
    assert not robot.moves()
    robot.close()


def test_a_link_that_cannot_be_had_back_is_said_to_be_so(tmp_path):
    """Only then: nobody answers any more."""
    robot = DistantRobot(tmp_path, 0.02, 0.0, 0.0)
    clock, journal = RealClock(), HardwareLog(None, None)
    link = SerialLink(str(robot.path), BAUD, clock, journal)
    driver = KheperaIII(link, clock, journal, 0.5)
    robot._loss = 1.0
    with pytest.raises(StopNotConfirmedError), StopsAtTheEnd(driver.stop):
        pass
    link.close()
    robot.close()


class _Silent:
    def receive(self, _data):
        return b""

    def written(self):
        pass


@pytest.mark.parametrize(("clock", "longest_s"), [(RealClock(), 1.0), (EmulatedClock(np.inf), 20.0)])
def test_a_robot_s_port_that_takes_nothing_is_given_up_soon_and_a_busy_computer_s_is_not(tmp_path, clock, longest_s):
    with PseudoTerminal(_Silent(), tmp_path, "port") as line:
        link = SerialLink(str(line.path), 115200, clock, HardwareLog(None, None))
        assert link._serial.write_timeout == longest_s
        link.close()
