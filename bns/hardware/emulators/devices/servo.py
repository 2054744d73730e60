"""A Dynamixel servo of any model that has a table: its registers, its alarms and shutdown, and a shaft that turns in time."""

from __future__ import annotations

import math
from typing import NamedTuple, Protocol

from bns.hardware.clock import EmulatedClock
from bns.hardware.emulators.faults import Faults
from bns.hardware.servos.ax12_table import ANGLE, AX12, OVERHEAT, OVERLOAD, RANGE, VOLTAGE
from bns.hardware.servos.servo_table import ServoTable

_COOL_C = 30
_SLOPE_RAD = 32 * 3.41 * AX12.rad_per_step
"""So far from its goal a joint uses all of its torque: the AX-12's compliance slope of 32 steps, times 3.41."""
_TORQUE_WITH_GOAL = 0x08
"""Bit of `drive_mode`."""
_OUT_OF_RANGE, _TOO_SHORT, _BEYOND_A_LIMIT, _NO_ACCESS = 4, 5, 6, 7
"""Refusals of protocol 2."""


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
        load = math.copysign(min(abs(left) * servo.kind.rad_per_step / _SLOPE_RAD, order.torque), left)
        return Motion(self._position, math.copysign(order.speed, left) if moving else 0.0, load, moving)


