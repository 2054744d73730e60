"""The Arduino bridge: frames as documented, the driver against an emulated bridge."""

import itertools
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from bns import hardware
from bns.errors import HardwareError
from bns.hardware.emulators.devices.bridge import BOOT_S, BridgeEmulator
from bns.hardware.emulators.devices.servo import Servo
from bns.hardware.emulators.devices.terminal import PseudoTerminal
from bns.hardware.emulators.faults import Fault, Faults
from bns.hardware.link.hardware_log import HardwareLog
from bns.hardware.servos.bridge import BAUD, BridgeChain
from bns.hardware.servos.bridge_frames import (
    ANSWER,
    ARM,
    GOAL,
    POSITION,
    SERVO,
    STARTED_S,
    STATE,
    WATCHDOG_S,
    Frame,
    crc16,
    decoded,
    encoded,
    searched,
)
from bns.hardware.servos.servo_chain import RestartedServoError, ServoError, ServoLimits


@pytest.fixture
def bridge(tmp_path, clock):
    """bridge(*faults) -> driver, emulator."""
    opened = []

    def build(*faults, count=3, asked=3, limits=None, boot_s=BOOT_S, **registers):
        struck = Faults(tuple(faults), 1, "bridge")
        emulator = BridgeEmulator([Servo(n + 1, clock, struck, **registers) for n in range(count)], clock, struck, boot_s)
        line = PseudoTerminal(emulator, tmp_path, f"bridge{len(opened)}")
        emulator.send = line.send
        opened.extend([emulator, line])
        driver = BridgeChain(str(line.path), asked, clock, HardwareLog(None, clock), limits)
        opened.append(driver)
        return driver, emulator

    yield build
    for each in reversed(opened):
        each.close()


def test_golden_frames():
    assert crc16(b"123456789") == 0x29B1  # the check value of CRC-16/CCITT-FALSE
    assert encoded(Frame(1, 7, b"")).hex() == "a5000107" + crc16(b"\x00\x01\x07").to_bytes(2, "little").hex()


@settings(max_examples=60, deadline=None)
@given(st.binary(max_size=40), st.binary(max_size=30).filter(lambda b: b"\xa5" not in b), st.integers(0, 255))
def test_frames_are_found_among_noise(payload, noise, sequence):
    frame = Frame(3, sequence, payload)
    assert decoded(noise + encoded(frame) + b"rest") == (frame, b"rest")


@settings(max_examples=60, deadline=None)
@given(st.binary(min_size=1, max_size=20), st.data())
def test_a_changed_bit_is_noticed(payload, data):
    clean = bytearray(encoded(Frame(3, 1, payload)))
    place = data.draw(st.integers(2, len(clean) - 1))  # not start and length: those make another frame
    clean[place] ^= 1 << data.draw(st.integers(0, 7))
    assert decoded(bytes(clean))[0] is None


def test_half_a_frame_waits_for_the_rest():
    whole = encoded(Frame(4, 2, b"abc"))
    found, left = decoded(whole[:5])
    assert found is None
    assert decoded(left + whole[5:])[0] == Frame(4, 2, b"abc")
    with pytest.raises(ValueError, match="does not fit into a frame"):
        encoded(Frame(1, 1, bytes(256)))


def test_moving_through_the_bridge(bridge, clock):
    driver, emulator = bridge(ccw_angle_limit=600, limits=ServoLimits(torque=0.5))
    driver.arm()
    assert driver.move([0.2, -0.2, 2.0], [1.0, 1.0, 0.0]) == pytest.approx([0.2, -0.2, 0.45], abs=0.006)
    assert [s.get("moving_speed") for s in emulator.servos] == [86, 86, 1]
    for _ in range(3):
        clock.sleep(0.1)
        driver.health()
    assert driver.health()[1].position_rad == pytest.approx(0.2, abs=0.01)
    assert emulator.servos[0].get("torque_limit") == 511


def test_lost_frames_are_sent_again(bridge):
    driver, _ = bridge(Fault("lost-reply", rate=0.1), Fault("lost-request", rate=0.1))
    for _ in range(20):
        driver.health()
    assert driver.retries > 0


def test_the_watchdog_takes_the_torque_off(bridge, clock):
    driver, emulator = bridge()
    driver.arm()
    clock.sleep(0.9 * WATCHDOG_S)
    assert all(s.get("torque_enable") for s in emulator.servos)
    clock.sleep(0.2 * WATCHDOG_S)
    assert not any(s.get("torque_enable") for s in emulator.servos)


@pytest.mark.parametrize("loses", [{"torque_enable": 0}, {"torque_limit": 1023}])
def test_a_servo_that_restarts_behind_the_bridge_is_named(bridge, loses):
    driver, emulator = bridge()
    driver.health()
    driver.arm()
    driver.health()
    for name, value in loses.items():
        emulator.servos[1].put(name, value)
    with pytest.raises(RestartedServoError, match="servo 2 has restarted: its torque is off, or its limit is not what was set"):
        driver.health()
    emulator.servos[1].latched = 32  # an overload switches the torque off as well, and is its cause
    with pytest.raises(ServoError, match="servo 2: overload"):
        driver.health()
    emulator.servos[1].latched = 0
    assert driver.stop().confirmed
    assert driver.health()


