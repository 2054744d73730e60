"""Packets on a bus of Dynamixel servos, as bytes: protocol 1 and 2 (e-manual, pages Protocol 1.0, Protocol 2.0 and CRC).

The driver leaves its packets to the makers' SDK. These are for those that cannot: the guard's stop, and emulated servos.
"""

from __future__ import annotations

from typing import NamedTuple, Protocol

PING, READ, WRITE, REG_WRITE, ACTION, RESET, REBOOT, SYNC_WRITE = 1, 2, 3, 4, 5, 6, 8, 0x83
STATUS = 0x55
BROADCAST = 254
_HEADER_1 = b"\xff\xff"
_HEADER_2 = b"\xff\xff\xfd"
_HIGHEST_ID = 0xFD
_SHORTEST = 2
"""A length below that is no packet of protocol 1, as the beginning of one of protocol 2 is none."""


class Packet(NamedTuple):
    """To whom, what, with what; `good` unless its checksum is wrong."""

    number: int
    kind: int
    parameters: bytes
    good: bool = True


class Wire(Protocol):
    """One of the protocols; addresses and lengths are `word` bytes."""

    word: int

    def instruction(self, number: int, kind: int, parameters: bytes = b"") -> bytes:
        """What a host says."""

    def status(self, number: int, error: int, data: bytes = b"") -> bytes:
        """What a servo answers."""

    def taken(self, heard: bytes) -> tuple[Packet | None, bytes]:
        """The first whole instruction, and what follows it; without one, what may still become one."""

    def seems_whole(self, answer: bytes) -> bool:
        """Whether a host finds in it a status packet as long as it says it is, and so does not wait for more."""


def checksum(body: bytes) -> int:
    """Of everything after the header, in protocol 1."""
    return ~sum(body) & 0xFF


def crc16(data: bytes) -> int:
    """Of everything before it, in protocol 2: polynomial 0x8005, begun with 0."""
    value = 0
    for byte in data:
        value ^= byte << 8
        for _ in range(8):
            value = ((value << 1) ^ 0x8005 if value & 0x8000 else value << 1) & 0xFFFF
    return value


class Wire1:
    """Protocol 1."""

    word = 1

    def instruction(self, number: int, kind: int, parameters: bytes = b"") -> bytes:
        """Header, number, length, instruction, parameters, checksum."""
        body = bytes([number, len(parameters) + 2, kind]) + parameters
        return _HEADER_1 + body + bytes([checksum(body)])

    def status(self, number: int, error: int, data: bytes = b"") -> bytes:
        """The same, with an error byte in the instruction's place."""
        return self.instruction(number, error, data)

    def taken(self, heard: bytes) -> tuple[Packet | None, bytes]:
        """Behind a header, whatever stands before it."""
        start = heard.find(_HEADER_1)
        while 0 <= start <= len(heard) - 4 and heard[start + 3] < _SHORTEST:
            start = heard.find(_HEADER_1, start + 1)
        if start < 0:
            return None, heard[-1:]
        if len(heard) < start + 4:
            return None, heard[start:]
        end = start + 4 + heard[start + 3]
        if len(heard) < end:
            return None, heard
        body = heard[start + 2 : end]
        return Packet(body[0], body[2], body[3:-1], checksum(body[:-1]) == body[-1]), heard[end:]

    def seems_whole(self, answer: bytes) -> bool:
        """As the SDK looks for it."""
        return answer[:2] == _HEADER_1 and answer[2] <= _HIGHEST_ID and answer[4] <= 0x7F and len(answer) >= answer[3] + 4


class Wire2:
    """Protocol 2."""

    word = 2

    def instruction(self, number: int, kind: int, parameters: bytes = b"") -> bytes:
        """Header, a zero, number, length, instruction, parameters, CRC; one more byte after a header inside (byte stuffing)."""
        stuffed = (bytes([kind]) + parameters).replace(_HEADER_2, _HEADER_2 + b"\xfd")
        packet = _HEADER_2 + bytes([0, number]) + (len(stuffed) + 2).to_bytes(2, "little") + stuffed
        return packet + crc16(packet).to_bytes(2, "little")

    def status(self, number: int, error: int, data: bytes = b"") -> bytes:
        """The same, with an instruction of its own and the error byte before the data."""
        return self.instruction(number, STATUS, bytes([error]) + data)

    def taken(self, heard: bytes) -> tuple[Packet | None, bytes]:
        """Behind a header, whatever stands before it; a stuffed header is none."""
        start = heard.find(_HEADER_2)
        while start >= 0 and heard[start + 3 : start + 4] == b"\xfd":
            start = heard.find(_HEADER_2, start + 3)
        if start < 0:
            return None, heard[-3:]
        if len(heard) < start + 7:
            return None, heard[start:]
        end = start + 7 + int.from_bytes(heard[start + 5 : start + 7], "little")
        if len(heard) < end:
            return None, heard
        packet = heard[start:end]
        good = crc16(packet[:-2]) == int.from_bytes(packet[-2:], "little")
        plain = packet[7:-2].replace(_HEADER_2 + b"\xfd", _HEADER_2)
        return Packet(packet[4], plain[0], plain[1:], good), heard[end:]

    def seems_whole(self, answer: bytes) -> bool:
        """As the SDK looks for it."""
        if answer[:4] != _HEADER_2 + b"\0" or len(answer) < 11 or answer[4] > 0xFC or answer[7] != STATUS:
            return False
        return len(answer) >= int.from_bytes(answer[5:7], "little") + 7


WIRES: dict[int, Wire] = {1: Wire1(), 2: Wire2()}
"""Protocol -> its packets."""
