"""`bns servos` with new servos of the X series."""

import re

import numpy as np
import pytest

from bns.cli.main import main
from bns.hardware.clock import EmulatedClock
from bns.hardware.emulators.devices.bus import Bus
from bns.hardware.emulators.devices.servo import Servo
from bns.hardware.emulators.devices.terminal import PseudoTerminal
from bns.hardware.emulators.faults import Faults
from bns.hardware.servos.ax12_table import AX12
from bns.hardware.servos.packets import BROADCAST
from bns.hardware.servos.x430_table import XL430_W250, XM430_W350

MUTE = "answers a ping and nothing else (status return level 0); bns servos check --fix --port PORT corrects it"
SECOND = b"\xff\xff\xfd\x00"
"""How packets of protocol 2 begin."""
SET_UP = {"baud_rate": 3}


@pytest.fixture
def bus(tmp_path, monkeypatch):
    """bus(*servos) -> path of the port, at the rate that its host sets; the command line runs on its clock."""
    clock, opened = EmulatedClock(np.inf), []
    monkeypatch.setattr("bns.cli.commands.servos.RealClock", lambda: clock)
    monkeypatch.setattr("bns.hardware.servo_setup._LAST_ID", 9)

    def build(*servos):
        found = Bus(servos, clock)
        opened.append(PseudoTerminal(found, tmp_path, "servos"))
        found.baud = lambda: opened[-1].baud() or 1  # at a rate without a name nobody answers
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


def test_numbers_are_gone_through_only_where_a_ping_to_all_is_answered(bus, capsys, monkeypatch):
    heard, receive = [], Bus.receive

    def lossy(self, data):
        heard.append((self.baud(), data))
        first = len([1 for baud, packet in heard if baud == 57600 and packet.startswith(SECOND)]) == 1
        return receive(self, b"" if first else data)  # the first of these pings is lost

    monkeypatch.setattr(Bus, "receive", lossy)
    port = bus(Servo(2, bus.clock, Faults()), Servo(4, bus.clock, Faults(), None, XL430_W250, status_return=0))
    code, said = call(capsys, "scan", "--port", port)
    assert code == 2
    assert said.out.splitlines()[:2] == [
        "id 2 at 1000000 baud: AX-12",
        f"id 4 at 57600 baud: {MUTE}",
    ]
    asked = [packet[4] for baud, packet in heard if baud == 1000000 and packet.startswith(SECOND)]
    assert asked == [BROADCAST] * 3


def test_a_new_servo_gets_its_id_and_the_rate_of_a_chain(bus, capsys):
    servo = Servo(1, bus.clock, Faults(), None, XL430_W250, torque_enable=1)  # which locks what is to be written
    code, said = call(capsys, "set-id", 7, "--port", bus(servo))
    assert (code, said.out) == (0, "id 7 at 1000000 baud: XL430-W250\n")
    assert [servo.get(name) for name in ("id", "baud_rate", "torque_enable")] == [7, 3, 0]


def test_a_servo_of_any_rate_is_taken_from_there_by_its_number(bus, capsys):
    servo = Servo(4, bus.clock, Faults(), baud_rate=AX12.bauds[57_600])
    port = bus(servo)
    code, said = call(capsys, "set-id", 7, "--protocol", 1, "--port", port)
    assert code == 2
    assert "One at another rate: bns servos scan --all-bauds finds it, --from ID takes it from there." in said.err
    code, said = call(capsys, "set-id", 7, "--from", 4, "--protocol", 1, "--port", port)
    assert (code, said.out, said.err) == (0, "id 7 at 1000000 baud: AX-12\n", "")
    assert (servo.get("id"), servo.get("baud_rate")) == (7, AX12.bauds[1_000_000])


def test_check_names_what_is_not_fit_and_mends_it(bus, capsys):
    servo = Servo(4, bus.clock, Faults(), None, XL430_W250, operating_mode=1, status_return=1, cw_angle_limit=1100, **SET_UP)
    port = bus(servo)
    code, said = call(capsys, "check", "--port", port)
    assert code == 2
    for what in ("operating mode 1", "status return level 1", "return delay 500 µs", "angle limits 1100 to 4095"):
        assert f"BAD  servo 4: {what}" in said.out
    code, said = call(capsys, "check", "--fix", "--port", port)
    assert (code, said.out.splitlines()[-1]) == (0, "all fine; 1 answer: ids 4")
    assert "status_return, return_delay, operating_mode, cw_angle_limit written" in said.err
    servo.put("present_voltage", 74)  # a battery of two cells
    assert call(capsys, "check", "--port", port)[0] == 0
    for decivolts in (64, 130):
        servo.put("present_voltage", decivolts)
        assert "a supply of 6.5 to 12.5 V; the makers allow 6.5 to 12 V" in call(capsys, "check", "--port", port)[1].out


def test_a_new_servo_is_said_to_need_the_rate_of_a_chain(bus, capsys):
    code, said = call(capsys, "check", "--port", bus(Servo(1, bus.clock, Faults(), None, XL430_W250)))
    assert code == 2
    assert re.search(r"BAD  servo 1: XL430-W250 at 57600 baud\n +try: bns servos set-id 1 --from 1", said.out)