def test_stop_is_read_back(bridge):
    driver, emulator = bridge()
    driver.arm()
    driver.move([1.0] * 3, [1.0] * 3)
    assert driver.stop().confirmed
    assert not any(s.get("torque_enable") for s in emulator.servos)


def test_a_stop_waits_for_joints_that_are_turned(bridge, clock):
    driver, emulator = bridge()
    driver.arm()
    driver.move([1.0] * 3, [1.0] * 3)
    clock.sleep(0.2)
    servo, real = emulator.servos[1], emulator.servos[1].update
    until_s = clock.now_s() + 0.3

    def sinking():
        real()
        servo.put("present_position", 512 + max(0, round(1000 * (until_s - clock.now_s()))))

    servo.update = sinking
    stop = driver.stop()
    assert stop.confirmed
    assert 0.3 < stop.seconds < 0.4
    assert stop.acknowledged_s < 0.05


def test_a_stop_of_joints_that_stand_is_timed_from_its_order(bridge, clock):
    driver, _ = bridge()
    clock.sleep(3.0)
    stop = driver.stop()
    assert stop.confirmed
    assert 0.0 < stop.acknowledged_s <= stop.seconds < 0.2


@pytest.mark.parametrize("sooner_s", [0.0, 40.0])
def test_a_stop_that_is_given_up_says_for_how_long_it_was_tried(bridge, clock, sooner_s):
    """From its order on, whenever that is."""
    driver, _ = bridge(Fault("silent-servo", at_s=0.0, for_s=1e9, servo=2))
    clock.sleep(sooner_s)
    stop = driver.stop(patience_s=0.5)
    assert (stop.confirmed, stop.acknowledged_s) == (False, None)
    assert 0.5 < stop.seconds < 0.8


@pytest.mark.parametrize(("steps", "looks"), [(0, 2), (1, 2), (-1, 2), (2, 3), (-2, 3)])
def test_a_joint_behind_the_bridge_stands_still_within_one_step_between_two_looks(bridge, steps, looks):
    """A reading may jump by one step of 0.29 degrees."""
    driver, _ = bridge()
    places, asked = [500, 500 + steps, 500 + steps], []

    def answer(*_):
        asked.append(places[len(asked)])
        return bytes(2) + b"".join(POSITION.pack(place) for place in (512, asked[-1], 512))

    driver._ask = answer
    assert driver.stop().confirmed
    assert len(asked) == looks


def test_no_question_has_the_number_of_one_of_the_255_before(bridge):
    driver, _ = bridge()
    numbers, real = [], driver._once

    def asked(frame, timeout_s):
        numbers.append(frame.sequence)
        return real(frame, timeout_s)

    driver._once = asked
    for _ in range(260):
        driver.health()
    assert [(b - a) % 256 for a, b in itertools.pairwise(numbers)] == [1] * 259
    assert set(numbers) == set(range(256))


def test_a_silent_servo_is_not_stopped(bridge):
    driver, _ = bridge(Fault("silent-servo", at_s=0.0, for_s=1e9, servo=2))
    stop = driver.stop(patience_s=0.5)
    assert not stop.confirmed
    assert "servos [2] did not stop" in stop.problem


def test_alarms_are_errors(bridge, clock):
    driver, _ = bridge(Fault("overload", at_s=0.5, for_s=1.0, servo=3))
    clock.sleep(0.6)
    with pytest.raises(ServoError, match="servo 3: overload; fix the cause, then switch the servos off and on"):
        driver.health()


def test_other_bridges_are_refused(bridge, monkeypatch):
    with pytest.raises(HardwareError, match="has found 2 servos; version 4 and 3 servos are needed"):
        bridge(count=2)
    monkeypatch.setattr("bns.hardware.emulators.devices.bridge.VERSION", 1)
    with pytest.raises(HardwareError, match=r"speaks version 1 .*Load the sketch of this bns"):
        bridge()


def test_a_bridge_of_version_3_is_still_driven(bridge, clock, monkeypatch):
    """Its hello is two bytes long."""
    monkeypatch.setattr(BridgeEmulator, "_hello", lambda emulator: bytes([3, len(emulator.servos)]))
    driver, _emulator = bridge(ccw_angle_limit=530)
    assert (driver.count, driver.retries) == (3, 0)
    driver.arm()
    driver.move([0.05] * 3, [1.0] * 3)
    clock.sleep(0.3)
    assert driver.health()[1].position_rad == pytest.approx(0.05, abs=0.01)
    assert driver.stop().confirmed


