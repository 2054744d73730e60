"""What the Khepera's driver asks, when, and for how long it waits, against a link that answers by a script."""

from types import SimpleNamespace

import pytest

from bns.errors import HardwareError
from bns.hardware.link.hardware_log import HardwareLog
from bns.hardware.link.serial_link import NoReplyError
from bns.hardware.wheels.khepera import ATTEMPTS, KheperaIII
from bns.hardware.wheels.wheel_drive import RobotLostError

ANSWER_S = 0.0625


class Link:
    """Answers ``E`` with speeds in turn (None: nothing comes), everything else as the robot does; time passes as it waits."""

    def __init__(self, speeds=(), timeout_s=0.125, patience_s=10.0, deaf=()):
        self.times = SimpleNamespace(timeout_s=timeout_s, patience_s=patience_s)
        self.speeds, self.deaf, self.asked, self.t_s = list(speeds), set(deaf), [], 64.0
        self.nonsense = False

    def now_s(self):
        return self.t_s

    def exchange(self, request, timeout_s, again=False):
        self.asked.append((request.decode().strip(), round(timeout_s, 6), again))
        speeds = self.speeds.pop(0) if request == b"E\n" and self.speeds else (0, 0)
        if request in self.deaf or speeds is None:
            self.t_s += timeout_s
            raise NoReplyError(f"no answer to {request!r}")
        self.t_s += ANSWER_S
        if request == b"R\n" and self.nonsense:
            return b"d"
        said = {b"B\n": b"b,2,4", b"E\n": b"e,%d,%d" % speeds, b"R\n": b"r,2764,-2764", b"V,0\n": b"v,7,412 "}
        return said.get(request, b"d")

    def close(self):
        self.asked.append("closed")


def driver(link, **more):
    robot = KheperaIII(link, link, HardwareLog(None, link), **more)
    link.asked.clear()
    return robot


def test_a_question_is_waited_for_twice_as_long_each_time_and_never_beyond_the_patience():
    link = Link(patience_s=1.5)
    robot = driver(link)
    link.deaf = {b"R\n"}
    with pytest.raises(RobotLostError, match=r"asked 4 times in 1.5 s"):
        robot.encoders_m()
    assert link.asked == [("R", 0.125, False), ("R", 0.25, True), ("R", 0.5, True), ("R", 0.625, True)]
    assert robot.retries == ATTEMPTS - 1
    link.asked.clear()
    link.times.patience_s = 0.375
    with pytest.raises(RobotLostError, match="asked 2 times"):
        robot.encoders_m()
    assert [asked[1] for asked in link.asked] == [0.125, 0.25]


@pytest.mark.parametrize(("timeout_s", "asked"), [(0.03125, 5), (0.0625, 4), (0.25, 3)])
def test_a_quick_link_has_as_much_patience_as_a_slow_one(timeout_s, asked):
    link = Link(timeout_s=timeout_s, patience_s=0.8125)
    robot = driver(link)
    link.deaf = {b"R\n"}
    with pytest.raises(RobotLostError, match=rf"asked {asked} times in 0.8 s"):
        robot.encoders_m()


def test_answers_that_make_no_sense_are_not_asked_for_without_end():
    link = Link()
    robot = driver(link)
    link.nonsense = True
    with pytest.raises(RobotLostError, match=r"the answer to R was 'd'; asked 4 times"):
        robot.encoders_m()
    assert len(link.asked) == ATTEMPTS


def test_ways_voltage_and_speeds_are_in_metres_and_volts():
    robot = driver(Link(speeds=[(14401, -28802)]))
    assert robot.encoders_m() == pytest.approx((0.1288, -0.1288))
    assert robot.battery_v() == pytest.approx(7.0412)
    assert robot.speed_m_s() == pytest.approx((0.1, -0.2))


def test_a_robot_that_does_not_answer_at_first_is_named():
    with pytest.raises(HardwareError, match=r"no Khepera III answers .*PIN 0000.*115200 baud"):
        driver(Link(deaf={b"B\n"}))


def test_a_stop_is_one_order_and_two_readings_in_a_row():
    link = Link()
    stop = driver(link).stop()
    assert link.asked == [("D,l0,l0", 0.125, True), ("E", 0.125, True), ("E", 0.125, True)]
    assert (stop.confirmed, stop.seconds, stop.acknowledged_s, stop.problem) == (True, 3 * ANSWER_S, ANSWER_S, "")


@pytest.mark.parametrize(("speed", "stands"), [(720, True), (721, False)])
@pytest.mark.parametrize("wheel", [0, 1])
def test_each_wheel_must_be_slower_than_five_millimetres_a_second(speed, stands, wheel):
    readings = [(speed, 0) if wheel == 0 else (0, -speed)] * 2
    link = Link(speeds=readings)
    driver(link).stop()
    assert (len(link.asked) == 3) == stands


def test_a_reading_of_moving_wheels_begins_the_count_anew():
    link = Link(speeds=[(0, 0), (900, 0), (0, 0), (0, 0)])
    stop = driver(link).stop()
    assert [asked[0] for asked in link.asked] == ["D,l0,l0", "E", "E", "E", "E"]
    assert stop.confirmed


def test_the_order_is_given_again_only_where_it_shows_no_effect():
    link = Link(speeds=[(9000, 9000)] * 5)
    stop = driver(link).stop()
    orders = [n for n, asked in enumerate(link.asked) if asked[0] == "D,l0,l0"]
    assert orders == [0, 6]  # 0.25 s of readings later: more than twice the time that an answer may take
    assert stop.confirmed
    assert stop.acknowledged_s == ANSWER_S


def test_a_stop_that_nobody_acknowledges_is_given_up_after_the_rig_s_patience_and_says_why():
    link = Link(deaf={b"D,l0,l0\n", b"E\n"})
    stop = driver(link, stop_s=0.5).stop()
    assert (stop.confirmed, stop.acknowledged_s) == (False, None)
    assert 0.5 < stop.seconds <= 0.5 + link.times.timeout_s
    assert stop.problem == "no answer to b'D,l0,l0\\n'"
    assert driver(Link(deaf={b"D,l0,l0\n"})).stop(patience_s=0.25).seconds <= 0.375


def test_wheels_that_turn_on_are_the_problem():
    stop = driver(Link(speeds=[(9000, 0)] * 99)).stop(patience_s=1.0)
    assert (stop.confirmed, stop.problem) == (False, "the wheels still turn")
    assert stop.acknowledged_s == ANSWER_S
    assert 1.0 < stop.seconds < 1.2
