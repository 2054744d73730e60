"""The Dynamixel SDK's port on a trial's clock: time-outs in its time, reads that sleep."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from contextlib import suppress
from typing import NamedTuple

from bns.extras import extra
from bns.hardware.clock import Clock
from bns.hardware.link.serial_link import open_port
from bns.hardware.link.terminal_error import TerminalError
from bns.hardware.servos.packets import BROADCAST, PING, READ, WIRES

with extra("robot"):
    from dynamixel_sdk import PortHandler

_SLICE_S = 0.002
_BITS_A_BYTE = 10.0
_ECHO_S = 0.04
"""An adapter that echoes has done so by then: twice the 16 ms for which slow ones hold bytes back, and a little."""
_HELD_S = 0.25
"""An echo that did not come in time may still come for so long: a busy USB hub or computer holds bytes up."""
_LATE_S = 0.02
"""An answer may still come for so long after it was given up, by the SDK after 34 ms and more."""
_SHORTEST_2 = 9
_SECOND_S = 0.01
"""Servos with the same number answer within half a millisecond of each other: return delays go up to 508 µs."""


class Asked(NamedTuple):
    """Whom a packet asks, and whether only if it is there."""

    number: int
    ping: bool


def _asked(packet: Sequence[int]) -> Asked:
    second = len(packet) > _SHORTEST_2 and packet[2] == 0xFD and packet[3] == 0
    return Asked(packet[4], packet[7] == PING) if second else Asked(packet[2], packet[4] == PING)


class ClockedPort(PortHandler):
    """The SDK's port, with time-outs on the trial's clock.

    `echoes`: some adapters hand back what they send, before the answer to it. It looks like an answer, with an alarm.
    """

    is_open: bool

    def __init__(self, port: str, clock: Clock) -> None:
        super().__init__(port)
        self._clock, self.echoes = clock, False
        self._asked, self._sent, self._heard = Asked(-1, False), b"", b""
        self._owes, self._late_until_s = -1, 0.0
        self._held: bytes = b""
        """The packet that was given up before its echo was complete: both may still come, and look like answers."""
        self._silent: Callable[[], bool] = lambda: False
        self._late: Callable[[], bool] = lambda: False

    def setupPort(self, cflag_baud: int) -> bool:  # noqa: N802  # the SDK's name
        """Open it, alone: two that ask on one bus take each other's answers, and its torque off. HardwareError says who is there.

        A read sleeps until bytes are there: the SDK's own spins, and holds up whatever computes meanwhile.
        """
        if self.is_open:
            self.closePort()
        self.ser = open_port(self.port_name, cflag_baud, self._clock)
        self.ser.timeout = _SLICE_S
        self.is_open = True
        self.tx_time_per_byte = 1000.0 * _BITS_A_BYTE / cflag_baud
        return True

    def setBaudRate(self, baudrate: int) -> bool:  # noqa: N802  # the SDK's name
        """Open it at this rate; False if the adapter does not have it.

        The SDK itself refuses rates that it does not list, such as the 400,000 and 250,000 baud of an AX-12.
        """
        self.baudrate = baudrate
        try:
            return self.setupPort(baudrate)
        except ValueError:  # pyserial's, for a rate that cannot be set
            return False

    def find_echo(self) -> None:
        """Whether the adapter echoes: no servo answers a question to all what is in its registers."""
        asked = WIRES[1].instruction(BROADCAST, READ, b"\0\1")
        with suppress(OSError, TerminalError):  # then whatever comes next finds the port gone
            self.clearPort()
            self.echoes = self._written(asked)[1]

    def writePort(self, packet: Sequence[int]) -> int:  # noqa: N802  # the SDK's name
        """Write, and take what an adapter echoes: without its echo a packet counts as not written.

        A servo whose answer was given up is asked again only when that cannot come any more: it would be taken for the new one.
        """
        self._asked, self._sent = _asked(packet), bytes(packet)
        if self._asked.number == self._owes and self._clock.now_s() < self._late_until_s:
            self._clock.sleep(self._late_until_s - self._clock.now_s())
            self.clearPort()
        self._owes = -1 if self._asked.number == self._owes else self._owes
        if self.echoes:
            written, came = self._written(packet)
            return written if came else 0
        return int(super().writePort(packet))

    def readPort(self, length: int) -> bytes:  # noqa: N802  # the SDK's name
        """Read, and keep it for `took`."""
        data = bytes(super().readPort(length))
        self._heard += data
        return data

    @property
    def heard_itself(self) -> bool:
        """Whether the answer that was taken last is a held-up echo. The answer to a ping may have the same bytes."""
        return self.echoes and not self._asked.ping and self._heard.endswith(self._sent)

    def took(self, protocol: int, number: int, size: int) -> bool:
        """Whether the answer that was taken last has so many bytes of data. The SDK does not look: a late one to another question
        passes for an answer, its checksum for data."""
        if protocol == 1:
            return self._heard[-(size + 6) :].startswith(bytes([0xFF, 0xFF, number, size + 2]))
        packet, left = None, self._heard
        while (found := WIRES[protocol].taken(left))[0] is not None:
            packet, left = found
        return packet is not None and packet.number == number and len(packet.parameters) == size + 1

    def _written(self, packet: Sequence[int]) -> tuple[int, bool]:
        """How much of it, and whether it came back.

        Of a packet that is sent again because its echo was held up, two come: the second is this one's. If only one comes, the
        other was lost.
        """
        sent = bytes(packet)
        copies, wait_s = (2, _HELD_S) if sent == self._held else (1, _HELD_S if self._held else _ECHO_S)
        in_vain = self._clock.in_vain(wait_s)
        written, found = super().writePort(packet), b""
        while not (whole := found.endswith(sent) and found.count(sent) >= copies) and not in_vain():
            found += self.ser.read(max(1, len(sent) - len(found)))  # more only where a late answer comes first
        if not whole:
            self._clock.waited(wait_s)
        came = sent in found
        self._held = b"" if came or len(found) >= len(sent) else sent
        return written, came

    def more_comes(self) -> bool:
        """Whether bytes follow an answer that was taken: another servo with the same number, whose return delay is another."""
        self._clock.sleep(_SECOND_S)
        return self.ser.in_waiting > 0

    def setPacketTimeout(self, packet_length: int) -> None:  # noqa: N802  # the SDK's name
        """As the SDK has it: the time of the bytes, twice the adapter's latency, and a little."""
        super().setPacketTimeout(packet_length)
        self._late = self._clock.in_vain(self.packet_timeout / 1000.0)

    def clearPort(self) -> None:  # noqa: N802  # the SDK's name
        """Throw away what came too late; the SDK's own only waits until everything is sent."""
        if self._held and self._held in self.ser.read(self.ser.in_waiting):
            self._held = b""
        self.ser.reset_input_buffer()
        self._heard = b""
        self._silent = self._clock.in_vain(math.inf)  # from before the question on: an answer can be quick

    def isPacketTimeout(self) -> bool:  # noqa: N802  # the SDK's name
        """Whether to give up."""
        silent = self._silent()
        if silent:
            self._clock.waited(self.packet_timeout / 1000.0)
        if (over := silent or self._late()) and not self._asked.ping:
            self._owes, self._late_until_s = self._asked.number, self._clock.now_s() + _LATE_S
        return over
