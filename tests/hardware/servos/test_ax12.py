"""The servo chain: the real SDK over a pseudo-terminal, and bytes of the manual."""

import numpy as np
import pytest

from bns.errors import HardwareError
from bns.hardware.emulators.devices.bus import Bus
from bns.hardware.emulators.devices.servo import Servo
from bns.hardware.emulators.devices.terminal import PseudoTerminal
from bns.hardware.emulators.faults import Fault, Faults
from bns.hardware.link.hardware_log import HardwareLog
from bns.hardware.servos.ax12_table import RAD_PER_STEP, REGISTERS
from bns.hardware.servos.dynamixel import DynamixelChain
from bns.hardware.servos.packets import BROADCAST, WIRES
from bns.hardware.servos.servo_chain import Health, RestartedServoError, ServoError, ServoLimits, StrainWatch

from .watched import speeds_under_torque

IDS = (1, 2, 3)
packet = WIRES[1].instruction


@pytest.fixture
def chain(tmp_path, clock):
    """chain(*faults, numbers, asked, **registers) -> driver, bus, line."""
    opened = []

    def build(*faults, numbers=IDS, asked=IDS, prepare=lambda _bus: None, **registers):
        struck = Faults(tuple(faults), 1, "bus")
        bus = Bus([Servo(n, clock, struck, **registers) for n in numbers], clock, struck)
        prepare(bus)
        line = PseudoTerminal(bus, tmp_path, f"bus{len(opened)}")
        opened.append(line)
        driver = DynamixelChain(str(line.path), asked, clock, HardwareLog(None, clock))
        opened.append(driver)
        return driver, bus, line

    yield build
    for each in reversed(opened):
        each.close()


def test_an_adapter_that_echoes_is_found_out(chain):
    """An echo of a question looks like an answer with an alarm, and the echo of a write like its confirmation."""
    driver, bus, _ = chain(prepare=lambda bus: setattr(bus, "echoes", True))
    driver.arm()
    assert driver.move([0.1, 0.2, 0.3], [1.0] * 3) == pytest.approx([0.1, 0.2, 0.3], abs=RAD_PER_STEP)
    assert driver.stop().confirmed
    assert driver.retries == 0
    assert not any(servo.get("torque_enable") for servo in bus.servos)


def test_an_answer_that_is_an_echo_is_asked_for_again(chain, monkeypatch):
    driver, _, _ = chain()
    heard = iter([True, False])
    monkeypatch.setattr(type(driver._port), "heard_itself", property(lambda _: next(heard, False)))
    assert driver.read(2, "torque_limit") == 1023
    assert driver.retries == 1


def test_an_echo_is_looked_for_only_where_something_is_wrong(chain):
    heard = []

    def prepare(bus):
        answers = bus.receive
        bus.receive = lambda data: (heard.append(data[2]), answers(data))[1]

    chain(prepare=prepare)
    assert set(heard) == set(IDS)
    with pytest.raises(HardwareError, match="servo 4 is missing"):
        chain(asked=(4,), prepare=prepare)
    assert BROADCAST in heard


def test_the_log_holds_the_registers_that_a_servo_sent(chain, monkeypatch):
    """Low byte first: a torque limit of 500 is f4 01. What is written stands in words."""
    driver, bus, _ = chain()
    noted = []
    monkeypatch.setattr(driver._journal, "note", lambda kind, **said: noted.append(said))
    bus.servos[1].put("torque_limit", 500)
    assert driver.read(2, "torque_limit") == 500
    driver.write(2, "torque_limit", 300)
    assert [(one["what"], one["data"]) for one in noted] == [("read torque_limit", "f401"), ("write torque_limit 300", "")]
    driver.stop()
    assert {"id": BROADCAST, "what": "write torque_enable 0 to all"} in noted


@pytest.mark.parametrize(
    ("prepare", "message"),
    [
        (lambda bus: setattr(bus.servos[1], "latched", 32), "^servo 2: overload; fix the cause, then switch the servos off"),
        (lambda bus: bus.servos[1].put("status_return", 1), "servo 2 has status_return 1, not 2 .bns servos check --fix"),
        (lambda bus: bus.servos[1].put("status_return", 0), "servo 2 is missing"),
    ],
)
def test_what_is_wrong_with_a_servo_is_said_before_it_moves(chain, prepare, message):
    with pytest.raises(HardwareError, match=message):
        chain(prepare=prepare)


