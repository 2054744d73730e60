"""New servos: who answers, an id each, settings that a drive needs."""

import re

import numpy as np
import pytest

from bns.cli.main import main
from bns.errors import HardwareError
from bns.hardware.clock import EmulatedClock
from bns.hardware.emulators.devices.bus import Bus
from bns.hardware.emulators.devices.servo import Servo
from bns.hardware.emulators.devices.terminal import PseudoTerminal
from bns.hardware.emulators.faults import Faults
from bns.hardware.servo_setup import Rate, ServoBus, adapter
from bns.hardware.servos.ax12_table import AX12, OVERLOAD
from bns.hardware.servos.dynamixel_port import ClockedPort
from bns.hardware.servos.snake_settings import snake_settings
from bns.hardware.servos.x430_table import XL430_W250


@pytest.fixture
def bus(tmp_path, monkeypatch):
    """bus(*ids, **registers) -> servos, path of the port; the command line runs on its clock."""
    clock, opened = EmulatedClock(np.inf), []
    monkeypatch.setattr("bns.cli.commands.servos.RealClock", lambda: clock)
    monkeypatch.setattr("bns.hardware.servo_setup._LAST_ID", 12)

    def build(*ids, **registers):
        servos = [Servo(number, clock, Faults(), **registers) for number in ids]
        build.bus = Bus(servos, clock)
        opened.append(PseudoTerminal(build.bus, tmp_path, f"servos{len(opened)}"))
        return servos, str(opened[-1].path)

    build.clock = clock
    yield build
    for line in opened:
        line.close()


def call(capsys, *asked):
    code = main(["servos", *(str(a) for a in asked)])
    return code, capsys.readouterr()


def test_scan_lists_who_answers(bus, capsys):
    _, port = bus(1, 3, 7)
    code, said = call(capsys, "scan", "--port", port)
    assert code == 0
    listed = [f"id {n} at 1000000 baud: AX-12" for n in (1, 3, 7)]
    assert said.out.splitlines() == [*listed, "3 ids answer (1 Mbaud and new ones; --all-bauds tries others)"]


def test_two_servos_of_one_id_are_noticed(bus, capsys):
    _, port = bus(1, 1, 2)
    code, said = call(capsys, "scan", "--port", port)
    assert code == 2
    assert "id 1 at 1000000 baud: garbled; more than one servo has this id. Connect them one at a time" in said.out
    code, said = call(capsys, "set-id", 5, "--port", port)
    assert code == 2
    assert "Connect one servo alone: id 1 at 1000000 baud: garbled" in said.err


def test_a_line_on_which_nothing_is_a_servo_is_said_to_be_none(bus, capsys):
    _, port = bus(1, 1)
    code, said = call(capsys, "scan", "--port", port)
    assert code == 2
    assert said.out.splitlines()[-1].startswith("no answer is one of a servo: is this the port of the bus, and its rate?")
    _, port = bus(1, 1, 2)
    assert "no answer is one of a servo" not in call(capsys, "scan", "--port", port)[1].out


def test_two_servos_of_one_id_that_answer_in_lock_step_are_noticed(bus, capsys, monkeypatch):
    """Their answers to a ping are the same bit by bit; where their joints are is not."""

    def in_step(self, answers, wire):
        bits = bytes(np.bitwise_and.reduce([np.frombuffer(answer, np.uint8) for answer in answers])) if answers else b""
        self._garbled = not wire.seems_whole(bits)
        return bits

    monkeypatch.setattr(Bus, "_on_the_wire", in_step)
    servos, port = bus(1, 1, 2)
    servos[0].put("present_position", 700)
    monkeypatch.setattr(Servo, "update", lambda _self: None)
    code, said = call(capsys, "scan", "--port", port)
    assert code == 2
    assert "id 1 at 1000000 baud: garbled; more than one servo has this id" in said.out
    assert "id 2 at 1000000 baud: AX-12" in said.out


