"""Servos of the X series: driver, guard, and a whole snake of them."""

import time
from dataclasses import replace

import numpy as np
import pytest

from bns.errors import HardwareError
from bns.hardware.emulators.devices.bus import Bus
from bns.hardware.emulators.devices.servo import Servo
from bns.hardware.emulators.devices.terminal import PseudoTerminal
from bns.hardware.emulators.faults import Fault, FaultPlan, Faults
from bns.hardware.guard.order import StopOrder
from bns.hardware.guard.recipe import bus_recipe
from bns.hardware.link.hardware_log import HardwareLog
from bns.hardware.platforms import snake
from bns.hardware.rig import shipped_rig
from bns.hardware.safety import Stopping
from bns.hardware.servos.ax12_table import AX12
from bns.hardware.servos.dynamixel import DynamixelChain
from bns.hardware.servos.packets import BROADCAST, WIRES
from bns.hardware.servos.servo_chain import ServoError
from bns.hardware.servos.snake_settings import snake_settings
from bns.hardware.servos.x430_table import X430, XL430_W250, XM430_W350
from bns.physics.snake.body import Body
from bns.physics.snake.parameters import shipped_parameters

from .watched import speeds_under_torque

IDS = (1, 2, 3)
TWO = WIRES[2]
SET_UP = {"baud_rate": 3}


def test_tables_do_not_overlap_and_know_their_models():
    for table in X430:
        taken = [r.address + i for r in table.registers.values() for i in range(r.size)]
        assert len(taken) == len(set(taken))
    assert [table.number for table in X430] == [1060, 1020, 1030]
    assert (XL430_W250.gapless, AX12.gapless) == (False, True)


def test_either_protocol_says_that_an_instruction_arrived_damaged():
    """Protocol 2.0: error number 3, beside the alarm bit or without; protocol 1.0: bit 4, beside others or alone."""
    assert [XL430_W250.garbled(error) for error in (0, 2, 3, 4, 0x80, 0x83)] == [False, False, True, False, False, True]
    assert [AX12.garbled(error) for error in (0, 0x10, 0x20, 0x30)] == [False, True, False, True]
    assert [error for error in range(256) if XL430_W250.garbled(error)] == [3, 0x83]


@pytest.mark.parametrize(
    ("bits", "hardware", "said"),
    [
        (0x06, 0, "value beyond a limit"),
        (0x86, 0x20, "overload, value beyond a limit"),
        (0x80, 0x24, "overheated, overload"),
        (0x80, 0, "an alarm that has ended"),
        (0x09, 0, "error 9"),
    ],
)
def test_an_error_byte_names_the_alarms_and_why_an_instruction_was_refused(bits, hardware, said):
    """Protocol 2.0: bit 7 says that `hardware_error` holds alarms, the other seven are a number."""
    assert XL430_W250.in_words(bits, hardware) == said
    assert AX12.in_words(0x01 | 0x20) == "voltage out of its limits, overload"


@pytest.mark.parametrize(
    ("table", "name", "value", "raw"),
    [  # two's complement; of an AX-12 the magnitude, and bit 10 for the other direction
        (XL430_W250, "present_load", -885, 0xFC8B),
        (XL430_W250, "present_load", 0x7FFF, 0x7FFF),
        (XL430_W250, "present_load", -0x8000, 0x8000),
        (XL430_W250, "present_position", -1, 0xFFFFFFFF),
        (XL430_W250, "present_position", 0x40000000, 0x40000000),
        (AX12, "present_load", -300, 1024 + 300),
        (AX12, "present_load", 1023, 1023),
    ],
)
def test_a_value_below_nothing_stands_in_a_register_as_the_manual_says(table, name, value, raw):
    assert table.raw(name, value) == raw
    assert table.value(name, raw) == value