@pytest.mark.parametrize("hello", [b"", b"\x03", b"\x04\x03\x00"])
def test_a_hello_of_another_length_is_no_hello(bridge, monkeypatch, hello):
    monkeypatch.setattr(BridgeEmulator, "_hello", lambda emulator: hello)
    with pytest.raises(HardwareError, match="no bridge answers at"):
        bridge()


def test_the_driver_keeps_silent_until_the_board_has_started(bridge, clock):
    waited_s = []
    while not waited_s or (waited_s[-1] >= STARTED_S and len(waited_s) < 5):  # emulated time does not wait for a busy kernel
        began_s = clock.now_s()
        _, emulator = bridge()
        waited_s.append(clock.now_s() - began_s)
        assert not emulator.boot_loader_heard  # it would have waited for five seconds more
    assert waited_s[-1] < STARTED_S


def test_a_board_that_does_not_start_anew_is_asked(bridge, clock):
    driver, _ = bridge(boot_s=0.0)
    assert clock.now_s() >= STARTED_S
    assert len(driver.health()) == 3


def test_a_start_byte_before_an_answer_hides_nothing(bridge):
    frame = Frame(4, 2, b"abc")
    assert searched(b"\xa5\xff" + encoded(frame) + b"x") == (frame, b"x")
    assert searched(b"\xa5\xff" + encoded(frame)[:-1])[0] is None


def test_nonsense_is_refused_by_the_bridge(bridge):
    driver, _ = bridge()
    with pytest.raises(ServoError, match=r"refuses to turn the torque on.*; asked 6 times"):
        driver._ask(ARM, bytes([101]), 0)


def test_a_computer_that_was_too_busy_is_told_of_the_watchdog(bridge, clock):
    driver, _ = bridge()
    driver.arm()
    driver.move([0.0] * 3, [1.0] * 3)
    clock.sleep(1.1 * WATCHDOG_S)
    with pytest.raises(ServoError, match=r"refuses to move \(its watchdog took the torque off .* for 0\.5 s.*asked 6 times"):
        driver.move([0.0] * 3, [1.0] * 3)


@pytest.mark.parametrize(("register", "share"), [(0, 0.0), (512, 512 / 1023), (1023, 1.0), (1024 + 512, -512 / 1023)])
def test_a_load_is_a_share_of_the_largest_torque_with_its_sign(bridge, register, share):
    """Present load of the AX-12's manual: ten bits, and bit 10 for clockwise."""
    driver, _ = bridge()
    state = SERVO.pack(512, register, 30, 120, 0) * 3
    driver._state = lambda: state
    assert [one.load for one in driver.health().values()] == pytest.approx([share] * 3)


def test_driver_and_sketch_talk_at_the_same_speed():
    sketch = (Path(hardware.__file__).parent / "bridge_sketch" / "bridge_sketch.ino").read_text()
    assert f"Serial.begin({BAUD});" in sketch


def test_a_speed_of_nothing_is_sent_as_the_slowest_and_not_as_full_speed(bridge):
    driver, _ = bridge()
    sent = []
    driver._ask = lambda _kind, payload, _size: sent.append(payload) or payload
    driver.move([0.0] * 3, [0.0, -1.0, 1000.0])
    assert [steps for _, steps in GOAL.iter_unpack(sent[0])] == [1, 86, 1023]


def test_goals_beyond_what_a_servo_can_turn_to_are_its_first_and_last_step(bridge):
    """The AX-12 has 1,024 steps over 300 degrees; 0 rad is step 512."""
    driver, _ = bridge()
    sent = []
    driver._ask = lambda _kind, payload, _size: sent.append(payload) or payload
    angles = driver.move([-9.0, 0.0, 9.0], [1.0] * 3)
    assert [goal for goal, _ in GOAL.iter_unpack(sent[0])] == [0, 512, 1023]
    assert np.degrees(angles) == pytest.approx([-512 / 1023 * 300, 0.0, 511 / 1023 * 300])


@pytest.mark.parametrize(("celsius", "decivolts", "said"), [(66, 120, "servo 2 is at 66 °C"), (30, 89, r"servo 2 has 8\.9 V")])
def test_a_servo_behind_the_bridge_must_keep_its_limits(bridge, celsius, decivolts, said):
    driver, _ = bridge()
    good = SERVO.pack(512, 0, 30, 120, 0)
    driver._state = lambda: good + SERVO.pack(512, 0, celsius, decivolts, 0) + good
    with pytest.raises(ServoError, match=said):
        driver.health()


def test_an_answer_to_an_older_question_is_passed_over(bridge):
    driver, _ = bridge()
    driver.close()
    old, new = (SERVO.pack(place, 0, 30, 120, 0) * 3 for place in (100, 512))
    came = b"".join(encoded(Frame(STATE | ANSWER, driver._sequence + n, data)) for n, data in enumerate((old, new)))
    quiet = {"reset_input_buffer": lambda: None, "write": len, "close": lambda: None}
    driver._serial = SimpleNamespace(in_waiting=len(came), read=lambda _count: came, **quiet)
    assert [one.position_rad for one in driver.health().values()] == [0.0] * 3