def test_two_servos_of_one_id_that_answer_one_after_the_other_are_noticed(bus, capsys):
    """A new servo waits half a millisecond with its answer, one that was set up does not."""
    servos, port = bus(1, 1, 2)
    servos[0].put("return_delay", 0)
    code, said = call(capsys, "scan", "--port", port)
    assert code == 2
    assert "id 1 at 1000000 baud: garbled; more than one servo has this id" in said.out
    assert "id 2 at 1000000 baud: AX-12" in said.out


def test_an_adapter_that_echoes_changes_nothing(bus, capsys, monkeypatch):
    servos, port = bus(0, 1, 2)
    bus.bus.echoes = True
    monkeypatch.setattr("bns.hardware.servo_setup._LAST_ID", 2)
    code, said = call(capsys, "scan", "--protocol", 1, "--port", port)
    assert code == 0
    assert said.out.splitlines()[:3] == [f"id {n} at 1000000 baud: AX-12" for n in range(3)]
    assert call(capsys, "check", "--protocol", 1, "--fix", "--port", port)[0] == 0
    assert [s.get("return_delay") for s in servos] == [0, 0, 0]


def test_an_echo_that_does_not_come_is_nobody_s_answer(bus, capsys, monkeypatch):
    """On a busy computer it was taken for two servos of one id."""
    _, port = bus(1, 2)
    bus.bus.echoes = True
    unsent, write = [4], ClockedPort.writePort

    def writes(self, packet):
        if packet[2] != 9 or not unsent[0]:
            return write(self, packet)
        unsent[0] -= 1
        return 0

    monkeypatch.setattr(ClockedPort, "writePort", writes)
    code, said = call(capsys, "scan", "--protocol", 1, "--port", port)
    assert (code, said.out.splitlines()[-1]) == (0, "2 ids answer (1 Mbaud and new ones; --all-bauds tries others)")
    unsent[0] = 99
    code, said = call(capsys, "scan", "--protocol", 1, "--port", port)
    assert code == 2
    assert "echoed what it was sent, and does not any more: 5 packets did not come back. Is the computer too busy?" in said.err


def test_a_noisy_line_is_not_said_to_have_dozens_of_doubled_servos(bus, capsys):
    _, port = bus(1, 1, 2, 2, 3, 3, 4, 4)
    code, said = call(capsys, "set-id", 7, "--protocol", 1, "--port", port)
    assert code == 2
    assert said.err == (
        "bns: 4 ids seem to answer, and none as a servo does: is this the port of the bus, and its rate? "
        "A line without servos may be noisy, too.\n"
    )


@pytest.mark.parametrize("kind", [AX12, XL430_W250], ids=lambda kind: kind.model)
def test_check_shows_an_alarm_that_has_not_gone(bus, capsys, kind):
    servos, port = bus(1, 2, kind=kind, return_delay=0, baud_rate=kind.bauds[1_000_000])
    assert ": alarm:" not in call(capsys, "check", "--protocol", kind.protocol, "--port", port)[1].out
    servos[1].latched = OVERLOAD
    code, said = call(capsys, "check", "--protocol", kind.protocol, "--port", port)
    assert code == 2
    assert "BAD  servo 2: alarm: overload\n     try: find out what blocks or heats it" in said.out
    assert "servo 1: alarm" not in said.out


def test_a_new_servo_gets_its_id(bus, capsys):
    (servo,), port = bus(1)
    code, said = call(capsys, "set-id", 7, "--port", port)
    assert (code, servo.get("id")) == (0, 7)
    assert said.out == "id 7 at 1000000 baud: AX-12\n"