@pytest.fixture
def chain(tmp_path, clock):
    """chain(*faults, kind, **registers) -> driver, bus, line."""
    opened = []

    def build(*faults, kind=XL430_W250, ids=IDS, **registers):
        struck = Faults(tuple(faults), 1, "bus")
        bus = Bus([Servo(n, clock, struck, None, kind, **SET_UP | registers) for n in ids], clock, struck)
        line = PseudoTerminal(bus, tmp_path, f"bus{len(opened)}")
        opened.append(line)
        bus.baud = line.baud
        limits = snake_settings({"protocol": 2, "model": kind.model}).limits
        driver = DynamixelChain(str(line.path), IDS, clock, HardwareLog(None, clock), limits, kind)
        opened.append(driver)
        return driver, bus, line

    yield build
    for each in reversed(opened):
        each.close()


@pytest.mark.parametrize("kind", X430)
def test_a_chain_arms_moves_and_stops(chain, clock, kind):
    driver, bus, _ = chain(kind=kind, present_position=2400)
    driver.arm()
    for servo in bus.servos:
        assert servo.get("torque_enable") == 1
        assert servo.get("goal_position") == servo.get("present_position") == 2400
        assert servo.get("torque_limit") == round(0.8 * 885)
    sent = driver.move([0.5, -0.5, 9.0], [1.0, 1.0, 0.0])
    assert sent == pytest.approx([0.5, -0.5, (4095 - 2048) * 2 * np.pi / 4096], abs=0.001)
    assert [s.get("moving_speed") for s in bus.servos] == [42, 42, 1]  # 1 rad/s is 9.549 turns a minute
    began_s, before = clock.now_s(), driver.health()[2].position_rad
    clock.sleep(0.25)
    found = driver.health()[2]
    assert (found.position_rad - before) / (clock.now_s() - began_s) == pytest.approx(-1.0, abs=0.05)
    assert (found.load, found.voltage_v, found.temperature_c) == (pytest.approx(-0.8, abs=0.01), 12.0, 30.0)
    stop = driver.stop()
    assert stop.confirmed
    assert stop.seconds <= 0.2
    assert not any(s.get("torque_enable") for s in bus.servos)


def test_a_servo_that_restarts_is_found_in_turn_or_when_all_are_asked(chain):
    driver, bus, _ = chain()
    driver.health()
    driver.check_torque()
    driver.arm()
    for _ in range(2 * len(IDS)):
        driver.health()
    driver.check_torque()
    bus.servos[1].reboot()
    with pytest.raises(ServoError, match="servo 2 has restarted: its torque is off"):
        driver.check_torque()
    with pytest.raises(ServoError, match="servo 2 has restarted: its torque is off"):
        _ = [driver.health() for _ in IDS]


@pytest.mark.parametrize("kind", X430)
def test_torque_never_comes_on_with_the_speed_that_a_servo_was_left_at(chain, kind):
    driver, bus, _ = chain(kind=kind, moving_speed=500)
    speeds = speeds_under_torque(bus.servos)
    driver.arm()
    assert speeds == {number: {1} for number in IDS}


def test_answers_that_must_be_stuffed_arrive(chain):
    """A joint that turns back slowly, at a place that ends in FD: FF FF FF FF FD."""
    driver, bus, _ = chain()
    servo = bus.servos[0]
    servo.update = lambda: None
    servo.put("present_speed", -1)
    servo.put("present_position", 0x07FD)
    assert TWO.status(1, 0, bytes(servo.table[124:147])).count(b"\xff\xff\xfd\xfd") == 1
    assert driver.health()[1].position_rad == pytest.approx((0x07FD - 2048) * 2 * np.pi / 4096)


def test_lost_and_garbled_answers_are_asked_for_again(chain):
    driver, *_ = chain(Fault("lost-reply", rate=0.06), Fault("corrupt-reply", rate=0.06))
    driver.arm()
    for angle in (0.1, 0.2, 0.3):
        driver.move([angle] * 3, [1.0] * 3)
    assert driver.retries > 0


