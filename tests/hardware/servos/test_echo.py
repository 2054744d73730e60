"""Echoes that an adapter, a hub or a busy computer holds up: the real port of the SDK on bytes that come when the test says."""

import pytest

from bns.hardware.servos.dynamixel_port import ClockedPort
from bns.hardware.servos.packets import READ, WIRES, WRITE

ORDER = WIRES[1].instruction(1, WRITE, b"\x18\0")
ANSWER = b"\xff\xff\1\2\0\xfc"


class Line:
    """A line, and its clock, that hands over what is due; a read that finds nothing takes 2 ms."""

    def __init__(self):
        self.time_s, self._due, self._here, self.sent = 0.0, [], b"", []
        self.held_s = lambda packet: 0.0

    def now_s(self):
        return self.time_s

    def sleep(self, seconds):
        self.time_s += seconds

    def waited(self, seconds):
        pass

    def in_vain(self, seconds):
        end_s = self.time_s + seconds
        return lambda: self.time_s > end_s

    def write(self, data):
        held_s = self.held_s(bytes(data))
        self.sent.append(bytes(data))
        if held_s is not None:
            self._due.append((self.time_s + held_s, bytes(data) + ANSWER))
        return len(data)

    def flush(self):
        pass

    def reset_input_buffer(self):
        self._arrive()
        self._here = b""

    @property
    def in_waiting(self):
        self._arrive()
        return len(self._here)

    def read(self, size):
        if not self.in_waiting:
            self.time_s += 0.002
        self._arrive()
        taken, self._here = self._here[:size], self._here[size:]
        return taken

    def _arrive(self):
        self._here += b"".join(data for at_s, data in self._due if at_s <= self.time_s)
        self._due = [(at_s, data) for at_s, data in self._due if at_s > self.time_s]


@pytest.fixture
def line():
    return Line()


@pytest.fixture
def port(line):
    port = ClockedPort("nowhere", line)
    port.ser, port.echoes = line, True
    return port


def sent(port, packet):
    """Whether it was sent, as the SDK sends."""
    port.clearPort()
    return port.writePort(packet) == len(packet)


def test_an_echo_in_time(port):
    assert sent(port, ORDER)
    assert port.readPort(6) == ANSWER


@pytest.mark.parametrize("held_s", [0.045, 0.06, 0.1, 0.2])
def test_an_echo_that_is_held_up_is_not_taken_for_an_answer(port, line, held_s):
    """The first one and its answer come while the order is sent again; behind its own echo only its own answer may be left."""
    line.held_s = lambda _: held_s if not line.sent else max(held_s - line.time_s, 0.0)
    assert not sent(port, ORDER)
    assert sent(port, ORDER)
    assert line.sent == [ORDER, ORDER]
    assert port.readPort(20) == ANSWER


def test_an_echo_that_came_between_two_attempts_is_not_waited_for(port, line):
    line.held_s = lambda _: 0.045 if not line.sent else 0.0
    assert not sent(port, ORDER)
    line.sleep(0.01)
    before_s = line.time_s
    assert sent(port, ORDER)
    assert line.time_s - before_s < 0.01
    assert port.readPort(20) == ANSWER


def test_an_echo_that_was_lost_holds_up_the_next_attempt_alone(port, line):
    line.held_s = lambda _: 0.0 if line.sent else None
    assert not sent(port, ORDER)
    assert sent(port, ORDER)
    assert line.time_s < 0.4
    before_s = line.time_s
    assert sent(port, ORDER)
    assert line.time_s - before_s < 0.01


def test_another_packet_behind_one_that_is_held_up(port, line):
    """An order to stop is written at once, and its echo waited for behind the other's."""
    stop = WIRES[1].instruction(254, WRITE, b"\x18\0")
    line.held_s = lambda _: 0.1 - line.time_s
    assert not sent(port, ORDER)
    before_s = line.time_s
    line.held_s = lambda _: 0.1 - before_s
    assert sent(port, stop)
    assert line.sent[-1] == stop


@pytest.mark.parametrize("asked", [ORDER, WIRES[1].instruction(2, READ, b"\x24\2")])
def test_an_echo_in_the_place_of_an_answer_is_none(port, line, asked):
    assert sent(port, asked)
    port.readPort(20)
    assert not port.heard_itself
    port._heard = asked
    assert port.heard_itself