def test_two_servos_of_one_id_that_answer_one_after_the_other_do_not_move(chain):
    with pytest.raises(HardwareError, match="servo 2 answers twice: two servos have this id"):
        chain(numbers=(1, 2, 2, 3), prepare=lambda bus: bus.servos[1].put("return_delay", 0))


def test_a_late_answer_is_no_second_servo(chain):
    """While the chain is opened, an answer that was given up comes behind the one to the next question."""
    late = [WIRES[1].status(2, 0, b"\x0c\0")]

    def prepare(bus):
        answers = bus.receive
        bus.receive = lambda data: answers(data) + (late.pop() if late and data[2] == 2 else b"")

    driver, _, _ = chain(prepare=prepare)
    assert not late
    assert driver.read(2, "present_position") == 512


def test_a_late_answer_for_one_angle_limit_is_not_the_other(chain):
    late = [WIRES[1].status(2, 0, b"\0\0")]

    def prepare(bus):
        answers = bus.receive
        asked = (bytes([6, 4]), bytes([8, 2]))  # address and size, with and without the lower limit
        bus.receive = lambda data: (late.pop() if late and data[2] == 2 and data[5:7] in asked else b"") + answers(data)

    driver, _, _ = chain(prepare=prepare)
    assert not late
    assert driver._angle_limits(2) == (0, 1023)


@pytest.mark.parametrize("size", [1, 8])
def test_a_late_answer_of_another_length_is_no_answer(chain, size):
    """The SDK would take its checksum, or the beginning of what it holds, for the value."""
    driver, bus, _ = chain()
    answers, late = bus.receive, [WIRES[1].status(2, 0, b"\2" * size)]
    bus.receive = lambda data: (late.pop() if late else b"") + answers(data)
    assert driver.read(2, "present_position") == 512
    assert driver.retries == 1


def test_a_stray_byte_before_an_answer_is_none_of_it(chain):
    driver, bus, _ = chain()
    answers = bus.receive
    bus.receive = lambda data: b"\xff" + answers(data)
    assert driver.read(2, "present_position") == 512
    assert driver.retries == 0


def test_a_servo_whose_answer_was_given_up_is_asked_again_when_that_cannot_come_any_more(chain, clock):
    driver, bus, _ = chain()
    answers, asked = bus.receive, []
    bus.receive = lambda data: (asked.append(clock.now_s()), answers(data))[1]
    bus.servos[1].put("status_return", 0)
    with pytest.raises(ServoError, match=r"servo 2: read present_position: .*no status packet!; asked 6 times"):
        driver.read(2, "present_position")
    assert np.diff(asked) == pytest.approx(driver._port.packet_timeout / 1000 + 0.02, abs=0.001)
    before_s = clock.now_s()
    driver.read(1, "present_position")
    assert asked[-1] == before_s


def answered(clock, data, **registers):
    return Bus([Servo(1, clock, Faults(), **registers)], clock).receive(bytes.fromhex(data)).hex(" ").upper()


@pytest.mark.parametrize(
    ("sent", "back"),
    [
        ("FF FF 01 02 01 FB", "FF FF 01 02 00 FC"),  # ping
        ("FF FF 01 04 02 2B 01 CC", "FF FF 01 03 00 20 DB"),  # temperature, 32 degrees
        ("FF FF 01 02 01 00", "FF FF 01 02 10 EC"),  # wrong checksum
        ("FF FF 01 02 09 F3", "FF FF 01 02 40 BC"),  # no such instruction
        ("FF FF 01 05 03 1E FF 0F CA", "FF FF 01 02 08 F4"),  # goal 4095: out of range
        ("FF FF 02 02 01 FA", ""),  # nobody has this id
        ("FF FF 01 02", ""),  # not all of a packet
        ("00 12 FF FF 01 02 01 FB", "FF FF 01 02 00 FC"),  # noise before the header
    ],
)
def test_golden_packets(clock, sent, back):
    servo = Servo(1, clock, Faults(), present_temperature=32)
    servo._alarms = lambda _now: setattr(servo, "alarm", 0)
    assert Bus([servo], clock).receive(bytes.fromhex(sent)).hex(" ").upper() == back