@pytest.mark.parametrize(
    ("build", "message"),
    [
        ({"ids": (1, 2)}, "servo 3 is missing"),
        ({"ids": (1, 2, 2, 3)}, "servo 2: answers are garbled|servo 2 is missing"),
        ({"model_number": 1020}, "servo 1 is of the model XM430-W350, not XL430-W250"),
        ({"operating_mode": 1}, r"servo 1 has operating_mode 1, not 3 \(bns servos check --fix"),
        ({"drive_mode": 8}, "servo 1 has drive_mode 8, not 0"),  # torque would come on with any goal
        ({"baud_rate": 1}, "none of the 3 servos answers"),
    ],
)
def test_chains_that_cannot_be_used(chain, build, message):
    with pytest.raises(HardwareError, match=message):
        chain(**build)


def test_a_speed_beyond_what_a_register_holds_is_sent_as_the_highest_that_it_holds(chain):
    driver, bus, _ = chain()
    driver.move([0.1] * 3, [1e6] * 3)
    assert {servo.get("moving_speed") for servo in bus.servos} == {32767}


@pytest.mark.parametrize("alarms", [False, True])
def test_who_lets_alarms_pass_is_told_all_the_same_that_an_instruction_was_refused(chain, alarms):
    driver, bus, _ = chain()
    with pytest.raises(ServoError, match="servo 2: value out of range"):
        driver.write(2, "goal_position", 4096, alarms=alarms)
    assert bus.servos[1].get("goal_position") == 2048


def test_an_overload_is_named_and_stays_until_the_servo_is_rebooted(chain, clock):
    driver, bus, _ = chain(Fault("overload", at_s=1.0, for_s=1.0, servo=2))
    driver.arm()
    clock.sleep(1.0)
    with pytest.raises(ServoError, match="servo 2: overload"):
        driver.health()
    clock.sleep(2.0)
    with pytest.raises(ServoError, match="servo 2: overload"):
        driver.write(2, "torque_enable", 1)
    assert bus.servos[1].get("torque_enable") == 0
    driver.recover(2)
    driver.health()
    assert bus.servos[1].get("hardware_error") == 0


@pytest.mark.parametrize(
    ("kind", "decivolts", "said"),
    [
        (XL430_W250, 64, "6.4 V, not 6.5 to 12.5"),
        (XL430_W250, 65, ""),
        (XL430_W250, 74, ""),
        (XL430_W250, 130, "13.0 V, not 6.5 to 12.5"),
        (XM430_W350, 148, ""),
        (XM430_W350, 96, "9.6 V, not 10 to 15.3"),
    ],
)
def test_voltages_are_those_of_the_model(chain, kind, decivolts, said):
    driver, *_ = chain(kind=kind, present_voltage=decivolts)
    if not said:
        assert driver.health()[1].voltage_v == decivolts / 10
        return
    with pytest.raises(ServoError, match=f"servo 1 has {said}"):
        driver.health()


def test_a_silent_servo_leaves_the_stop_unconfirmed(chain, clock):
    driver, *_ = chain(Fault("silent-servo", at_s=1.0, for_s=1e9, servo=2))
    driver.arm()
    clock.sleep(1.0)
    stop = driver.stop(patience_s=0.5)
    assert not stop.confirmed
    assert "servo 2" in stop.problem
    assert "servo 1" not in stop.problem


def test_a_servo_that_keeps_its_torque_leaves_the_stop_unconfirmed(chain):
    driver, bus, _ = chain()
    driver.arm()
    bus.servos[1].write = lambda *_: 0  # deaf to the order
    stop = driver.stop(patience_s=0.5)
    assert (stop.confirmed, stop.problem) == (False, "servo 2: torque still on")


