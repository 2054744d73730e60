"""What counts as a confirmed stop, against a robot whose every answer is written down here."""

import itertools
import re
from types import SimpleNamespace

import numpy as np
import pytest

from bns.hardware.link.hardware_log import HardwareLog, events
from bns.hardware.link.reply_time import ReplyTime
from bns.hardware.link.serial_link import NoReplyError
from bns.hardware.platform import Driven
from bns.hardware.rig import shipped_rig
from bns.hardware.servos.servo_chain import Health, ServoError, ServoLimits
from bns.hardware.stop import Stop
from bns.hardware.wheels.khepera import KheperaIII, firmware
from bns.trial.driver import TrialDriver
from bns.trial.operator import Decision

TURNS, STILL = 5000, 700
"""Speeds in units of firmware 2; 720 are 5 mm/s."""


class Ticking:
    """A clock on which each question takes 10 ms."""

    def __init__(self):
        self.t_s = 0.0

    def now_s(self):
        return self.t_s


class Scripted:
    """A link to a robot that reads back these speeds, one after the other."""

    def __init__(self, clock, readings, version=2):
        self.clock, self.readings, self.version, self.asked = clock, iter(readings), version, 0
        self.times = ReplyTime()

    def exchange(self, request, timeout_s, again=False):
        self.clock.t_s += 0.01
        if request.startswith(b"E"):
            self.asked += 1
            return b"e,%d,%d" % next(self.readings)
        answers = {b"B": b"b,%d,0" % self.version, b"D": b"d", b"R": b"r,10000,-20000"}
        return answers[request[:1]]


def stopped(readings, patience_s=1.0):
    clock = Ticking()
    link = Scripted(clock, readings)
    driver = KheperaIII(link, clock, HardwareLog(None, clock))
    return driver.stop(patience_s), link.asked


@pytest.mark.parametrize("speeds", [(0, TURNS), (TURNS, 0), (0, -TURNS), (-TURNS, 0), (-TURNS, TURNS)])
def test_a_stop_with_one_wheel_turning_is_none(speeds):
    stop, _ = stopped(itertools.repeat(speeds))
    assert not stop.confirmed
    assert "still turn" in stop.problem


@pytest.mark.parametrize(("silent_s", "said"), [(0.3, "the wheels still turn"), (0.7, "no answer to b'E")])
def test_wheels_that_turn_are_said_to_though_the_last_question_was_cut_off(silent_s, said):
    clock = Ticking()
    link = Scripted(clock, itertools.repeat((TURNS, TURNS)))
    answered = link.exchange

    def exchange(request, timeout_s, again=False):
        if clock.t_s > 1.0 - silent_s:
            clock.t_s += 0.01
            raise NoReplyError(f"no answer to {request!r} within {timeout_s:.2g} s")
        return answered(request, timeout_s, again)

    link.exchange = exchange
    stop = KheperaIII(link, clock, HardwareLog(None, clock)).stop(0.98)
    assert not stop.confirmed
    assert re.match(said, stop.problem)


def test_one_reading_of_still_wheels_is_none():
    stop, asked = stopped(itertools.cycle([(0, 0), (TURNS, TURNS)]))
    assert not stop.confirmed
    stop, asked = stopped(itertools.chain([(0, 0), (TURNS, TURNS), (0, 0)], itertools.repeat((STILL, -STILL))))
    assert stop.confirmed
    assert asked == 4  # the two in a row are the third and the fourth


def test_still_is_slower_than_five_millimetres_a_second():
    assert stopped(itertools.repeat((720, 720)))[0].confirmed
    assert not stopped(itertools.repeat((721, 0)))[0].confirmed


@pytest.mark.parametrize(
    ("version", "left_m", "right_m"),
    [
        (2, 0.46599, -0.93198),  # 0.1288 m a turn of the wheel, 2764 pulses
        (3, 0.3068, -0.6136),  # 30.68 um a pulse
    ],
)
def test_pulses_in_metres(version, left_m, right_m):
    clock = Ticking()
    driver = KheperaIII(Scripted(clock, (), version), clock, HardwareLog(None, clock))
    assert driver.encoders_m() == pytest.approx((left_m, right_m), rel=1e-4)


def test_scales_of_the_firmwares():
    assert firmware(2, 9).m_per_pulse == pytest.approx(46.599e-6, rel=1e-4)
    assert firmware(3, 0).m_per_pulse == pytest.approx(30.68e-6, rel=1e-9)


@pytest.mark.parametrize(("voltage", "fits"), [(8.9, False), (9.0, True), (12.5, True), (12.6, False), (16.0, False)])
def test_too_much_and_too_little_voltage(voltage, fits):
    said = {1: Health(0.0, 0.0, 11.0, 40.0), 2: Health(0.0, 0.0, voltage, 40.0)}
    if fits:
        ServoLimits().check(said)
    else:
        with pytest.raises(ServoError, match=rf"servo 2 has {voltage} V, not 9 to 12\.5"):
            ServoLimits().check(said)


def test_a_drive_is_on_the_disk_before_anybody_is_asked_about_it(tmp_path):
    path, clock = tmp_path / "journal.jsonl", Ticking()
    commands, poses = np.zeros((1, 3)), np.zeros((2, 3))
    platform = SimpleNamespace(
        pose=lambda: np.zeros(3), readings=dict, drive=lambda _c: Driven(commands, poses, [], Stop(True, 0.1, 0.1, ""))
    )
    there = []

    def asked(_summary, _spans):
        there.extend(event["kind"] for event in events(path))
        return Decision("next")

    operator = SimpleNamespace(accept=asked, place=lambda *_: None, arm=lambda _what: None, wants_picture=False)
    log = HardwareLog(path, clock)
    TrialDriver(platform, operator, shipped_rig("khepera"), np.zeros(3), clock, log).evaluate(1, commands)
    assert "driven" in there
    log.close()
