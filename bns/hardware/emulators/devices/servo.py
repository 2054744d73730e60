"""An AX-12 servo: its control table, its alarms and shutdown, and a shaft that turns in time."""

from __future__ import annotations

import math
from typing import NamedTuple, Protocol

from bns.hardware.clock import EmulatedClock
from bns.hardware.emulators.faults import Faults
from bns.hardware.servos.ax12_table import ANGLE, OVERHEAT, OVERLOAD, RANGE, REGISTERS, TABLE_SIZE, VOLTAGE

_NO_LOAD_STEPS_S = 59 * 360 / 60 * 1023 / 300  # 59 turns a minute
_SPEED_STEPS_S = 0.111 * 360 / 60 * 1023 / 300
_COOL_C = 30


class Order(NamedTuple):
    """What a servo's motor does: share of the highest torque it may use (0: off), goal in steps, speed in steps a second."""

    torque: float
    goal: float
    speed: float


class Motion(NamedTuple):
    """What a shaft does: position in steps, speed in steps a second, share of the highest torque used, whether on its way."""

    position: float
    speed: float
    load: float
    moving: bool


class Shaft(Protocol):
    """What a servo turns."""

    def motion(self, servo: Servo, now_s: float) -> Motion:
        """Carry out the servo's present order up to now."""


class FreeShaft:
    """Nothing hangs on it: it turns at the speed asked for."""

    def __init__(self, position: float, now_s: float) -> None:
        self._position, self._moved_s = position, now_s

    def motion(self, servo: Servo, now_s: float) -> Motion:
        """Turn up to now."""
        order = servo.order()
        passed_s, self._moved_s = now_s - self._moved_s, now_s
        aim = order.goal if order.torque > 0 else self._position
        self._position += math.copysign(min(abs(aim - self._position), order.speed * passed_s), aim - self._position)
        left = aim - self._position
        moving = abs(left) >= 1.0
        load = math.copysign(min(abs(left) / (32 * 3.41), order.torque), left)
        return Motion(self._position, math.copysign(order.speed, left) if moving else 0.0, load, moving)


class Servo:
    """One servo: its table, and its shaft (one that turns freely unless another is given)."""

    def __init__(self, number: int, clock: EmulatedClock, faults: Faults, shaft: Shaft | None = None, **values: int) -> None:
        self._clock, self._faults = clock, faults
        self.table = bytearray(TABLE_SIZE)
        for name, register in REGISTERS.items():
            self.put(name, values.get(name, register.default))
        self.put("id", number)
        self.shaft: Shaft = shaft or FreeShaft(float(self.get("present_position")), clock.now_s())
        self.alarm = self.latched = 0
        self.pending: tuple[int, bytes] | None = None

    def get(self, name: str) -> int:
        """Value of a register."""
        register = REGISTERS[name]
        return int.from_bytes(self.table[register.address : register.address + register.size], "little")

    def put(self, name: str, value: int) -> None:
        """Set a register, whether hosts may or not."""
        register = REGISTERS[name]
        self.table[register.address : register.address + register.size] = value.to_bytes(register.size, "little")

    def order(self) -> Order:
        """What the motor is to do; a speed of 0 is as fast as it can."""
        asked = self.get("moving_speed") * _SPEED_STEPS_S
        torque = self.get("torque_limit") / 1023 if self.get("torque_enable") else 0.0
        return Order(torque, float(self.get("goal_position")), min(asked, _NO_LOAD_STEPS_S) if asked > 0 else _NO_LOAD_STEPS_S)

    def update(self) -> None:
        """Turn the shaft up to now, and see whether an alarm shuts the servo down."""
        now_s = self._clock.now_s()
        now = self.shaft.motion(self, now_s)
        self.put("present_position", min(max(round(now.position), 0), 1023))
        self.put("present_speed", _signed(now.speed / _SPEED_STEPS_S))
        self.put("present_load", _signed(now.load * 1023))
        self.put("moving", int(now.moving))
        self._alarms(now_s)

    def _alarms(self, now_s: float) -> None:
        number = self.get("id")
        if self._faults.strikes("overheat", now_s, number):
            self.put("present_temperature", 75)
        elif self.get("present_temperature") > _COOL_C:
            self.put("present_temperature", _COOL_C)
        found = 0
        if not self.get("low_voltage_limit") <= self.get("present_voltage") <= self.get("high_voltage_limit"):
            found |= VOLTAGE
        if self.get("present_temperature") > self.get("temperature_limit"):
            found |= OVERHEAT
        if self._faults.strikes("overload", now_s, number):
            found |= OVERLOAD
        if found & self.get("alarm_shutdown"):
            self.put("torque_limit", 0)
            self.put("torque_enable", 0)
            self.latched |= found & OVERLOAD
        self.alarm = found

    def errors(self) -> int:
        """Error byte: alarms there are, and an overload that was not acknowledged by writing the torque limit again."""
        return self.alarm | self.latched

    def write(self, address: int, data: bytes) -> int:
        """Write into the table; the error bits of it."""
        last = address + len(data)
        touched = {n: r for n, r in REGISTERS.items() if r.address < last and address < r.address + r.size}
        if last > TABLE_SIZE or not touched:
            return RANGE
        trial = bytearray(self.table)
        trial[address:last] = data
        for name, register in touched.items():
            value = int.from_bytes(trial[register.address : register.address + register.size], "little")
            if not register.writable or value > register.highest:
                return RANGE
            if name == "goal_position" and not self.get("cw_angle_limit") <= value <= self.get("ccw_angle_limit"):
                return ANGLE
        self.table[:] = trial
        if "torque_limit" in touched and not self.alarm & OVERLOAD:
            self.latched &= ~OVERLOAD
        if "goal_position" in touched and self.get("torque_limit") > 0:
            self.put("torque_enable", 1)  # a goal switches the torque on by itself
        return 0


def _signed(value: float) -> int:
    """As loads and speeds stand in the table: ten bits of size, and one for the direction."""
    return min(round(abs(value)), 1023) | (1024 if value < 0 else 0)
