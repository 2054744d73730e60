"""Frames between computer and Arduino bridge: what `docs/bridge.md` describes, as bytes."""

from __future__ import annotations

import struct
from typing import NamedTuple

START = 0xA5
HELLO, ARM, MOVE, STATE, STOP = 1, 2, 3, 4, 5
ANSWER = 0x80
REFUSED = 0x7F
VERSION = 2
NO_ANSWER = 0x80
"""In a servo's error byte: it did not answer the bridge."""
TORN_S = 0.05
"""Bytes whose frame's rest has not come for so long are passed over, one after the other."""
WATCHDOG_S = 0.5
"""A bridge that hears no whole frame for so long takes the torque off by itself."""
LONGEST = 255
GOAL = struct.Struct("<HH")
"""Goal position and moving speed of one servo, in its own units."""
SERVO = struct.Struct("<HHBBB")
"""Position, load, temperature (°C), voltage (0.1 V) and error byte of one servo."""
STOPPED = 2
"""Bytes at the beginning of the answer to a stop: a bit for each servo that was not read back with its torque off."""
POSITION = struct.Struct("<H")
"""Where a servo is, after those bytes; 0 of one that was not read."""
_HEAD, _CRC = 4, 2


class Frame(NamedTuple):
    """Kind, sequence number and payload."""

    kind: int
    sequence: int
    payload: bytes


def crc16(data: bytes) -> int:
    """CRC-16/CCITT-FALSE: polynomial 0x1021, begun with 0xFFFF."""
    value = 0xFFFF
    for byte in data:
        value ^= byte << 8
        for _ in range(8):
            value = ((value << 1) ^ 0x1021 if value & 0x8000 else value << 1) & 0xFFFF
    return value


def encoded(frame: Frame) -> bytes:
    """Bytes of a frame; ValueError if the payload is too long."""
    if len(frame.payload) > LONGEST:
        raise ValueError(f"a payload of {len(frame.payload)} bytes does not fit into a frame; at most {LONGEST}.")
    body = bytes([len(frame.payload), frame.kind, frame.sequence]) + frame.payload
    return bytes([START]) + body + crc16(body).to_bytes(_CRC, "little")


def decoded(data: bytes) -> tuple[Frame | None, bytes]:
    """The first whole, good frame in `data`, and what is left; without one, what may still become one.

    Bytes before a start byte, and starts whose checksum is wrong, are passed over.
    """
    while (at := data.find(START)) >= 0:
        data = data[at:]
        if len(data) < _HEAD:
            return None, data
        end = _HEAD + data[1] + _CRC
        if len(data) < end:
            return None, data
        body = data[1 : end - _CRC]
        if crc16(body) == int.from_bytes(data[end - _CRC : end], "little"):
            return Frame(body[1], body[2], body[3:]), data[end:]
        data = data[1:]
    return None, b""
