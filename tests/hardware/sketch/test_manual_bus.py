"""The sketch on a simulated Mega 2560 before servos that were written from the makers' manual alone."""

import pytest

from bns.errors import HardwareError
from bns.hardware.servos.bridge_frames import WATCHDOG_S
from bns.hardware.servos.servo_chain import ServoError

from ..manual_bus import DELAY, ID, TORQUE, ManualBus, ManualServo, angle_rad
from .simulated_board import Board, lacking

pytestmark = pytest.mark.skipif(bool(lacking()), reason=lacking())


@pytest.fixture
def board(built):
    """board(count, on_the_way, **registers) -> a board that has just got its power; servos as they come from the makers."""
    opened = []

    def power_on(count=12, on_the_way=None, **servo):
        bus = ManualBus([ManualServo(n + 1, **servo) for n in range(count)])
        bus.on_the_way = on_the_way or bus.on_the_way
        opened.append(Board(built, bus))
        return opened[-1]

    yield power_on
    for each in opened:
        each.close()


def holding(board):
    return [servo.table[TORQUE] for servo in board.bus.servos]


def sent_off(board, driver, angle_rad=0.4):
    driver.arm()
    return driver.move([angle_rad] * driver.count, [2.0] * driver.count)


def test_from_power_on_to_hello(board, driven):
    mega = board()
    driven(mega, 12)
    assert 0.5 < mega.now_s < 2.0
    assert mega.faults == 0


def test_arm_move_state_stop(board, driven):
    mega = board(steps=500, high=620)
    driver = driven(mega, 12)
    limit_rad = angle_rad(620)
    assert sent_off(mega, driver, 0.8) == pytest.approx([limit_rad] * 12, abs=0.006)
    mega.run_until(1.0)
    found = driver.health()
    assert [found[n].position_rad for n in range(1, 13)] == pytest.approx([limit_rad] * 12, abs=0.01)
    assert {(h.voltage_v, h.temperature_c) for h in found.values()} == {(11.8, 33.0)}
    stop = driver.stop()
    assert stop.confirmed
    assert stop.seconds <= 0.05
    assert not any(holding(mega))
    assert mega.faults == driver.retries == 0


@pytest.mark.parametrize("return_delay", [250, 0])
def test_a_stop_on_the_way(board, driven, return_delay):
    mega = board()
    for servo in mega.bus.servos:
        servo.table[DELAY] = return_delay
    driver = driven(mega, 12)
    sent_off(mega, driver)
    mega.run_until(0.15)
    driver.health()
    assert all(holding(mega))
    stop = driver.stop()
    assert stop.confirmed
    assert stop.seconds <= 0.05
    assert not any(holding(mega))
    assert mega.faults == driver.retries == 0


def test_silence_of_the_computer(board, driven):
    mega = board(count=3)
    driver = driven(mega, 3)
    sent_off(mega, driver)
    mega.run_until(0.2)
    driver.health()
    assert all(holding(mega))
    began_s = mega.now_s
    while any(holding(mega)) and mega.now_s < began_s + 1.0:
        mega.run(0.002)
    assert mega.now_s - began_s == pytest.approx(WATCHDOG_S, abs=0.02)


@pytest.mark.parametrize("byte", [0x00, 0x01, 0xFE, 0xFF])
def test_a_stray_byte_where_the_bus_is_turned_round(board, driven, byte):
    mega = board(count=3, steps=600)
    driver = driven(mega, 3)
    before = mega.answered
    for _ in range(3):
        mega.stray(byte)
        assert all(found.position_rad > 0.4 for found in driver.health().values())
    assert mega.answered - before == 3 * 3  # no servo was asked twice
    assert driver.retries == 0


def test_a_servo_that_does_not_answer_is_named(board, driven):
    mega = board(count=3)
    driver = driven(mega, 3)
    sent_off(mega, driver)
    mega.bus.on_the_way = lambda _count, number, packet: (0.0, b"" if number == 2 else packet)
    with pytest.raises(ServoError, match="servo 2 does not answer the bridge"):
        driver.health()
    stop = driver.stop(patience_s=0.2)
    assert not stop.confirmed
    assert "servos [2] did not stop" in stop.problem
    assert not any(holding(mega))  # it heard the order to all


def test_a_servo_that_does_not_answer_at_first_is_not_there(board, driven):
    mega = board(count=3, on_the_way=lambda _count, number, packet: (0.0, b"" if number == 3 else packet))
    with pytest.raises(HardwareError, match="has found 2 servos"):
        driven(mega, 3)


def test_an_alarm_is_named(board, driven):
    mega = board(count=3)
    driver = driven(mega, 3)
    mega.bus.servos[1].alarm = 32
    with pytest.raises(ServoError, match="servo 2: overload"):
        driver.health()


def spoilt(every):
    """Every such answer has one wrong bit: a position's, if it has one."""

    def on_the_way(count, _number, packet):
        place = min(6, len(packet) - 1)
        wrong = packet[:place] + bytes([packet[place] ^ 0x01]) + packet[place + 1 :]
        return 0.0, wrong if count % every == 0 else packet

    return on_the_way


def late(every, later_s):
    """Every such answer comes when the sketch has given it up."""
    return lambda count, _number, packet: (later_s if count % every == 0 else 0.0, packet)


@pytest.mark.parametrize("on_the_way", [spoilt(5), spoilt(3), late(7, 0.0035), late(7, 0.005), late(11, 0.012)], ids=range(5))
def test_spoilt_and_late_answers_are_asked_for_again(board, driven, on_the_way):
    mega = board(count=6)
    driver = driven(mega, 6)
    mega.bus.on_the_way = on_the_way
    sent_off(mega, driver)
    mega.run_until(0.2)
    for _ in range(6):
        found = driver.health()
        for servo in mega.bus.servos:
            assert found[servo.table[ID]].position_rad == pytest.approx(angle_rad(servo.steps), abs=0.08)
    stop = driver.stop()
    assert stop.confirmed
    assert not any(holding(mega))


def test_a_servo_that_keeps_its_torque_is_not_confirmed(board, driven):
    mega = board(count=3)
    driver = driven(mega, 3)
    sent_off(mega, driver)
    mega.run_until(0.2)
    mega.bus.servos[2].write = lambda _address, _data: 0  # deaf to the order
    stop = driver.stop(patience_s=0.2)
    assert not stop.confirmed
    assert "servos [3] did not stop" in stop.problem
