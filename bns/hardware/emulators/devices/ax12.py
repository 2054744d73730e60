"""A bus of AX-12 servos at the level of bytes: packets, who answers them, how long that takes, what gets lost."""

from __future__ import annotations

import threading
from collections.abc import Callable, Iterable

from bns.hardware.clock import EmulatedClock
from bns.hardware.emulators.devices.servo import Servo
from bns.hardware.emulators.faults import Faults
from bns.hardware.servos.ax12_table import (
    ACTION,
    BROADCAST,
    CHECKSUM,
    INSTRUCTION,
    PING,
    RANGE,
    READ,
    REG_WRITE,
    REGISTERS,
    RESET,
    SYNC_WRITE,
    TABLE_SIZE,
    WRITE,
)

_HEADER = b"\xff\xff"
_BYTE_S = 10 / 1_000_000
_HIGHEST_ID = 0xFD


def checksum(body: bytes) -> int:
    """Of everything after the header."""
    return ~sum(body) & 0xFF


def packet(number: int, kind: int, parameters: bytes = b"") -> bytes:
    """An instruction, or with an error byte as `kind` a status packet."""
    body = bytes([number, len(parameters) + 2, kind]) + parameters
    return _HEADER + body + bytes([checksum(body)])


def _seems_whole(answer: bytes) -> bool:
    """Whether a host finds in it a packet as long as it says it is, and so does not wait for more."""
    return answer[:2] == _HEADER and answer[2] <= _HIGHEST_ID and answer[4] <= 0x7F and len(answer) >= answer[3] + 4


class Bus:
    """The far end of the line: servos that hear everything and answer what is meant for them."""

    def __init__(self, servos: Iterable[Servo], clock: EmulatedClock, faults: Faults | None = None) -> None:
        self.servos = list(servos)
        self._clock, self._faults = clock, faults or Faults()
        self._buffer, self._garbled = b"", False
        self._lock = threading.Lock()
        self.cut_line: Callable[[float], None] = lambda _seconds: None

    def receive(self, data: bytes) -> bytes:
        """Bytes in, bytes out."""
        with self._lock:
            self._buffer += data
            answers = b""
            while (found := self._packet()) is not None:
                answer = b"" if self._lost() else self._carried_out(found)
                if not answer:
                    self._clock.fell_silent()
                answers += answer
            return answers

    def _lost(self) -> bool:
        """Whether nobody on the bus hears this packet."""
        now_s = self._clock.now_s()
        if self._faults.strikes("hang-up", now_s):
            self.cut_line(self._faults.length_s("hang-up"))
            return True
        return self._faults.strikes("lost-request", now_s)

    def written(self) -> None:
        """The answer is on the line; the rest of a garbled one, whose length may be wrong, is waited for in vain."""
        if self._garbled:
            self._garbled = False
            self._clock.fell_silent()

    def _packet(self) -> bytes | None:
        """The next whole packet in the buffer, without its header."""
        start = self._buffer.find(_HEADER)
        if start < 0 or len(self._buffer) < start + 4:
            return None
        length = self._buffer[start + 3]
        end = start + 4 + length
        if len(self._buffer) < end:
            return None
        body, self._buffer = self._buffer[start + 2 : end], self._buffer[end:]
        return body

    def _carried_out(self, body: bytes) -> bytes:
        number, kind, parameters = body[0], body[2], body[3:-1]
        meant = [s for s in self.servos if number in {s.get("id"), BROADCAST}]
        for servo in meant:
            servo.update()
        if checksum(body[:-1]) != body[-1]:
            return b"".join(self._status(s, CHECKSUM) for s in meant[:1] if number != BROADCAST)
        if kind == SYNC_WRITE:
            self._sync(parameters)
            return b""
        answers = [self._one(servo, kind, parameters) for servo in meant]
        return b"" if number == BROADCAST and kind != PING else self._on_the_wire(answers)

    def _sync(self, parameters: bytes) -> None:
        address, size = parameters[0], parameters[1]
        for at in range(2, len(parameters), size + 1):
            for servo in self.servos:
                if servo.get("id") == parameters[at]:
                    servo.write(address, parameters[at + 1 : at + 1 + size])

    def _one(self, servo: Servo, kind: int, parameters: bytes) -> bytes:
        if self._faults.strikes("silent-servo", self._clock.now_s(), servo.get("id")):
            return b""
        if kind == PING:
            return self._status(servo, 0)
        if kind == READ:
            address, size = parameters[0], parameters[1]
            good = address + size <= TABLE_SIZE
            data = bytes(servo.table[address : address + size]) if good else b""
            return self._status(servo, 0 if good else RANGE, data) if servo.get("status_return") >= 1 else b""
        if kind in {WRITE, REG_WRITE, ACTION, RESET}:
            bits = self._changed(servo, kind, parameters)
            return self._status(servo, bits) if servo.get("status_return") == 2 else b""
        return self._status(servo, INSTRUCTION)

    def _changed(self, servo: Servo, kind: int, parameters: bytes) -> int:
        if kind == WRITE:
            return servo.write(parameters[0], parameters[1:])
        if kind == REG_WRITE:
            servo.pending = (parameters[0], parameters[1:])
            servo.put("registered", 1)
            return 0
        if kind == RESET:
            for name, register in REGISTERS.items():
                servo.put(name, register.default)
            return 0
        pending, servo.pending = servo.pending, None
        servo.put("registered", 0)
        return INSTRUCTION if pending is None else servo.write(*pending)

    def _on_the_wire(self, answers: list[bytes]) -> bytes:
        """Servos with the same id answer at nearly the same time: the bits of all, one over the other, a byte apart."""
        if len(answers) < 2:
            return b"".join(answers)
        wire = bytearray(b"\xff" * (max(len(a) for a in answers) + len(answers) - 1))
        for late, answer in enumerate(answers):
            for i, byte in enumerate(answer):
                wire[late + i] &= byte
        self._garbled = not _seems_whole(bytes(wire))
        return bytes(wire)

    def _status(self, servo: Servo, bits: int, data: bytes = b"") -> bytes:
        answer = packet(servo.get("id"), bits | servo.errors(), data)
        now_s = self._clock.now_s()
        self._clock.sleep(servo.get("return_delay") * 2e-6 + len(answer) * _BYTE_S)
        if self._faults.strikes("lost-reply", now_s):
            return b""
        if self._faults.strikes("corrupt-reply", now_s):
            answer = self._faults.byte(answer)
            self._garbled = not _seems_whole(answer)
        return answer