class Servo:
    """One servo of a `kind`: its table, and its shaft (one that turns freely unless another is given)."""

    def __init__(
        self,
        number: int,
        clock: EmulatedClock,
        faults: Faults,
        shaft: Shaft | None = None,
        kind: ServoTable = AX12,
        **values: int,
    ) -> None:
        self._clock, self._faults, self.kind = clock, faults, kind
        self.table = bytearray(max(r.address + r.size for r in kind.registers.values()))
        for name, register in kind.registers.items():
            self.put(name, values.get(name, register.default))
        self.put("id", number)
        self._steps_s = kind.rad_s_per_step / kind.rad_per_step
        self.shaft: Shaft = shaft or FreeShaft(float(self.get("present_position")), clock.now_s())
        self.alarm = self.latched = 0
        self.pending: tuple[int, bytes] | None = None

    def get(self, name: str) -> int:
        """What is in a register."""
        register = self.kind.registers[name]
        return int.from_bytes(self.table[register.address : register.address + register.size], "little")

    def put(self, name: str, value: int) -> None:
        """Set a register, whether hosts may or not."""
        register, raw = self.kind.registers[name], self.kind.raw(name, value)
        self.table[register.address : register.address + register.size] = raw.to_bytes(register.size, "little")

    def order(self) -> Order:
        """What the motor is to do; a speed of 0 is as fast as it can."""
        asked, most = self.get("moving_speed") * self._steps_s, self.kind.no_load_rad_s / self.kind.rad_per_step
        limit = self.kind.value("torque_limit", self.get("torque_limit"))
        torque = abs(limit) / self.kind.full_torque if self.get("torque_enable") else 0.0
        return Order(torque, float(self.get("goal_position")), min(asked, most) if asked > 0 else most)

    def update(self) -> None:
        """Turn the shaft up to now, and see whether an alarm shuts the servo down."""
        now_s = self._clock.now_s()
        now = self.shaft.motion(self, now_s)
        highest = self.kind.registers["goal_position"].highest
        self.put("present_position", min(max(round(now.position), 0), highest))
        self.put("present_speed", _within(now.speed / self._steps_s))
        self.put("present_load", _within(now.load * self.kind.full_torque))
        self.put("moving", int(now.moving))
        self._alarms(now_s)

    def _alarms(self, now_s: float) -> None:
        number = self.get("id")
        if self._faults.strikes("restart", now_s, number):
            self.reboot()
        if self._faults.strikes("overheat", now_s, number):
            self.put("present_temperature", self.get("temperature_limit") + 5)
        elif self.get("present_temperature") > _COOL_C:
            self.put("present_temperature", _COOL_C)
        found = 0
        if not self.get("low_voltage_limit") <= self.get("present_voltage") <= self.get("high_voltage_limit"):
            found |= VOLTAGE
        if self.get("present_temperature") > self.get("temperature_limit"):
            found |= OVERHEAT
        if self._faults.strikes("overload", now_s, number):
            found |= OVERLOAD
        if shut_down := found & self.get("alarm_shutdown"):
            self.put("torque_enable", 0)
            if self.kind.protocol == 1:
                self.put("torque_limit", 0)
            self.latched |= found & OVERLOAD if self.kind.protocol == 1 else shut_down
        self.alarm = found
        if "hardware_error" in self.kind.registers:
            self.put("hardware_error", self.alarm | self.latched)

    def errors(self) -> int:
        """For the error byte: alarms there are, and those that were not acknowledged (by writing the torque limit of an AX-12
        again, by rebooting another)."""
        found = self.alarm | self.latched
        return found if self.kind.protocol == 1 else self.kind.alarm_bits * bool(found)

    def reboot(self) -> None:
        """As if it were switched off and on: what is not kept is as after a reset, the torque limit is at its highest."""
        for name, register in self.kind.registers.items():
            if register.address >= self.kind.registers["torque_enable"].address and not name.startswith("present"):
                self.put(name, register.default)
        self.put("torque_limit", self.get("max_torque"))
        self.put("goal_position", self.get("present_position"))
        self.latched = 0

    def read(self, address: int, size: int) -> bytes | None:
        """What is there; None where there is nothing to be read."""
        if self.kind.protocol == 1:
            return bytes(self.table[address : address + size]) if address + size <= len(self.table) else None
        held = {r.address + i for r in self.kind.registers.values() for i in range(r.size)}
        return bytes(self.table[address : address + size]) if held >= set(range(address, address + size)) else None

    def write(self, address: int, data: bytes) -> int:
        """Write into the table; what is wrong with it, as the error byte says it."""
        last = address + len(data)
        touched = {n: r for n, r in self.kind.registers.items() if r.address < last and address < r.address + r.size}
        refused = RANGE if self.kind.protocol == 1 else _NO_ACCESS
        if last > len(self.table) or not touched:
            return refused
        trial = bytearray(self.table)
        trial[address:last] = data
        for name, register in touched.items():
            value = int.from_bytes(trial[register.address : register.address + register.size], "little")
            if bits := self._refusal(name, value, (address, last)):
                return bits
        self.table[:] = trial
        if "torque_limit" in touched and self.kind.protocol == 1 and not self.alarm & OVERLOAD:
            self.latched &= ~OVERLOAD
        if "goal_position" in touched and self._torque_comes_with_goals():
            self.put("torque_enable", 1)
        if self.latched and self.kind.protocol != 1:
            self.put("torque_enable", 0)
        return 0

    def _refusal(self, name: str, value: int, written: tuple[int, int]) -> int:
        """Why a register cannot be set to this: a bit in protocol 1, a number in protocol 2; 0 if it can."""
        register, second = self.kind.registers[name], self.kind.protocol != 1
        if second and (written[0] > register.address or written[1] < register.address + register.size):
            return _TOO_SHORT
        locked = register.address < self.kind.locked_below and self.get("torque_enable")
        if not register.writable or locked:
            return _NO_ACCESS if second else RANGE
        if name == "goal_position" and not self.get("cw_angle_limit") <= value <= self.get("ccw_angle_limit"):
            beyond = value > register.highest
            return (_OUT_OF_RANGE if beyond else _BEYOND_A_LIMIT) if second else (RANGE if beyond else ANGLE)
        if abs(self.kind.value(name, value)) > register.highest:
            return _OUT_OF_RANGE if second else RANGE
        return 0

    def _torque_comes_with_goals(self) -> bool:
        """An AX-12's does by itself, unless its torque limit is zero; another's where its drive mode says so."""
        if self.kind.protocol == 1:
            return self.get("torque_limit") > 0
        return bool(self.get("drive_mode") & _TORQUE_WITH_GOAL)


def _within(value: float) -> int:
    """Loads and speeds have ten bits for their size in the smallest table."""
    return max(-1023, min(1023, round(value)))
