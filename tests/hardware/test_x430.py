"""Servos of the X series: the makers' SDK and the packets of their manual judge our bytes; driver, guard, `bns servos`."""

import re
from dataclasses import replace

import numpy as np
import pytest
from dynamixel_sdk import COMM_SUCCESS, COMM_TX_FAIL, GroupSyncWrite, PacketHandler
from hypothesis import given
from hypothesis import strategies as st

from bns.cli.main import main
from bns.errors import HardwareError
from bns.hardware.clock import EmulatedClock
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
from bns.hardware.servos.packets import PING, READ, STATUS, SYNC_WRITE, WIRES, WRITE, Packet
from bns.hardware.servos.servo_chain import ServoError
from bns.hardware.servos.snake_settings import snake_settings
from bns.hardware.servos.x430_table import X430, XL430_W250, XM430_W210, XM430_W350
from bns.physics.snake.body import Body
from bns.physics.snake.parameters import shipped_parameters

IDS = (1, 2, 3)
TWO = WIRES[2]
SET_UP = {"baud_rate": 3}


class Ear:
    """A port of the SDK's that hears what is written, and reads what was given to it."""

    is_using = False

    def __init__(self, answer=b""):
        self.written, self._answer = b"", answer

    def clearPort(self):  # noqa: N802  # the SDK's name
        pass

    def writePort(self, packet):  # noqa: N802  # the SDK's name
        self.written += bytes(packet)
        return len(packet)

    def readPort(self, length):  # noqa: N802  # the SDK's name
        found, self._answer = self._answer[:length], self._answer[length:]
        return found

    def setPacketTimeout(self, length):  # noqa: N802  # the SDK's name
        pass

    def isPacketTimeout(self):  # noqa: N802  # the SDK's name
        return not self._answer


def written(call):
    ear = Ear()
    call(ear)
    return ear.written