@pytest.mark.parametrize("asked", [("set-id", 7), ("check", "--fix")], ids=["set-id", "check"])
def test_settings_are_written_with_the_torque_off(bus, capsys, monkeypatch, asked):
    """An AX-12 that leaves wheel mode with its torque on turns to whatever goal it was given last, as fast as it can."""
    (servo,), port = bus(1, cw_angle_limit=0, ccw_angle_limit=0, goal_position=900, torque_enable=1)
    written, write = [], Servo.write

    def noted(self, address, data):
        written.append((address, self.get("torque_enable")))
        return write(self, address, data)

    monkeypatch.setattr(Servo, "write", noted)
    _, said = call(capsys, *asked, "--protocol", 1, "--port", port)
    settings = [torque for address, torque in written if address < AX12.registers["torque_enable"].address]
    assert settings
    assert not any(settings)
    assert servo.get("torque_enable") == 0
    assert "bns: servo 1: its torque was on and is switched off: its joint is limp now\n" in said.err
    _, said = call(capsys, "check", "--fix", "--protocol", 1, "--port", port)
    assert "torque was on" not in said.err


def test_a_number_that_was_written_and_not_seen_is_told(bus, capsys, monkeypatch):
    (servo,), port = bus(1)
    write = Servo.write

    def cut_off(self, address, data):
        self.put("status_return", 0)  # it answers no reading any more
        return write(self, address, data)

    monkeypatch.setattr(Servo, "write", cut_off)
    code, said = call(capsys, "set-id", 7, "--protocol", 1, "--port", port)
    assert (code, servo.get("id")) == (2, 7)
    assert "servo 7 does not answer" in said.err
    assert "The servo may have the id 7 by now, or still 1: switch it off and on, then bns servos scan tells." in said.err


@pytest.mark.parametrize(
    ("baud", "told"),
    [
        (1_000_000, "Neither its id nor its rate was to be changed: check its cable and the supply, then try again."),
        (57_600, "may have 1000000 baud by now, or still 57600: switch it off and on, then bns servos scan --all-bauds tells."),
    ],
    ids=["as it is", "another rate"],
)
def test_a_servo_that_keeps_its_number_and_is_lost_is_not_said_to_have_one_of_two(bus, capsys, monkeypatch, baud, told):
    (servo,), port = bus(7)
    numbered, scan = ServoBus._numbered, ServoBus.scan

    def lost(self, found, new):
        servo.put("status_return", 0)
        servo.put("id", 9)
        return numbered(self, found, new)

    monkeypatch.setattr(ServoBus, "_numbered", lost)
    monkeypatch.setattr(ServoBus, "scan", lambda *asked: (found._replace(baud=baud) for found in scan(*asked)))
    code, said = call(capsys, "set-id", 7, "--from", 7, "--protocol", 1, "--port", port)
    assert code == 2
    assert said.err.endswith(f"{told}\n")
    assert "the id 7" not in said.err


def test_nobody_to_be_numbered_is_said_to_be_nobody(bus, capsys):
    _, port = bus()
    code, said = call(capsys, "set-id", 7, "--port", port)
    assert code == 2
    assert "no servo answers. Is the supply on" in said.err
    code, said = call(capsys, "set-id", 7, "--from", 3, "--port", port)
    assert code == 2
    assert "no servo answers, and none has the id 3 at another rate." in said.err


def test_a_mute_servo_may_keep_its_number(bus, capsys):
    (servo,), port = bus(5)
    servo.put("status_return", 0)
    assert call(capsys, "set-id", 5, "--port", port)[0] == 0
    assert servo.get("status_return") == 2


def test_ids_that_cannot_be_given(bus, capsys):
    servos, port = bus(1, 2)
    for asked, message in (
        ((5,), "Connect one servo alone: id 1 .*; id 2 .*--from ID"),
        ((2, "--from", 1), "another servo on this bus has the id 2"),
        ((5, "--from", 4), "No single servo has the id 4"),
        ((300, "--from", 1), "the id 300 is none; ids go from 0 to"),
    ):
        code, said = call(capsys, "set-id", *asked, "--port", port)
        assert code == 2
        assert [s.get("id") for s in servos] == [1, 2]
        assert re.search(message, said.err)
    assert call(capsys, "set-id", 5, "--from", 1, "--port", port)[0] == 0
    assert [s.get("id") for s in servos] == [5, 2]


