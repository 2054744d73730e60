"""A bus of Dynamixel servos at the level of bytes: packets, who answers them, how long that takes, what gets lost."""

from __future__ import annotations

import threading
from collections.abc import Callable, Iterable

from bns.hardware.clock import EmulatedClock
from bns.hardware.emulators.devices.servo import Servo
from bns.hardware.emulators.faults import Faults
from bns.hardware.servos.ax12_table import CHECKSUM, INSTRUCTION, RANGE
from bns.hardware.servos.packets import (
    ACTION,
    BROADCAST,
    PING,
    READ,
    REBOOT,
    REG_WRITE,
    RESET,
    SYNC_WRITE,
    WIRES,
    WRITE,
    Packet,
    Wire,
)

_BYTE_S = 10 / 1_000_000
_REFUSED = {1: (INSTRUCTION, CHECKSUM, RANGE), 2: (2, 3, 7)}
"""Protocol -> error bytes for an instruction that is unknown, one whose checksum is wrong, a register that is not there."""


def _asks(packet: Packet) -> bool:
    """Whether somebody waits for an answer: not to an order to all.

    Else its silence, on a busy computer counted only when the next question is under way, would pass for that question's.
    """
    return packet.number != BROADCAST or packet.kind in {PING, READ}


class Bus:
    """The far end of the line: servos that hear everything and answer what is meant for them."""

    def __init__(self, servos: Iterable[Servo], clock: EmulatedClock, faults: Faults | None = None) -> None:
        self.servos = list(servos)
        self._clock, self._faults = clock, faults or Faults()
        self._heard = dict.fromkeys(WIRES, b"")
        self._garbled = False
        self._lock = threading.Lock()
        self.echoes = False
        """Whether the adapter hands back what it sends."""
        self.cut_line: Callable[[float], None] = lambda _seconds: None
        self.baud: Callable[[], int | None] = lambda: None
        """At which rate the host speaks; None: as every servo."""

    def receive(self, data: bytes) -> bytes:
        """Bytes in, bytes out."""
        with self._lock:
            answers, spoken = b"", {servo.kind.protocol for servo in self.servos}
            found = {protocol: self._packets(protocol, data) for protocol in WIRES}
            unheard = [packet for packets in found.values() for packet in packets]
            if not any(found[protocol] for protocol in spoken) and any(map(_asks, unheard)):
                self._fall_silent()  # nobody here speaks that
            for protocol in spoken:
                for packet in found[protocol]:
                    answer = b"" if self._lost() else self._carried_out(packet, protocol)
                    if not answer and _asks(packet):
                        self._fall_silent()
                    answers += answer
            return data + answers if self.echoes else answers

    def _fall_silent(self) -> None:
        """Nobody answers; but an echo may not be on the line yet, and whoever waits for it must not give up."""
        if not self.echoes:
            self._clock.fell_silent()

    def _packets(self, protocol: int, data: bytes) -> list[Packet]:
        """The whole packets that were heard. What is not in this protocol is noise to those that speak it."""
        packets: list[Packet] = []
        heard = self._heard[protocol] + data
        while True:
            packet, heard = WIRES[protocol].taken(heard)
            if packet is None:
                self._heard[protocol] = heard
                return packets
            packets.append(packet)

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

    def _carried_out(self, found: Packet, protocol: int) -> bytes:
        number, kind, parameters, good = found
        wire, (_, checksum, _) = WIRES[protocol], _REFUSED[protocol]
        meant = [s for s in self.servos if self._hears(s, protocol) and number in {s.get("id"), BROADCAST}]
        for servo in meant:
            servo.update()
        if not good:
            return b"".join(self._status(s, checksum) for s in meant[:1] if number != BROADCAST)
        if kind == SYNC_WRITE:
            self._sync(parameters, wire, meant)
            return b""
        answers = [self._one(servo, kind, parameters, wire) for servo in meant]
        if number == BROADCAST and (kind != PING or protocol == 2):
            return b"".join(answers) if kind == PING else b""  # in protocol 2 each waits for the one before
        if len({servo.get("return_delay") for servo in meant}) == len(meant):
            return b"".join(answers)  # one after the other
        return self._on_the_wire(answers, wire)

    def _hears(self, servo: Servo, protocol: int) -> bool:
        baud = self.baud()
        right = baud is None or servo.kind.bauds.get(baud) == servo.get("baud_rate")
        return right and servo.kind.protocol == protocol

    def _sync(self, parameters: bytes, wire: Wire, meant: list[Servo]) -> None:
        address, size = (int.from_bytes(parameters[i * wire.word : (i + 1) * wire.word], "little") for i in range(2))
        for at in range(2 * wire.word, len(parameters), size + 1):
            for servo in meant:
                if servo.get("id") == parameters[at]:
                    servo.write(address, parameters[at + 1 : at + 1 + size])

    def _one(self, servo: Servo, kind: int, parameters: bytes, wire: Wire) -> bytes:
        if self._faults.strikes("silent-servo", self._clock.now_s(), servo.get("id")):
            return b""
        unknown, _, no_register = _REFUSED[servo.kind.protocol]
        if kind == PING:
            known = bytes(servo.table[:2]) + bytes([servo.get("firmware")])
            return self._status(servo, 0, known if servo.kind.protocol == 2 else b"")
        if kind == READ:
            address, size = (int.from_bytes(parameters[i * wire.word : (i + 1) * wire.word], "little") for i in range(2))
            data = servo.read(address, size)
            answer = self._status(servo, no_register) if data is None else self._status(servo, 0, data)
            return answer if servo.get("status_return") >= 1 else b""
        if kind in {WRITE, REG_WRITE, ACTION, RESET} or (kind == REBOOT and servo.kind.protocol == 2):
            bits = self._changed(servo, kind, parameters, wire)
            return self._status(servo, bits) if servo.get("status_return") == 2 else b""
        return self._status(servo, unknown)

    def _changed(self, servo: Servo, kind: int, parameters: bytes, wire: Wire) -> int:
        address, data = int.from_bytes(parameters[: wire.word], "little"), parameters[wire.word :]
        if kind == WRITE:
            return servo.write(address, data)
        if kind == REBOOT:
            servo.reboot()
            return 0
        if kind == REG_WRITE:
            servo.pending = (address, data)
            servo.put("registered", 1)
            return 0
        if kind == RESET:
            for name, register in servo.kind.registers.items():
                servo.put(name, register.default)
            return 0
        pending, servo.pending = servo.pending, None
        servo.put("registered", 0)
        return _REFUSED[servo.kind.protocol][0] if pending is None else servo.write(*pending)

    def _on_the_wire(self, answers: list[bytes], wire: Wire) -> bytes:
        """Servos with the same id answer at nearly the same time: the bits of all, one over the other, a byte apart."""
        if len(answers) < 2:
            return b"".join(answers)
        bits = bytearray(b"\xff" * (max(len(a) for a in answers) + len(answers) - 1))
        for late, answer in enumerate(answers):
            for i, byte in enumerate(answer):
                bits[late + i] &= byte
        self._garbled = not wire.seems_whole(bytes(bits))
        return bytes(bits)

    def _status(self, servo: Servo, bits: int, data: bytes = b"") -> bytes:
        wire = WIRES[servo.kind.protocol]
        answer = wire.status(servo.get("id"), bits | servo.errors(), data)
        now_s = self._clock.now_s()
        self._clock.sleep(servo.get("return_delay") * 2e-6 + len(answer) * _BYTE_S)
        if self._faults.strikes("lost-reply", now_s):
            return b""
        if self._faults.strikes("corrupt-reply", now_s):
            answer = self._faults.byte(answer)
            self._garbled = not wire.seems_whole(answer)
        return answer
