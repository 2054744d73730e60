"""The Khepera's driver against bytes on a pseudo-terminal."""

import errno

import numpy as np
import pytest

from bns.errors import HardwareError
from bns.hardware.emulators.devices.terminal import PseudoTerminal
from bns.hardware.link.hardware_log import HardwareLog
from bns.hardware.link.serial_link import SerialLink
from bns.hardware.platforms.khepera import WHEELS as KHEPERA_WHEELS
from bns.hardware.wheels.khepera import ATTEMPTS, STILL_M_S, check_battery, firmware
from bns.hardware.wheels.wheel_drive import RobotLostError
from bns.physics.model import load_model


def test_golden_bytes(bench):
    rig = bench()
    rig.driver.set_speed_m_s(0.1, -0.05)
    rig.driver.speed_m_s()
    rig.driver.battery_v()
    rig.driver.encoders_m()
    assert rig.sent() == ["B\n", "D,l14401,l-7200\n", "E\n", "V,0\n", "R\n"]


@pytest.mark.parametrize(
    ("line", "answer"),
    [
        (b"B\n", b"b,2,4\r\n"),
        (b"B\r", b"b,2,4\r\n"),
        (b"D,l20000,l20000\n", b"d\r\n"),
        (b"E\n", b"e,0,0\r\n"),
        (b"I,l0,l0\n", b"i\r\n"),
        (b"R\n", b"r,0,0\r\n"),
        (b"M\n", b"m\r\n"),
        (b"H,d0,d620,d10,d3\n", b"h\r\n"),
        (b"V\n", b"$\r\n"),
        (b"X\n", b"$\r\n"),
        (b"D,l1,l2,l3,l4,l5\n", b"$\r\n"),
        (b"D,l1234567890,l0\n", b"$\r\n"),
        (b"B\nM\n", b"b,2,4\r\nm\r\n"),
        (b"B", b""),
    ],
)
def test_emulator_answers_like_the_server(bench, line, answer):
    assert bench().emulator.receive(line) == answer


def test_sensors_answer_with_eleven_values_and_a_time(bench):
    assert bench().emulator.receive(b"N\n").count(b",") == 12


@pytest.mark.parametrize(
    ("typed", "left_units"), [(b"D,20000,20000\n", 0), (b"D,-20000,-20000\n", 20000), (b"D,l20000,l20000\n", 20000)]
)
def test_a_number_without_its_type_loses_its_first_character(bench, typed, left_units):
    rig = bench()
    rig.emulator.receive(typed)
    rig.clock.sleep(1.0)
    assert rig.driver.speed_m_s()[0] == pytest.approx(left_units / 144_010, abs=0.003)


@pytest.mark.parametrize("version", [2, 3])
def test_both_firmwares_drive_the_same_way_in_metres(bench, version):
    rig = bench(version)
    assert rig.driver.set_speed_m_s(0.1, 0.1) == pytest.approx((0.1, 0.1), abs=1e-5)
    rig.clock.sleep(2.0)
    assert rig.body.pose(rig.clock.now_s())[1] == pytest.approx(0.19, abs=0.01)
    assert rig.driver.speed_m_s() == pytest.approx((0.1, 0.1), abs=0.002)
    assert rig.driver.encoders_m() == pytest.approx((0.195, 0.195), abs=0.01)


def test_units_differ_between_firmwares():
    assert firmware(2, 9).units_per_m_s == 144_010
    assert firmware(3, 0).units_per_m_s == 218_720


def test_what_is_sent_after_clipping_is_returned(bench):
    rig = bench()
    assert rig.driver.set_speed_m_s(9.0, -9.0) == pytest.approx((43_000 / 144_010, -43_000 / 144_010))
    assert rig.sent()[-1] == "D,l43000,l-43000\n"


def test_lost_answers_are_asked_for_again_and_counted(bench, fault):
    rig = bench(2, fault("lost-reply", rate=0.3), seed=5)
    for speed in np.linspace(0.03, 0.2, 10):
        rig.driver.set_speed_m_s(speed, speed)
    assert rig.driver.retries > 0
    assert rig.driver.set_speed_m_s(0.1, 0.1)[0] == pytest.approx(0.1, abs=1e-4)


def test_garbled_answers_are_no_answers(bench, fault):
    rig = bench(2, fault("corrupt-reply", at_s=0.05, for_s=0.1))
    rig.clock.sleep(0.05)
    assert rig.driver.battery_v() == pytest.approx(7.9, abs=0.01)
    assert rig.driver.retries >= 1


def test_a_late_answer_is_not_taken_for_the_next_one(bench, fault):
    rig = bench(2, fault("late-reply", at_s=0.03))
    rig.clock.sleep(0.1)
    rig.driver.set_speed_m_s(0.1, 0.1)
    rig.clock.sleep(1.0)
    assert rig.driver.speed_m_s()[0] == pytest.approx(0.1, abs=0.003)


def test_a_robot_that_is_gone_is_lost_after_some_attempts(bench):
    rig = bench()
    rig.line.cut()
    with pytest.raises(RobotLostError, match=f"port .* is gone .*asked {ATTEMPTS} times"):
        rig.driver.set_speed_m_s(0.1, 0.1)