def test_check_names_what_is_not_fit_and_mends_it(bus, capsys):
    servos, port = bus(1, 2, status_return=1, cw_angle_limit=300)
    code, said = call(capsys, "check", "--port", port)
    assert code == 2
    for what in ("return delay 500 µs", "status return level 1", "angle limits 300 to 1023"):
        assert f"BAD  servo 2: {what}" in said.out
    assert f"bns servos check --fix --port {port}" in said.out
    assert servos[0].get("status_return") == 1  # nothing was written
    code, said = call(capsys, "check", "--fix", "--port", port)
    assert (code, said.out.splitlines()[-1]) == (0, "all fine; 2 answer: ids 1 to 2")
    assert [s.get("return_delay") for s in servos] == [0, 0]
    assert "servo 1: status_return, return_delay, cw_angle_limit written" in said.err


@pytest.mark.parametrize("kind", [AX12, XL430_W250], ids=lambda kind: kind.model)
def test_a_servo_that_does_not_protect_itself_or_is_weak_is_named(bus, capsys, monkeypatch, kind):
    """Shutdown and max torque (X series: PWM limit) of the control tables; new ones switch off at overload and heat."""
    monkeypatch.setattr("bns.cli.commands.servos.rates", lambda *_: [Rate(1_000_000, kind.protocol)])
    servos, port = bus(1, 2, 3, kind=kind, baud_rate=kind.bauds[1_000_000], **dict(kind.wanted) | {"return_delay": 0})
    assert call(capsys, "check", "--port", port)[0] == 0
    servos[0].put("alarm_shutdown", 0b1 << 2)
    servos[1].put("max_torque", 50)
    servos[2].put("alarm_shutdown", kind.registers["alarm_shutdown"].default | 1)
    code, said = call(capsys, "check", "--port", port)
    assert code == 2
    electric = "electrical shock, or too little power for its motor, " if kind is XL430_W250 else ""
    assert f"BAD  servo 1: does not switch itself off where new ones do: {electric}overload\n     try: bns servos" in said.out
    register = 14 if kind is AX12 else 36
    assert f"BAD  servo 2: torque limited to 50 of {kind.full_torque}\n     try: write {kind.full_torque} to its" in said.out
    assert f"register {register}, unless" in said.out
    assert said.out.splitlines()[-1] == "2 to be fixed; 3 answer: ids 1 to 3"
    said = call(capsys, "check", "--fix", "--port", port)[1]
    assert "servo 1: alarm_shutdown written" in said.err
    assert said.out.splitlines()[-1] == "1 to be fixed; 3 answer: ids 1 to 3"  # how strong it is meant to be, nobody else knows
    assert servos[0].get("alarm_shutdown") == kind.registers["alarm_shutdown"].default
    assert servos[2].get("alarm_shutdown") == kind.registers["alarm_shutdown"].default | 1
    assert servos[1].get("max_torque") == 50


def test_thirteen_volts_are_refused(bus, capsys):
    servos, port = bus(1, return_delay=0)
    assert call(capsys, "check", "--port", port)[0] == 0
    servos[0].put("present_voltage", 130)
    code, said = call(capsys, "check", "--port", port)
    assert code == 2
    assert "BAD  servo 1: 13.0 V\n     try: a supply of 9 to 12.5 V; the makers allow 9 to 12 V" in said.out
    with pytest.raises(HardwareError, match=r"high_v is 13; the servos' makers allow 12 V"):
        snake_settings({"high_v": 13})


def test_nobody_and_no_port(bus, capsys):
    _, port = bus()
    assert call(capsys, "check", "--port", port)[0] == 2
    code, said = call(capsys, "scan", "--port", port)
    assert code == 2
    assert said.out.startswith("no servo answers")
    code, said = call(capsys, "scan", "--port", "/dev/none")
    assert code == 2
    assert "there is no port /dev/none" in said.err