def test_defaults_are_the_manual_s(clock):
    servo = Servo(1, clock, Faults())
    assert bytes(servo.table[:24]).hex(" ") == (
        "0c 00 18 01 01 fa 00 00 ff 03 00 46 3c 8c ff 03 02 24 24 00 00 00 00 00"
    )
    assert packet(0xFE, 1).hex() == "fffffe0201fe"


def test_registered_writes_wait_for_action(clock):
    servo = Servo(1, clock, Faults())
    bus = Bus([servo], clock)
    bus.receive(packet(1, 4, bytes([30, 0, 1])))
    assert servo.get("goal_position") == 512
    assert servo.get("registered") == 1
    bus.receive(packet(0xFE, 5))
    assert servo.get("goal_position") == 256


@pytest.mark.parametrize(("level", "answers"), [(0, [True, False, False]), (1, [True, True, False]), (2, [True] * 3)])
def test_status_return_level(clock, level, answers):
    bus = Bus([Servo(1, clock, Faults(), status_return=level)], clock)
    asked = [packet(1, 1), packet(1, 2, bytes([36, 2])), packet(1, 3, bytes([25, 1]))]
    assert [bool(bus.receive(a)) for a in asked] == answers


def test_opening_finds_every_servo(chain):
    driver, *_ = chain()
    assert [driver.read(n, "id") for n in IDS] == list(IDS)


@pytest.mark.parametrize(
    ("build", "message"),
    [
        ({"asked": (1, 2, 3, 4)}, r"servo 4 is missing .*bns servos scan"),
        ({"numbers": (1, 2, 2, 3)}, r"servo 2: answers are garbled; two servos may have this id|servo 2 is missing"),
        ({"model_number": 18}, r"servo 1 is of the model AX-18, not AX-12"),
    ],
)
def test_chains_that_cannot_be_used(chain, build, message):
    with pytest.raises(HardwareError, match=message):
        chain(**build)


def test_no_such_port(clock):
    with pytest.raises(HardwareError, match=r"there is no port /dev/nowhere.*bns doctor"):
        DynamixelChain("/dev/nowhere", IDS, clock, HardwareLog(None, clock))


def test_arming_does_not_jerk(chain):
    driver, bus, _ = chain(present_position=700)
    driver.arm()
    for servo in bus.servos:
        assert servo.get("torque_enable") == 1
        assert servo.get("goal_position") == servo.get("present_position") == 700
        assert servo.get("torque_limit") == round(0.8 * 1023)


def test_torque_never_comes_on_with_the_speed_that_a_servo_was_left_at(chain):
    driver, bus, _ = chain(moving_speed=500)
    speeds = speeds_under_torque(bus.servos)
    driver.arm()
    assert speeds == {number: {1} for number in IDS}


def test_moving_takes_its_time_and_says_what_was_sent(chain, clock):
    driver, bus, _ = chain()
    driver.arm()
    sent = driver.move([0.5, -0.5, 9.0], [1.0, 1.0, 1.0])
    assert sent[:2] == pytest.approx([0.5, -0.5], abs=RAD_PER_STEP)
    assert sent[2] == pytest.approx(511 * RAD_PER_STEP)
    clock.sleep(0.25)
    assert driver.health()[1].position_rad == pytest.approx(0.25, abs=0.05)
    clock.sleep(0.5)
    assert driver.health()[1].position_rad == pytest.approx(0.5, abs=0.01)
    assert [s.get("moving_speed") for s in bus.servos] == [86, 86, 86]


def test_a_speed_of_nothing_is_slow_not_full_speed(chain):
    driver, bus, _ = chain()
    driver.move([0.1] * 3, [0.0] * 3)
    assert {s.get("moving_speed") for s in bus.servos} == {1}