def test_there_is_no_watchdog(bench):
    rig = bench()
    rig.driver.set_speed_m_s(0.1, 0.1)
    rig.line.cut()
    rig.clock.sleep(10.0)
    assert rig.body.pose(rig.clock.now_s())[1] > 0.9


@pytest.mark.parametrize("speed_m_s", [0.02, 0.1, 0.2])
def test_stop_is_confirmed_by_still_wheels(bench, speed_m_s):
    rig = bench()
    rig.driver.set_speed_m_s(speed_m_s, speed_m_s)
    rig.clock.sleep(1.0)
    stop = rig.driver.stop()
    assert stop.confirmed
    assert stop.acknowledged_s <= 0.05
    assert stop.seconds <= 0.45
    before = rig.body.pose(rig.clock.now_s())
    rig.clock.sleep(5.0)
    assert np.hypot(*(rig.body.pose(rig.clock.now_s()) - before)[:2]) <= STILL_M_S * 0.1


def test_stop_outlasts_a_fault(bench, fault):
    rig = bench(2, fault("bus-fault", at_s=1.0, for_s=1.2))
    rig.driver.set_speed_m_s(0.2, 0.2)
    rig.clock.sleep(1.0)
    stop = rig.driver.stop()
    assert stop.confirmed
    assert 1.2 < stop.seconds < 2.0


def test_a_stop_that_nobody_confirms_is_not_confirmed(bench):
    rig = bench()
    rig.driver.set_speed_m_s(0.1, 0.1)
    rig.line.cut()
    stop = rig.driver.stop()
    assert not stop.confirmed
    assert stop.acknowledged_s is None
    assert "is gone" in stop.problem
    rig.line.plug_in()
    assert rig.driver.stop().confirmed


def test_wheels_that_turn_although_told_to_stop_are_no_stop(bench):
    rig = bench()
    rig.driver.set_speed_m_s(0.1, 0.1)
    rig.body.order = lambda *_: None  # takes the order, does not carry it out
    stop = rig.driver.stop(patience_s=1.0)
    assert not stop.confirmed
    assert "still turn" in stop.problem
    assert stop.acknowledged_s is not None


class Other:
    """A device that is no Khepera: it says something else, or nothing."""

    def __init__(self, clock, answer):
        self.clock, self.answer = clock, answer

    def receive(self, data):
        if not self.answer:
            self.clock.fell_silent()
        return self.answer

    def written(self):
        pass


@pytest.mark.parametrize("answer", [b"", b"OK\r\n", b"no end"])
def test_what_is_no_khepera_is_named_so(tmp_path, clock, answer, monkeypatch):
    monkeypatch.setattr("bns.hardware.clock._LONGEST_ANSWER_S", 0.1)
    from bns.hardware.wheels.khepera import KheperaIII

    journal = HardwareLog(None, clock)
    with PseudoTerminal(Other(clock, answer), tmp_path, "other") as line:
        link = SerialLink(str(line.path), 115200, clock, journal)
        with pytest.raises(HardwareError, match=r"no Khepera III answers .*switched on, paired"):
            KheperaIII(link, clock, journal)
        link.close()


def test_ports_that_cannot_be_used(tmp_path, clock, bench):
    journal = HardwareLog(None, clock)
    with pytest.raises(HardwareError, match=r"there is no port /dev/nowhere.*bns doctor"):
        SerialLink("/dev/nowhere", 115200, clock, journal)
    rig = bench()
    with pytest.raises(HardwareError, match="in use by another program"):
        SerialLink(str(rig.line.path), 115200, clock, journal)
    file = tmp_path / "file"
    file.write_text("")
    with pytest.raises(HardwareError, match="cannot be opened"):
        SerialLink(str(file), 115200, clock, journal)


def test_a_port_that_one_file_too_many_keeps_closed_is_not_said_to_be_no_port(clock, bench, monkeypatch):
    rig = bench()
    rig.link.close()
    monkeypatch.setattr("serial.serialposix.os.open", lambda *_: (_ for _ in ()).throw(OSError(errno.EMFILE, "too many")))
    with pytest.raises(HardwareError, match=r"khepera0 cannot be opened: too many files are open already\. .* \(ulimit -n\)\.$"):
        SerialLink(str(rig.line.path), 115200, clock, HardwareLog(None, clock))


def test_a_flat_battery_is_refused():
    check_battery(7.4)
    check_battery(6.0)
    for volts, shown in ((5.1, 5.1), (5.95, 5.95), (5.9761, 5.98), (5.9999, 5.9999)):  # as many digits as show that it is less
        with pytest.raises(HardwareError, match=rf"battery is at {shown} V; charge it to 6 V or more"):
            check_battery(volts)


def test_the_robot_driven_and_the_robot_modelled_have_the_same_wheelbase():
    assert KHEPERA_WHEELS.wheelbase_m == load_model("khepera").wheelbase_m == pytest.approx(0.0884)
