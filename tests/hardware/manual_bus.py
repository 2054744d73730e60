"""A bus of AX-12 servos written from the makers' e-manual alone; it shares no code and no table with `bns`.

Packets FF FF ID LENGTH INSTRUCTION PARAMETERS ~SUM; instructions ping 1, read 2, write 3, registered write 4, action 5,
synchronous write 0x83. Error bits: 2 angle limit, 8 range, 16 checksum, 32 overload, 64 instruction.
"""

import math

BYTE_S = 10 / 1_000_000
STEPS_S = 0.111 * 360 / 60 / (300 / 1023)
"""Steps a second for each unit of moving speed: 0.111 turns a minute, of 300 degrees in 1023 steps."""
NO_LOAD = 532
SOONEST_S = 18e-6
"""The shortest gap before an answer that was reported of servos whose return delay is 0 (18 to 70 µs)."""
ID, DELAY, LOW, HIGH, LEVEL, TORQUE, GOAL, SPEED, LIMIT, POSITION = 3, 5, 6, 8, 16, 24, 30, 32, 34, 36
DEFAULTS = {0: 12, 2: 24, 4: 1, 5: 250, 8: 255, 9: 3, 11: 70, 12: 60, 13: 140, 14: 255, 15: 3, 16: 2, 17: 36, 18: 36}
DEFAULTS |= {26: 1, 27: 1, 28: 32, 29: 32, 34: 255, 35: 3, 42: 118, 43: 33, 48: 32}
ALL, PING, READ, WRITE, SYNC_WRITE = 254, 1, 2, 3, 0x83


class ManualServo:
    """`table` is the control table; `steps` where its shaft is; `alarm` stands in every status packet."""

    def __init__(self, number, steps=512.0, **words):
        self.table, self.steps, self.alarm, self._then_s = bytearray(50), float(steps), 0, 0.0
        for address, value in (DEFAULTS | {ID: number}).items():
            self.table[address] = value
        for name, value in words.items():
            self.put({"low": LOW, "high": HIGH}[name], value)
        self.put(GOAL, round(self.steps))

    def word(self, address):
        return self.table[address] + 256 * self.table[address + 1]

    def put(self, address, value):
        self.table[address : address + 2] = bytes([value & 255, value >> 8])

    @property
    def holds(self):
        """Whether its motor has power."""
        return bool(self.table[TORQUE]) and self.word(LIMIT) > 0

    def turn(self, now_s):
        passed_s, self._then_s, before = now_s - self._then_s, now_s, self.steps
        if self.holds:
            most = (self.word(SPEED) or NO_LOAD) * STEPS_S * passed_s
            self.steps += max(-most, min(most, self.word(GOAL) - self.steps))
        self.put(POSITION, round(self.steps))
        left = self.word(GOAL) - self.steps
        self.put(40, (min(1023, int(abs(left) * 4)) if self.holds else 0) + (1024 if left < 0 else 0))
        self.table[46] = abs(self.steps - before) > 0.05

    def write(self, address, data):
        """Error bits."""
        if address < ID or address + len(data) > 50 or address in range(36, 44) or not data:
            return 8
        changed = bytearray(self.table)
        changed[address : address + len(data)] = data
        words = {at: changed[at] + 256 * changed[at + 1] for at in (LOW, HIGH, 14, GOAL, SPEED, LIMIT)}
        if any(value > 1023 for value in words.values()) or changed[TORQUE] > 1 or changed[LEVEL] > 2:
            return 8
        if address <= GOAL < address + len(data) and not words[LOW] <= words[GOAL] <= words[HIGH]:
            return 2
        self.table[:] = changed
        return 0


class ManualBus:
    """`on_the_way(count, number, packet)` gives what becomes of the count-th answer: seconds later, the bytes that arrive."""

    def __init__(self, servos, on_the_way=lambda _count, _number, packet: (0.0, packet)):
        self.servos, self.on_the_way, self._heard, self._count = list(servos), on_the_way, bytearray(), 0

    def heard(self, now_s, byte):
        for servo in self.servos:
            servo.turn(now_s)
        self._heard.append(byte)
        packet = self._whole()
        if packet is None:
            return 0.0, b""
        number, instruction, parameters, good = packet
        if good and instruction == SYNC_WRITE and number == ALL:
            self._written_together(parameters)
            return 0.0, b""
        for servo in self.servos:
            if number in {ALL, servo.table[ID]}:
                said = self._answer(servo, instruction, parameters, good)
                if number != ALL and said is not None:
                    return self._sent(servo, said)
        return 0.0, b""

    def _whole(self):
        heard = self._heard
        while len(heard) >= 3 and (heard[:2] != b"\xff\xff" or heard[2] == 0xFF):
            del heard[0]
        if len(heard) < 4 or len(heard) < 4 + heard[3]:
            return None
        body = bytes(heard[2 : 4 + heard[3]])
        heard.clear()
        return (body[0], body[2], body[3:-1], sum(body) & 255 == 255) if len(body) > 3 else None

    def _answer(self, servo, instruction, parameters, good):
        """Error bits and data of the status packet; None for silence."""
        level = servo.table[LEVEL]
        if not good:
            return 16, b""
        if instruction == PING:
            return 0, b""
        if instruction == READ and len(parameters) == 2:
            if level == 0:
                return None
            there = sum(parameters) <= 50
            return (0, bytes(servo.table[parameters[0] : sum(parameters)])) if there else (8, b"")
        if instruction == WRITE and parameters:
            bits = servo.write(parameters[0], parameters[1:])
            return (bits, b"") if level == 2 else None
        return (64, b"") if level == 2 else None

    def _written_together(self, parameters):
        address, size = parameters[:2]
        for at in range(2, len(parameters), size + 1):
            for servo in self.servos:
                if servo.table[ID] == parameters[at]:
                    servo.write(address, parameters[at + 1 : at + 1 + size])

    def _sent(self, servo, said):
        bits, data = said
        body = bytes([servo.table[ID], len(data) + 2, bits | servo.alarm]) + data
        packet = b"\xff\xff" + body + bytes([~sum(body) & 255])
        self._count += 1
        later_s, packet = self.on_the_way(self._count, servo.table[ID], packet)
        return max(servo.table[DELAY] * 2e-6, SOONEST_S) + later_s, packet


def angle_rad(steps):
    """The angle of a joint whose servo is there."""
    return math.radians((steps - 512) * 300 / 1023)
