"""The Arduino's sketch on a simulated Mega 2560: real core, real boot loader, between the driver and emulated servos."""

import os

import pytest

from bns.errors import HardwareError
from bns.hardware.emulators.devices.bridge import BOOT_S, BridgeEmulator
from bns.hardware.emulators.devices.servo import Servo
from bns.hardware.emulators.faults import Fault, Faults
from bns.hardware.servos.bridge_frames import HELLO, MOVE, START, STATE, STOP, WATCHDOG_S, Frame, decoded, encoded
from bns.hardware.servos.servo_chain import ServoError, ServoLimits

from .simulated_board import Board, EmulatedBus, lacking

pytestmark = pytest.mark.skipif(bool(lacking()), reason=lacking())


@pytest.fixture
def board(built, clock):
    """board(*faults, count, **registers) -> a board that has just got its power."""
    opened = []

    def power_on(*faults, count=3, **registers):
        struck = Faults(tuple(faults), 1, "bus")
        servos = [Servo(n + 1, clock, struck, **registers) for n in range(count)]
        opened.append(Board(built, EmulatedBus(servos, clock, struck)))
        return opened[-1]

    yield power_on
    for each in opened:
        each.close()


def answers(board, question, wait_s=0.2):
    """The frames that answer these bytes."""
    data = told(board, question, wait_s)
    found = []
    while True:
        frame, data = decoded(data)
        if frame is None:
            return found
        found.append(frame)


def told(board, question, wait_s):
    """Bytes in, bytes out, after so much of the board's time."""
    port = os.open(board.path, os.O_RDWR | os.O_NOCTTY | os.O_NONBLOCK)
    try:
        os.write(port, question)
        board.run_until(wait_s)
        return os.read(port, 4096)
    except BlockingIOError:
        return b""
    finally:
        os.close(port)


def torque(board):
    return [bool(s.get("torque_enable")) for s in board.bus.servos]


def test_from_power_on_the_board_answers_within_two_seconds(board, driven):
    mega = board(count=12)
    driven(mega, 12)
    assert 0.5 < mega.now_s < 2.0
    assert mega.faults == 0


def test_opening_the_port_starts_it_anew(board, driven):
    mega = board(torque_enable=1)
    driven(mega).close()
    began_s = mega.now_s
    mega.reset()
    driven(mega)
    assert 0.5 < mega.now_s - began_s < 2.0


def test_a_byte_holds_up_the_boot_loader(board, driven):
    mega = board()
    mega.run_until(0.3)
    assert answers(mega, encoded(Frame(HELLO, 1, b"")), 4.5) == []  # what the driver must not do, and why
    assert answers(mega, b"", 1.0)[0].kind == HELLO | 0x80


def test_the_emulated_board_starts_as_the_real_one(board, clock):
    mega = board()
    while not answers(mega, b"", 0.03) and mega.now_s < 2.0 * BOOT_S:  # longer than the frame, which is in one of them
        pass
    assert mega.now_s == pytest.approx(BOOT_S, abs=0.05)


def test_the_driver_drives_through_the_sketch(board, driven):
    mega = board(ccw_angle_limit=600, present_position=520)
    driver, servos = driven(mega, limits=ServoLimits(torque=0.5)), mega.bus.servos
    driver.arm()
    assert [s.get("goal_position") for s in servos] == [520] * 3
    assert driver.move([0.2, -0.2, 2.0], [1.0, 1.0, 0.0]) == pytest.approx([0.2, -0.2, 0.45], abs=0.006)
    assert [s.get("moving_speed") for s in servos] == [86, 86, 1]
    grown = []
    for _ in range(4):
        driver.health()
        grown.append(servos[0].get("torque_limit"))
        mega.run_until(0.06)
    driver.health()
    assert grown == sorted(grown)
    assert [s.get("torque_limit") for s in servos] == [511] * 3  # in steps
    assert driver.health()[1].position_rad == pytest.approx(0.2, abs=0.02)
    assert driver.stop().confirmed
    assert not any(torque(mega))
    assert mega.faults == driver.retries == 0
    with pytest.raises(ServoError, match="asked 6 times"):  # not armed any more
        driver.move([0.0] * 3, [1.0] * 3)


