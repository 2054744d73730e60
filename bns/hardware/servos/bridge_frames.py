"""Frames between computer and Arduino bridge: what `docs/bridge.md` describes, as bytes."""

from __future__ import annotations

import struct
from typing import NamedTuple

START = 0xA5
HELLO, ARM, MOVE, STATE, STOP = 1, 2, 3, 4, 5
ANSWER = 0x80
REFUSED = 0x7F
VERSION, STILL_SPOKEN = 4, (3, 4)
"""Of version 3 nothing else differs: its hello has no angle limits, and it never says `RESTARTED`."""
NO_ANSWER = 0x80
"""In a servo's error byte: it did not answer the bridge."""
RESTARTED = 0xC0
"""There: it has no alarm, and its torque is off or its limit is not what the bridge has set."""
STARTED_S = 2.0
"""Opening its port starts an Arduino anew. Its boot loader listens for 0.83 s, and a byte keeps it there for 5 s more; then the
sketch counts its servos and says hello unasked. One that has not by now was not started anew, and can be asked."""
TORN_S = 0.05
"""Bytes whose frame's rest has not come for so long are passed over, one after the other."""
WATCHDOG_S = 0.5
"""A bridge that hears no whole frame for so long takes the torque off by itself."""
LONGEST = 255
GOAL = struct.Struct("<HH")
"""Goal position and moving speed of one servo, in its own units."""
SERVO = struct.Struct("<HHBBB")
"""Position, load, temperature (°C), voltage (0.1 V) and error byte of one servo."""
ANGLES = struct.Struct("<HH")
"""Angle limits of one servo, in the answer to a hello."""
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
        if not _is_whole(data):
            return None, data
        frame, rest = _taken(data)
        if frame is not None:
            return frame, rest
        data = data[1:]
    return None, b""


def searched(data: bytes) -> tuple[Frame | None, bytes]:
    """As `decoded`, but a start whose rest has not come is no reason to wait: a stray start byte hides no frame behind it.

    For the side that asked: it knows what must come, and a frame within a frame that is still coming would need its checksum.
    """
    for at in (at for at, byte in enumerate(data) if byte == START):
        if _is_whole(data[at:]):
            frame, rest = _taken(data[at:])
            if frame is not None:
                return frame, rest
    return None, data


def _is_whole(data: bytes) -> bool:
    return len(data) >= _HEAD and len(data) >= _HEAD + data[1] + _CRC


def _taken(data: bytes) -> tuple[Frame | None, bytes]:
    """The frame at the beginning of `data`, which is long enough for it, and what follows; no frame if its checksum is wrong."""
    end = _HEAD + data[1] + _CRC
    body = data[1 : end - _CRC]
    good = crc16(body) == int.from_bytes(data[end - _CRC : end], "little")
    return (Frame(body[1], body[2], body[3:]) if good else None), data[end:]