def test_angle_limits_are_kept(chain):
    driver, bus, _ = chain(cw_angle_limit=400, ccw_angle_limit=600)
    assert driver.move([2.0, -2.0, 0.0], [1.0] * 3) == pytest.approx(np.array([88, -112, 0]) * RAD_PER_STEP)
    assert [s.get("goal_position") for s in bus.servos] == [600, 400, 512]
    with pytest.raises(ServoError, match="the angle is nan"):
        driver.move([float("nan"), 0, 0], [1.0] * 3)


def test_lost_and_garbled_answers_are_asked_for_again(chain, clock):
    driver, *_ = chain(Fault("lost-reply", rate=0.06), Fault("corrupt-reply", rate=0.06))
    driver.arm()
    for angle in (0.1, 0.2, 0.3):
        driver.move([angle] * 3, [1.0] * 3)
    assert driver.retries > 0


def test_an_instruction_that_reached_a_servo_damaged_is_sent_again(chain):
    """Protocol 1.0, error bit 4: the checksum of the instruction packet is wrong."""
    driver, bus, _ = chain()
    receive, damaged = bus.receive, []

    def one_byte_wrong(data):
        if data[4:5] == b"\x03" and len(damaged) < 2:  # a write
            damaged.append(data)
            return receive(data[:-1] + bytes([data[-1] ^ 0x20]))
        return receive(data)

    bus.receive = one_byte_wrong
    driver.write(2, "moving_speed", 77)
    assert (len(damaged), driver.retries, bus.servos[1].get("moving_speed")) == (2, 2, 77)
    bus.receive = lambda data: receive(data[:-1] + bytes([data[-1] ^ 0x20]) if data[4:5] == b"\x03" else data)
    with pytest.raises(ServoError, match=r"servo 2: write moving_speed 9: what reached it was garbled; asked 6 times"):
        driver.write(2, "moving_speed", 9)
    assert bus.servos[1].get("moving_speed") == 77


def test_a_port_that_falls_dead_during_a_stop_is_had_back_by_another_order(chain):
    """As a guard gives it back: all torque is off already, and nothing but an order to stop opens the way."""
    driver, bus, _ = chain()
    driver.arm()
    receive, reads = bus.receive, []

    def taken(data):
        if data[2:3] == bytes([BROADCAST]):
            reads.clear()
        else:
            reads.append(data)
        return receive(data) if len(reads) <= len(IDS) else b""

    bus.receive = taken
    stop = driver.stop(patience_s=3.0)
    assert stop.confirmed, stop.problem


def test_servos_with_the_same_problem_are_named_together(chain):
    driver, _, line = chain()
    line.cut()
    stop = driver.stop(patience_s=0.1)
    assert stop.problem.startswith("servos 1, 2, 3: the port is gone (")
    assert stop.problem.count("the port is gone") == 1


def test_the_port_is_usable_after_an_exchange_broke_off(chain):
    driver, *_ = chain()
    driver._port.is_using = True
    with pytest.raises(ServoError, match=r"Port is in use|asked"):
        driver.read(9, "id")
    assert driver.read(1, "id") == 1


def test_an_overload_latches_until_the_torque_limit_is_written(chain, clock):
    driver, bus, _ = chain(Fault("overload", at_s=1.0, for_s=1.0, servo=2))
    driver.arm()
    clock.sleep(1.0)
    with pytest.raises(ServoError, match="servo 2: overload"):
        driver.health()
    assert bus.servos[1].get("torque_limit") == 0
    clock.sleep(2.0)
    with pytest.raises(ServoError, match="servo 2: overload"):  # the cause is gone, the alarm is not
        driver.health()
    driver.recover(2)
    driver.health()
    assert bus.servos[1].get("torque_limit") == round(0.8 * 1023)  # no more than it had


@pytest.mark.parametrize(
    ("fault", "registers", "message"),
    [
        ([Fault("overheat", at_s=0.5, for_s=9, servo=3)], {}, "servo 3: overheated"),
        ([], {"present_voltage": 80}, "servo 1 has 8.0 V, not 9 to 12.5"),
        ([], {"present_voltage": 50}, "servo 1: voltage out of its limits"),
    ],
)
def test_limits_are_watched(chain, clock, fault, registers, message):
    if registers.get("present_voltage") == 50:
        with pytest.raises(HardwareError, match=message):
            chain(*fault, **registers)
        return
    driver, *_ = chain(*fault, **registers)
    clock.sleep(1.0)
    with pytest.raises(ServoError, match=message):
        driver.health()