def test_an_order_to_all_that_is_heard_late_ends_no_other_question(chain):
    driver, bus, _ = chain()
    driver.arm()
    bus.servos[1].write = lambda *_: 0
    receive = bus.receive

    def slowly(data):
        if data[4:5] == bytes([BROADCAST]):
            time.sleep(0.02)  # the next question is under way meanwhile
        return receive(data)

    bus.receive = slowly
    stop = driver.stop(patience_s=0.3)
    assert (stop.confirmed, stop.problem) == (False, "servo 2: torque still on")


def test_the_guard_stops_by_the_bytes_of_the_driver_and_confirms_by_what_servos_answer(chain, clock):
    driver, bus, _ = chain()
    driver.arm()
    driver.move([1.0] * 3, [1.0] * 3)
    heard, hear = [], bus.receive
    bus.receive = lambda data: (heard.append(data), hear(data))[1]
    order = StopOrder(bus_recipe(IDS, XL430_W250).as_json())

    def turn():
        values = []
        for send, reply in order.steps:
            answer = hear(send)
            match = None if reply is None else reply.search(answer)
            if reply is not None and match is None:
                return None
            values += [] if match is None else order.numbers(match)
        return values

    bus.servos[2].write = lambda *_: 0  # deaf to the order
    assert turn() is None
    del bus.servos[2].write
    for confirmed in (False, False, True):  # a first look, and two that say that nothing moves
        places = turn()
        assert places == [servo.get("present_position") for servo in bus.servos]
        assert order.confirmed(places) is confirmed
    driver.stop()
    assert order.is_in(heard[0])
    assert heard[0].startswith(order.steps[0][0])


def test_a_rig_may_narrow_the_voltages_of_its_model():
    driver = {"protocol": 2, "model": "XL430-W250"}
    narrowed = snake_settings({**driver, "low_v": 10.5, "high_v": 11.5}).limits
    assert (narrowed.low_v, narrowed.high_v) == (10.5, 11.5)
    assert snake_settings({}).limits.low_v == 9.0


@pytest.mark.parametrize(
    ("driver", "message"),
    [
        ({"protocol": 2}, "protocol 2 and no model; give one of XL430-W250, XM430-W350, XM430-W210"),
        ({"protocol": 3}, r"protocol is 3; its servos speak 1 \(AX-12\) or 2"),
        ({"protocol": 2, "model": "XL430-W25"}, "unknown model of the snake's servos 'XL430-W25'"),
        ({"protocol": 2, "model": "XL430-W250", "wiring": "bridge"}, "the bridge's sketch drives AX-12 servos only"),
        ({"protocol": 2, "model": "XL430-W250", "high_v": 13}, "makers allow 12 V"),
        ({"protocol": 2, "model": "XM430-W350", "high_v": 16}, "makers allow 14.8 V"),
    ],
)
def test_rigs_that_make_no_sense(driver, message):
    with pytest.raises(HardwareError, match=message):
        snake_settings(driver)


def test_a_snake_of_them_drives_as_the_physics_model_does(tmp_path, clock):
    cycle = [0.5, 0.1, 0.6, 0.7, 1.0]
    rig = shipped_rig("snake")
    rig = replace(rig, driver={**rig.driver, "protocol": 2, "model": "XL430-W250"})
    emulation = snake.emulate(rig, tmp_path, clock, FaultPlan(), 0)
    platform = snake.open_platform(emulation.rig, clock, HardwareLog(None, clock), Stopping())
    try:
        driven = platform.drive(np.array([cycle], np.float32))
    finally:
        platform.close()
        emulation.close()
    body = Body(shipped_parameters())
    body.lay_straight((0.30, 0.0))
    true = body.drive_cycle(cycle[:4])
    np.testing.assert_allclose(driven.poses[1][:4], true.before_m.ravel(), atol=0.02)
    np.testing.assert_allclose(driven.poses[1][4:8], true.after_m.ravel(), atol=0.02)
    assert driven.stop.confirmed
    assert {servo.kind.model for servo in emulation.servos} == {"XL430-W250"}
    assert not any(servo.get("torque_enable") for servo in emulation.servos)