def test_one_process_a_bus(bus):
    _, port = bus(1)
    first = ServoBus(port, bus.clock)
    with pytest.raises(HardwareError, match=r"is in use by another program"):
        ServoBus(port, bus.clock)
    first.close()
    ServoBus(port, bus.clock).close()


def test_the_adapter_s_latency_timer(tmp_path):
    timer = tmp_path / "ttyUSB0" / "device" / "latency_timer"
    timer.parent.mkdir(parents=True)
    timer.write_text("16\n")
    (found,) = adapter("/dev/ttyUSB0", tmp_path)
    assert str(found) == (
        "BAD  /dev/ttyUSB0: latency timer 16 ms\n     try: echo 1 | sudo tee /sys/class/tty/ttyUSB0/device/latency_timer"
    )
    assert list(adapter("/dev/ttyACM0", tmp_path)) == []


@pytest.mark.parametrize("kind", [AX12, XL430_W250], ids=lambda kind: kind.model)
def test_a_servo_that_answers_a_ping_alone_is_named_and_mended(bus, capsys, monkeypatch, kind):
    """Status return level 0 (control tables: AX-12A, address 16; X series, address 68): only a ping is answered."""
    at_one_rate = [Rate(1_000_000, kind.protocol)]  # the emulated ones answer at any
    monkeypatch.setattr("bns.cli.commands.servos.rates", lambda *_: at_one_rate)
    rest = {} if kind is AX12 else dict(kind.wanted)
    servos, port = bus(1, 2, 3, kind=kind, baud_rate=kind.bauds[1_000_000], **rest | {"return_delay": 0})
    servos[1].put("status_return", 0)
    code, said = call(capsys, "scan", "--port", port)
    assert code == 2
    assert "id 2 at 1000000 baud: answers a ping and nothing else (status return level 0)" in said.out
    assert "3 ids answer" in said.out
    code, said = call(capsys, "check", "--port", port)
    assert code == 2
    assert "servo 2 answers a ping and nothing else (status return level 0)" in said.out
    assert said.out.splitlines()[-1] == "1 to be fixed; 3 answer: ids 1 to 3"
    code, said = call(capsys, "check", "--fix", "--port", port)
    assert "servo 2: status_return written" in said.err
    assert (code, said.out.splitlines()[-1]) == (0, "all fine; 3 answer: ids 1 to 3")
    assert servos[1].get("status_return") == 2


def test_rates_that_the_sdk_does_not_list_are_tried_and_those_of_no_adapter_named(bus, capsys, monkeypatch):
    """400,000 and 250,000 baud are an AX-12's (baud rate 4 and 7); the SDK's own port refuses both."""
    _, port = bus(3)
    set_to = ClockedPort.setupPort
    tried = []

    def setup(self, baud):
        tried.append(baud)
        if baud == 400_000:
            raise ValueError("Failed to set custom baud rate")  # as pyserial says it
        return set_to(self, baud)

    monkeypatch.setattr(ClockedPort, "setupPort", setup)
    code, said = call(capsys, "scan", "--protocol", 1, "--all-bauds", "--port", port)
    assert set(AX12.bauds) <= set(tried)
    assert "not tried: 400000 baud; this adapter cannot be set to them" in said.out
    assert "id 3 at 250000 baud: AX-12" in said.out  # the emulated one answers at any rate
    assert code == 0


def test_a_check_says_whom_it_looked_at(bus, capsys):
    """Nobody has told it how many there should be."""
    _, port = bus(1, 2, 4, 6, 7)
    missing, who = call(capsys, "check", "--port", port)[1].out.splitlines()[-2:]
    assert who.endswith("5 answer: ids 1 to 2, 4, 6 to 7")
    assert missing == "not there: ids 3, 5, 8 to 12 (the shipped rig's snake has ids 1 to 12)"


def test_a_mute_servo_gets_its_number(bus, capsys):
    servos, port = bus(1)
    servos[0].put("status_return", 0)
    assert call(capsys, "set-id", 5, "--port", port)[0] == 0
    assert (servos[0].get("id"), servos[0].get("status_return")) == (5, 2)