def test_a_stuck_joint_is_noticed_and_a_moment_s_strain_is_not(chain, clock):
    driver, *_ = chain()
    driver.arm()
    watch = StrainWatch(ServoLimits(load=0.3, torque=0.8, stalled_s=0.25, stuck_s=1.0))
    driver.move([1.5] * 3, [0.1] * 3)
    for _ in range(3):
        clock.sleep(0.1)
        watch.look(driver.health(), clock.now_s())
    assert not watch.stalled
    clock.sleep(0.2)
    watch.look(driver.health(), clock.now_s())
    assert watch.stalled
    clock.sleep(0.6)
    with pytest.raises(ServoError, match=r"of its torque for 1\.. s; is it stuck"):
        watch.look(driver.health(), clock.now_s())


def test_strain_that_ends_is_forgotten():
    watch, load = StrainWatch(ServoLimits(torque=1.0)), Health(0.0, -0.97, 12.0, 30.0)
    for t_s in range(20):
        watch.look({1: load if t_s % 2 else Health(0.0, 0.1, 12.0, 30.0)}, float(t_s))
    assert not watch.stalled


def test_stop_is_confirmed_by_every_servo(chain, clock):
    driver, bus, _ = chain()
    driver.arm()
    driver.move([1.0] * 3, [1.0] * 3)
    clock.sleep(0.2)
    stop = driver.stop()
    assert stop.confirmed
    assert stop.seconds <= 0.2
    assert not any(s.get("torque_enable") for s in bus.servos)
    before = [s.get("present_position") for s in bus.servos]
    clock.sleep(2.0)
    bus.receive(packet(1, 1))
    assert [s.get("present_position") for s in bus.servos] == before


def test_a_silent_servo_leaves_the_stop_unconfirmed(chain, clock):
    driver, *_ = chain(Fault("silent-servo", at_s=1.0, for_s=1e9, servo=2))
    driver.arm()
    clock.sleep(1.0)
    stop = driver.stop(patience_s=0.5)
    assert not stop.confirmed
    assert "servo 2" in stop.problem
    assert "servo 1" not in stop.problem


def test_a_stop_is_acknowledged_when_the_last_servo_has_confirmed_it_and_not_before(chain, clock):
    driver, *_ = chain(Fault("silent-servo", at_s=2.0, for_s=0.3, servo=2))
    driver.arm()
    clock.sleep(2.0 - clock.now_s())
    stop = driver.stop()
    assert stop.confirmed
    assert 0.3 <= stop.acknowledged_s <= stop.seconds <= 0.8
    at_once = driver.stop()
    assert 0.0 < at_once.acknowledged_s < 0.1
    assert driver.stop(patience_s=0.0).acknowledged_s < 0.1


def test_nothing_is_acknowledged_while_a_servo_is_silent(chain, clock):
    driver, *_ = chain(Fault("silent-servo", at_s=1.0, for_s=1e9, servo=2))
    driver.arm()
    clock.sleep(1.0)
    assert driver.stop(patience_s=0.5).acknowledged_s is None


def test_stop_on_a_dead_line_does_not_raise(chain):
    driver, _, line = chain()
    line.cut()
    stop = driver.stop(patience_s=0.5)
    assert not stop.confirmed
    assert stop.problem


@pytest.mark.parametrize(("steps", "stands"), [(0, True), (1, True), (-1, True), (2, False)])
def test_a_joint_stands_still_within_one_step_between_two_looks(chain, steps, stands):
    """A reading may jump by the servo's resolution, one step of 0.29 degrees."""
    driver, bus, _ = chain()
    servo, places = bus.servos[0], {}
    servo.put("torque_enable", 0)
    assert driver._not_still(1, places)  # one look says nothing
    places[1] += steps
    assert (driver._not_still(1, places) == "") is stands