def by_sdk(protocol):
    """What the SDK writes for instructions, and the same in our bytes."""
    sdk, wire = PacketHandler(float(protocol)), WIRES[protocol]

    def word(value):
        return value.to_bytes(wire.word, "little")

    def together(port):
        group = GroupSyncWrite(port, sdk, 116 // protocol, 4)
        for number, goal in ((1, 150), (2, 170)):
            group.addParam(number, list(goal.to_bytes(4, "little")))
        group.txPacket()

    both = b"\x01\x96\0\0\0\x02\xaa\0\0\0"
    return {
        "ping": (written(lambda p: sdk.ping(p, 7)), wire.instruction(7, PING)),
        "read": (written(lambda p: sdk.readTx(p, 9, 132, 4)), wire.instruction(9, READ, word(132) + word(4))),
        "write": (
            written(lambda p: sdk.write2ByteTxOnly(p, 254, 30, 513)),
            wire.instruction(254, WRITE, word(30) + b"\x01\x02"),
        ),
        "sync": (written(together), wire.instruction(254, SYNC_WRITE, word(116 // protocol) + word(4) + both)),
    }


@pytest.mark.parametrize("protocol", [1, 2])
@pytest.mark.parametrize("which", ["ping", "read", "write", "sync"])
def test_our_packets_are_the_sdk_s(protocol, which):
    theirs, ours = by_sdk(protocol)[which]
    assert ours == theirs
    assert WIRES[protocol].taken(b"\x00\x12" + theirs + b"rest")[1] == b"rest"


@given(st.binary(max_size=40) | st.lists(st.sampled_from([b"\xff", b"\xfd", b"\0"]), max_size=40).map(b"".join))
def test_stuffing_is_the_sdk_s_and_is_taken_out_again(data):
    """`addStuffing` returns the stuffed packet; the SDK's own `txPacket` overlooks that, so what it sends is never stuffed."""
    sdk, plain = PacketHandler(2.0), bytes([STATUS]) + data
    length = len(plain) + 2
    packet = [0xFF, 0xFF, 0xFD, 0, 5, length & 255, length >> 8, *plain, 0, 0]
    stuffed = sdk.addStuffing(packet)
    stuffed = stuffed[: stuffed[5] + 256 * stuffed[6] + 7]
    crc = sdk.updateCRC(0, stuffed, len(stuffed) - 2)
    ours = TWO.instruction(5, STATUS, data)
    assert ours == bytes(stuffed[:-2]) + crc.to_bytes(2, "little")
    assert TWO.taken(ours) == (Packet(5, STATUS, data), b"")


@given(st.binary(min_size=1, max_size=30), st.integers(0, 252), st.integers(0, 255))
def test_the_sdk_reads_what_a_servo_answers(data, number, error):
    found, result, bits = PacketHandler(2.0).readTxRx(Ear(TWO.status(number, error, data)), number, 0, len(data))
    assert (bytes(found), result, bits) == (data, COMM_SUCCESS, error)


@given(st.binary(min_size=1, max_size=12), st.data())
def test_the_sdk_notices_every_byte_that_is_another_one(data, drawn):
    answer = bytearray(TWO.status(3, 0, data))
    place = drawn.draw(st.integers(4, len(answer) - 1))
    answer[place] ^= drawn.draw(st.integers(1, 255))
    _, result, _ = PacketHandler(2.0).readTxRx(Ear(bytes(answer)), 3, 0, len(data))
    assert result not in {COMM_SUCCESS, COMM_TX_FAIL}


def xm430(clock, number, **registers):
    return Servo(number, clock, Faults(), None, XM430_W210, **SET_UP, **registers)


@pytest.mark.parametrize(
    ("sent", "back"),
    [  # the e-manual, Protocol 2.0: ID 1 and 2 are XM430-W210 with firmware 38; 1 is at 166, 2 at 2079
        ("FF FF FD 00 01 03 00 01 19 4E", "FF FF FD 00 01 07 00 55 00 06 04 26 65 5D"),
        (
            "FF FF FD 00 FE 03 00 01 31 42",
            "FF FF FD 00 01 07 00 55 00 06 04 26 65 5D FF FF FD 00 02 07 00 55 00 06 04 26 6F 6D",
        ),
        ("FF FF FD 00 01 07 00 02 84 00 04 00 1D 15", "FF FF FD 00 01 08 00 55 00 A6 00 00 00 8C C0"),
        ("FF FF FD 00 01 09 00 03 74 00 00 02 00 00 CA 89", "FF FF FD 00 01 04 00 55 00 A1 0C"),
        ("FF FF FD 00 01 09 00 04 68 00 C8 00 00 00 AE 8E", "FF FF FD 00 01 04 00 55 00 A1 0C"),
        ("FF FF FD 00 01 03 00 08 2F 4E", "FF FF FD 00 01 04 00 55 00 A1 0C"),
        ("FF FF FD 00 FE 11 00 83 74 00 04 00 01 96 00 00 00 02 AA 00 00 00 82 87", ""),
        ("FF FF 01 02 01 FB", ""),  # protocol 1
        ("FF FF FD 00 03 03 00 01", ""),  # nobody's, and not whole
    ],
)
def test_packets_of_the_manual(sent, back):
    clock = EmulatedClock(np.inf)
    servos = [xm430(clock, 1, firmware=38, present_position=166), xm430(clock, 2, firmware=38, present_position=2079)]
    assert Bus(servos, clock).receive(bytes.fromhex(sent)).hex(" ").upper() == back
    if "83 74" in sent:
        assert [servo.get("goal_position") for servo in servos] == [150, 170]


def asked(servo, clock, kind, parameters, good=True):
    packet = bytearray(TWO.instruction(1, kind, bytes(parameters)))
    packet[-1] ^= not good
    found, _ = TWO.taken(Bus([servo], clock).receive(bytes(packet)))
    return found.parameters[0]


def test_what_is_refused_is_refused_as_the_manual_says():
    clock = EmulatedClock(np.inf)
    servo = xm430(clock, 1)
    goal, limit = [116, 0], [48, 0]
    assert asked(servo, clock, 0x77, []) == 2
    assert asked(servo, clock, PING, [], good=False) == 3
    assert asked(servo, clock, WRITE, [*goal, 0, 32, 0, 0]) == 4  # beyond what there is
    assert asked(servo, clock, WRITE, [*goal, 0, 2]) == 5
    assert asked(servo, clock, WRITE, [*limit, 0, 1, 0, 0]) == 0
    assert asked(servo, clock, WRITE, [*goal, 0, 2, 0, 0]) == 6  # beyond the limit just set
    assert asked(servo, clock, WRITE, [132, 0, 0, 2, 0, 0]) == 7  # read only
    assert asked(servo, clock, READ, [66, 0, 1, 0]) == 7  # nothing there
    assert asked(servo, clock, WRITE, [64, 0, 1]) == 0
    assert asked(servo, clock, WRITE, [*limit, 0, 2, 0, 0]) == 7  # locked while the torque is on


def test_tables_do_not_overlap_and_know_their_models():
    for table in X430:
        taken = [r.address + i for r in table.registers.values() for i in range(r.size)]
        assert len(taken) == len(set(taken))
    assert [table.number for table in X430] == [1060, 1020, 1030]
    assert (XL430_W250.gapless, AX12.gapless) == (False, True)


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
        ({"baud_rate": 1}, "servo 1 is missing"),
    ],
)
def test_chains_that_cannot_be_used(chain, build, message):
    with pytest.raises(HardwareError, match=message):
        chain(**build)


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
    [(XL430_W250, 130, "13.0 V, not 9 to 12.5"), (XM430_W350, 148, ""), (XM430_W350, 96, "9.6 V, not 10 to 15.3")],
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
    assert (stop.confirmed, stop.problem) == (False, "servo 2 still has its torque on")


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


@pytest.fixture
def bus(tmp_path, monkeypatch):
    """bus(*servos) -> path of the port, at the rate that its host sets; the command line runs on its clock."""
    clock, opened = EmulatedClock(np.inf), []
    monkeypatch.setattr("bns.cli.commands.servos.RealClock", lambda: clock)
    monkeypatch.setattr("bns.hardware.servo_setup._LAST_ID", 9)

    def build(*servos):
        found = Bus(servos, clock)
        opened.append(PseudoTerminal(found, tmp_path, "servos"))
        found.baud = opened[-1].baud
        return str(opened[-1].path)

    build.clock = clock
    yield build
    for line in opened:
        line.close()


def call(capsys, *asked):
    code = main(["servos", *(str(a) for a in asked)])
    return code, capsys.readouterr()


def test_scan_finds_both_protocols_and_new_servos(bus, capsys):
    new = Servo(1, bus.clock, Faults(), None, XL430_W250)
    port = bus(Servo(2, bus.clock, Faults()), Servo(3, bus.clock, Faults(), None, XM430_W350, **SET_UP), new)
    code, said = call(capsys, "scan", "--port", port)
    assert code == 0
    assert said.out.splitlines()[:3] == [
        "id 2 at 1000000 baud: AX-12",
        "id 3 at 1000000 baud: XM430-W350",
        "id 1 at 57600 baud: XL430-W250",
    ]
    assert "id 2" not in call(capsys, "scan", "--port", port, "--protocol", 2)[1].out


def test_a_new_servo_gets_its_id_and_the_rate_of_a_chain(bus, capsys):
    servo = Servo(1, bus.clock, Faults(), None, XL430_W250, torque_enable=1)  # which locks what is to be written
    code, said = call(capsys, "set-id", 7, "--port", bus(servo))
    assert (code, said.out) == (0, "id 7 at 1000000 baud: XL430-W250\n")
    assert [servo.get(name) for name in ("id", "baud_rate", "torque_enable")] == [7, 3, 0]


def test_check_names_what_is_not_fit_and_mends_it(bus, capsys):
    servo = Servo(4, bus.clock, Faults(), None, XL430_W250, operating_mode=1, status_return=1, cw_angle_limit=1100, **SET_UP)
    port = bus(servo)
    code, said = call(capsys, "check", "--port", port)
    assert code == 2
    for what in ("operating mode 1", "status return level 1", "return delay 500 µs", "angle limits 1100 to 4095"):
        assert f"BAD  servo 4: {what}" in said.out
    code, said = call(capsys, "check", "--fix", "--port", port)
    assert (code, said.out.splitlines()[-1]) == (0, "all fine")
    assert "status_return, return_delay, operating_mode, cw_angle_limit written" in said.err
    servo.put("present_voltage", 130)
    assert "a supply of 9 to 12.5 V; the makers allow 12 V" in call(capsys, "check", "--port", port)[1].out


def test_a_new_servo_is_said_to_need_the_rate_of_a_chain(bus, capsys):
    code, said = call(capsys, "check", "--port", bus(Servo(1, bus.clock, Faults(), None, XL430_W250)))
    assert code == 2
    assert re.search(r"BAD  servo 1 is a XL430-W250 at 57600 baud\n +try: bns servos set-id 1 --from 1", said.out)


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