@pytest.mark.parametrize("loses", [{"torque_enable": 0}, {"torque_limit": 1023}])
def test_a_servo_that_restarts_is_named_once_the_torque_has_grown(board, driven, loses):
    mega = board()
    driver = driven(mega)
    driver.arm()
    driver.health()  # the torque still grows
    mega.run_until(0.7 * WATCHDOG_S)
    driver.health()
    for name, value in loses.items():
        mega.bus.servos[1].put(name, value)
    with pytest.raises(ServoError, match="servo 2 has restarted"):
        driver.health()
    assert driver.stop().confirmed
    assert driver.health()


def test_twelve_servos_stop_within_fifty_milliseconds(board, driven):
    mega = board(count=12)
    driver = driven(mega, 12)
    driver.arm()
    driver.move([0.5] * 12, [1.0] * 12)
    driver.health()
    assert all(torque(mega))
    stop = driver.stop()
    assert stop.confirmed
    assert stop.seconds <= 0.05
    assert not any(torque(mega))


def test_a_computer_that_falls_silent_loses_the_torque(board, driven):
    mega = board()
    driver = driven(mega)
    driver.arm()
    for _ in range(2):  # the torque comes on servo by servo, after the answer
        driver.health()
    assert all(torque(mega))
    began_s = mega.now_s
    while any(torque(mega)) and mega.now_s < began_s + 1.0:
        mega.run(0.002)
    assert mega.now_s - began_s == pytest.approx(WATCHDOG_S, abs=0.02)


def test_a_servo_that_is_silent_is_named(board, driven):
    mega = board(Fault("silent-servo", at_s=1.5, for_s=1e9, servo=2))
    driver = driven(mega)
    mega.run_until(1.5 - mega.now_s)
    with pytest.raises(ServoError, match="servo 2 does not answer the bridge"):
        driver.health()
    assert "servos [2] did not stop" in driver.stop(patience_s=0.2).problem


@pytest.mark.parametrize("byte", [0x00, 0x01, 0xFE, 0xFF])
def test_a_stray_byte_where_the_bus_is_turned_round_costs_nothing(board, driven, byte):
    mega = board(present_position=600)
    driver = driven(mega)
    before = mega.answered
    for _ in range(3):
        mega.stray(byte)
        assert all(found.position_rad > 0.4 for found in driver.health().values())
    assert mega.answered - before == 3 * 3  # no servo was asked twice
    assert driver.retries == 0


@pytest.mark.parametrize("noise", [b"\xa5", b"\x00", b"\xa5\xff\x04", b"\xff\xa5\xa5"])
def test_stray_bytes_from_the_computer_are_passed_over(board, driven, noise):
    mega = board()
    driven(mega).close()
    found = answers(mega, noise + encoded(Frame(STATE, 9, b"")))
    assert [(f.kind, f.sequence) for f in found] == [(STATE | 0x80, 9)]


def test_a_question_that_comes_while_servos_are_asked_is_kept(board, driven):
    mega = board(count=12)
    driven(mega, 12).close()
    many = encoded(Frame(STATE, 1, b"")) + encoded(Frame(MOVE, 2, bytes(48))) + encoded(Frame(MOVE, 3, bytes(48)))
    assert [f.sequence for f in answers(mega, many)] == [1, 2, 3]
    assert mega.faults == 0


def test_a_board_that_is_held_up_is_said(board, driven):
    mega = board()
    mega.run_until(0.1)
    answers(mega, b"x", 0.01)
    with pytest.raises(HardwareError, match="no bridge answers"):
        driven(mega)


@pytest.mark.parametrize(
    "question",
    [
        encoded(Frame(HELLO, 7, b"")),
        b"noise\xa5" + encoded(Frame(STATE, 8, b"")),
        encoded(Frame(STOP, 9, b"")),
        encoded(Frame(MOVE, 10, bytes(12))),  # not armed: refused
        encoded(Frame(MOVE, 11, bytes(3))),
        encoded(Frame(99, 12, b"?")),
        bytes([START, 200, STATE]) + encoded(Frame(STATE, 13, b"")),  # a torn frame before it
    ],
)
def test_sketch_and_emulator_answer_the_same_bytes(board, driven, clock, question):
    mega = board(present_position=600)
    driven(mega).close()
    emulator = BridgeEmulator([Servo(n + 1, clock, Faults(), present_position=600) for n in range(3)], clock, boot_s=0.0)
    said = []
    emulator.send = said.append
    by_emulator = emulator.receive(question)
    if not by_emulator:  # it waits for the rest of a frame that never comes
        clock.sleep(0.1)
        by_emulator = b"".join(said)
    emulator.close()
    assert answers(mega, question) == [decoded(by_emulator)[0]]