def test_a_place_from_before_the_torque_came_on_again_confirms_no_stop(chain):
    driver, bus, _ = chain()
    servo, places, said = bus.servos[0], {}, []
    for torque in (0, 1, 0, 0):
        servo.put("torque_enable", torque)
        said.append(driver._not_still(1, places))
    assert said == ["still moving", "torque still on", "still moving", ""]


def test_a_port_that_cannot_even_be_closed_is_opened_anew(chain, monkeypatch):
    driver, _, _ = chain()
    port, opened = driver._port, []
    monkeypatch.setattr(port, "closePort", lambda: (_ for _ in ()).throw(OSError("gone")))
    driver._lose(OSError("unplugged"))
    monkeypatch.undo()
    monkeypatch.setattr(port, "setBaudRate", lambda rate: opened.append(rate) or True)
    driver._reopen()
    assert opened == [1_000_000]


def test_the_table_does_not_overlap():
    taken = [r.address + i for r in REGISTERS.values() for i in range(r.size)]
    assert len(taken) == len(set(taken))


def test_a_speed_has_no_sign(chain):
    driver, bus, _ = chain()
    driver.move([-0.1] * 3, [-1.0] * 3)
    assert {s.get("moving_speed") for s in bus.servos} == {86}


@pytest.mark.parametrize(
    ("loses", "message"),
    [
        ({"torque_enable": 0, "torque_limit": 1023}, "servo 2 has restarted: its torque is off. Its supply dipped"),
        ({"torque_limit": 1023}, "servo 2 has restarted: its torque limit is 1023, not 818. Its supply dipped"),
    ],
)
def test_a_servo_that_restarts_is_named_at_the_next_look(chain, loses, message):
    driver, bus, _ = chain()
    driver.health()  # nobody has torque yet, and nobody was given any
    driver.arm()
    driver.health()
    for name, value in loses.items():
        bus.servos[1].put(name, value)
    for asks in (driver.health, driver.check_torque):
        with pytest.raises(RestartedServoError, match=message):
            asks()
    assert driver.stop().confirmed
    driver.health()
    driver.check_torque()


def test_the_torque_takes_no_question_of_its_own(chain):
    driver, bus, _ = chain()
    driver.arm()
    answers, asked = bus.receive, []
    bus.receive = lambda data: (asked.append(data), answers(data))[1]
    driver.health()
    assert asked == [packet(number, 2, bytes([24, 20])) for number in IDS]


def test_an_emulated_servo_restarts_as_the_manual_says(clock):
    """What is kept: its settings. What is not: torque, its limit (which is that of the settings then), speed, goal, alarm."""
    servo = Servo(3, clock, Faults((Fault("restart", at_s=0.0, servo=3),)), ccw_angle_limit=900, max_torque=700)
    servo.put("torque_enable", 1)
    servo.put("torque_limit", 500)
    servo.put("moving_speed", 40)
    servo.latched = 32
    servo.update()
    kept = ("id", "ccw_angle_limit", "torque_enable", "torque_limit", "moving_speed")
    assert [servo.get(name) for name in kept] == [3, 900, 0, 700, 0]
    assert servo.get("goal_position") == servo.get("present_position")
    assert not servo.errors()


def test_a_servo_in_wheel_mode_does_not_move(chain):
    said = r"servo 2 is in wheel mode.*would turn without end .bns servos check --fix --port PORT sets"
    with pytest.raises(HardwareError, match=said):
        chain(prepare=lambda bus: bus.servos[1].put("ccw_angle_limit", 0))


def test_that_no_servo_answers_is_said_once(chain):
    with pytest.raises(HardwareError, match=r"^none of the 3 servos answers at .*supply.*bns servos scan") as said:
        chain(asked=(7, 8, 9))
    assert "servo 8" not in str(said.value)


def test_a_stop_that_a_hanging_disk_held_up_is_confirmed_all_the_same(chain, clock):
    driver = chain()[0]
    driver.arm()
    journal = driver._journal
    note = journal.note

    def hangs(kind, **what):
        journal.note = note
        clock.sleep(20.0)
        journal.held_up_s += 20.0
        note(kind, **what)

    journal.note = hangs
    assert driver.stop().confirmed
