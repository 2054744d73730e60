"""A chain of AX-12 servos over the Dynamixel SDK: every answer's result and error byte is looked at, every write is confirmed."""

from __future__ import annotations

import math
import struct
from collections.abc import Callable, Mapping, Sequence
from contextlib import suppress
from dataclasses import asdict

from bns.errors import HardwareError
from bns.extras import extra
from bns.hardware.clock import Clock
from bns.hardware.link.hardware_log import HardwareLog
from bns.hardware.link.terminal_error import TerminalError
from bns.hardware.servos.ax12_table import BROADCAST, CENTRE, RAD_PER_STEP, RAD_S_PER_STEP, REGISTERS, errors_in
from bns.hardware.servos.dynamixel_port import ClockedPort
from bns.hardware.servos.servo_chain import STILL_STEPS, Health, ServoError, ServoLimits
from bns.hardware.stop import Stop

with extra("robot"):
    from dynamixel_sdk import COMM_RX_CORRUPT, COMM_SUCCESS, GroupSyncWrite, PacketHandler

BAUD = 1_000_000
ATTEMPTS = 6
_AX12 = 12
_BETWEEN_S = 0.02
_GOAL = REGISTERS["goal_position"]
_PRESENT = struct.Struct("<HHHBB")


class Ax12Chain:
    """Driver of servos `ids` in the order of the joints. Opening checks that each is there, once, and an AX-12."""

    def __init__(
        self, port: str, ids: Sequence[int], clock: Clock, journal: HardwareLog, limits: ServoLimits | None = None
    ) -> None:
        self.ids, self._clock, self._journal = tuple(ids), clock, journal
        self.limits = limits or ServoLimits()
        self.retries = 0
        self._limits_of: dict[int, tuple[int, int]] = {}
        self._port, self._packets = ClockedPort(port, clock), PacketHandler(1.0)
        if not self._port.setBaudRate(BAUD):
            raise HardwareError(f"{port} cannot be set to {BAUD} baud; another adapter may be needed.")
        self._check()

    def _check(self) -> None:
        wrong = [text for number in self.ids if (text := self._what_is_wrong(number))]
        if wrong:
            self.close()
            raise HardwareError("; ".join(wrong) + ". Check cables, power and ids (bns doctor lists who answers).")

    def _what_is_wrong(self, number: int) -> str:
        try:
            model = self.read(number, "model_number")
        except ServoError as error:
            if "corrupt" in str(error):
                return f"servo {number}: answers are garbled; two servos may have this id ({error})"
            return f"servo {number} is missing ({error})"
        return "" if model == _AX12 else f"servo {number} is a model {model}, not an AX-12 ({_AX12})"

    def read(self, number: int, name: str, alarms: bool = False) -> int:
        """A register; ServoError if the servo does not answer or reports an alarm (which `alarms` lets pass)."""
        register = REGISTERS[name]
        call = self._packets.read1ByteTxRx if register.size == 1 else self._packets.read2ByteTxRx
        return int(self._checked(number, f"read {name}", lambda: call(self._port, number, register.address), alarms))

    def write(self, number: int, name: str, value: int, alarms: bool = False) -> None:
        """Write a register and take the servo's confirmation."""
        register = REGISTERS[name]
        call = self._packets.write1ByteTxRx if register.size == 1 else self._packets.write2ByteTxRx
        self._checked(
            number, f"write {name} {value}", lambda: (0, *call(self._port, number, register.address, value)), alarms
        )

    def _checked(
        self, number: int, what: str, call: Callable[[], tuple[int, int, int]], alarms: bool, attempts: int = ATTEMPTS
    ) -> int:
        """Value of a call that answers (value, result, error byte); asked again when nothing or nonsense comes."""
        problem = ""
        for attempt in range(attempts):
            self.retries += attempt > 0
            try:
                self._reopen()
                value, result, bits = call()
            except IndexError:  # the SDK reads past the end of a status packet that is too short
                value, result, bits = 0, COMM_RX_CORRUPT, 0
                problem = "corrupt status packet"
            except (OSError, TerminalError, HardwareError) as error:
                self._lose(error)
                raise ServoError(f"the port is gone ({error})") from error
            finally:
                self._port.is_using = False  # an exchange broken off leaves it set, and every later call fails
            self._journal.note("servo", id=number, what=what, result=result, error=bits, value=value)
            if result == COMM_SUCCESS:
                if bits and not alarms:
                    raise ServoError(f"servo {number}: {', '.join(errors_in(bits))}")
                return value
            problem = problem or str(self._packets.getTxRxResult(result))
        raise ServoError(f"servo {number}: {what}: {problem}; asked {attempts} times")

    def close(self) -> None:
        """Give the port free."""
        if self._port.is_open:
            self._port.closePort()

    def _lose(self, error: Exception) -> None:
        if self._port.is_open:  # else it was gone before
            self._journal.note("link-lost", port=self._port.port_name, error=str(error))
        with suppress(OSError, TerminalError):
            self.close()
        self._port.is_open = False

    def _reopen(self) -> None:
        """A port that has vanished (an adapter that was unplugged) is tried again at every exchange."""
        if not self._port.is_open:
            self._port.setBaudRate(BAUD)

    def arm(self, meanwhile: Callable[[], object] = lambda: None) -> None:
        """Torque on without a jerk: the goal is where the joint is, and the torque grows in steps to its limit.

        `meanwhile` is called for each servo and step.
        """
        for number in self.ids:
            meanwhile()
            here = self.read(number, "present_position")
            self.write(number, "torque_limit", 0)
            self.write(number, "goal_position", here)
            self.write(number, "moving_speed", 1)
        for share in (0.25, 0.5, 0.75, 1.0):
            for number in self.ids:
                meanwhile()
                self.write(number, "torque_limit", round(1023 * self.limits.torque * share))
                self.write(number, "torque_enable", 1)
            self._clock.sleep(0.05)

    def move(self, angles_rad: Sequence[float], speeds_rad_s: Sequence[float]) -> list[float]:
        """Set goals and speeds of all joints at once; the angles really sent, after clipping, once all confirmed them.

        A speed of 0 would be as fast as the servo can: the slowest speed is sent instead.
        """
        sent = [self._goal(number, angle) for number, angle in zip(self.ids, angles_rad, strict=True)]
        together = GroupSyncWrite(self._port, self._packets, _GOAL.address, 4)
        for number, goal, speed in zip(self.ids, sent, speeds_rad_s, strict=True):
            steps = max(1, min(1023, round(abs(speed) / RAD_S_PER_STEP)))
            together.addParam(number, [*goal.to_bytes(2, "little"), *steps.to_bytes(2, "little")])
        for _ in range(ATTEMPTS):
            self._port.is_using = False
            together.txPacket()
            heard = [self.read(number, "goal_position") for number in self.ids]  # nobody answers a sync write
            if heard == sent:
                return [(goal - CENTRE) * RAD_PER_STEP for goal in sent]
        raise ServoError(f"goals {sent} were sent and {heard} read back, {ATTEMPTS} times")

    def _goal(self, number: int, angle_rad: float) -> int:
        if not math.isfinite(angle_rad):
            raise ServoError(f"servo {number}: the angle is {angle_rad}")
        low, high = self._angle_limits(number)
        return max(low, min(high, CENTRE + round(angle_rad / RAD_PER_STEP)))

    def _angle_limits(self, number: int) -> tuple[int, int]:
        if number not in self._limits_of:
            self._limits_of[number] = self.read(number, "cw_angle_limit"), self.read(number, "ccw_angle_limit")
        return self._limits_of[number]

    def health(self) -> Mapping[int, Health]:
        """What every servo says; ServoError if one is beyond its limits."""
        found = {number: self._health(number) for number in self.ids}
        self.limits.check(found)
        return found

    def _health(self, number: int, alarms: bool = False) -> Health:
        """One exchange for all of it: the registers stand side by side."""
        return decoded(self._block(number, "present_position", "present_temperature", alarms))

    def _block(self, number: int, first: str, last: str, alarms: bool = False, attempts: int = ATTEMPTS) -> bytes:
        """The registers from `first` to `last`."""
        start, end = REGISTERS[first].address, REGISTERS[last].address + REGISTERS[last].size
        found: list[bytes] = []

        def call() -> tuple[int, int, int]:
            data, result, bits = self._packets.readTxRx(self._port, number, start, end - start)
            found[:] = [bytes(data)]
            return 0, result if result != COMM_SUCCESS or len(data) == end - start else COMM_RX_CORRUPT, bits

        self._checked(number, f"read {first} to {last}", call, alarms, attempts)
        return found[0]

    def recover(self, number: int) -> None:
        """After an overload shutdown, when its cause is gone: the torque limit is written again, and no alarm may be left."""
        self.write(number, "torque_limit", round(1023 * self.limits.torque), alarms=True)
        self.read(number, "present_position")

    def stop(self, patience_s: float = 5.0) -> Stop:
        """Torque off, confirmed by every servo: torque reads 0, and no joint moves from one look to the next. Never raises.

        The order goes to all at once, and again for those that have not confirmed it; each is asked once a round, so that one
        that is silent holds up nobody's else confirmation.
        """
        began_s, acknowledged_s, off = self._clock.now_s(), None, dict[int, int]()
        while True:
            round_s = self._clock.now_s()
            if len(off) < len(self.ids):
                self._all_off()
            left = {number: why for number in self.ids if (why := self._not_still(number, off))}
            now_s = self._clock.now_s()
            acknowledged_s = acknowledged_s or (now_s - began_s if len(off) == len(self.ids) else None)
            if not left or now_s - began_s > patience_s:
                break
            self._clock.sleep(round_s + _BETWEEN_S - now_s)
        stop = Stop(not left, now_s - began_s, acknowledged_s, "; ".join(left.values()))
        self._journal.note("stop", **asdict(stop))
        return stop

    def _all_off(self) -> None:
        """Take the torque off all servos at once; nobody answers that."""
        self._port.is_using = False
        with suppress(OSError, TerminalError, HardwareError):
            self._reopen()
            self._packets.write1ByteTxOnly(self._port, BROADCAST, REGISTERS["torque_enable"].address, 0)
            self._port.is_using = False

    def _not_still(self, number: int, places: dict[int, int]) -> str:
        """Why a servo does not stand still yet, or nothing. `places`: where those whose torque is off were at the last look."""
        try:
            block = self._block(number, "torque_enable", "present_position", alarms=True, attempts=1)
        except ServoError as error:
            return str(error)
        if block[0]:
            places.pop(number, None)
            return f"servo {number} still has its torque on"
        before, places[number] = places.get(number), int.from_bytes(block[-2:], "little")
        still = before is not None and abs(places[number] - before) <= STILL_STEPS
        return "" if still else f"servo {number} still moves"


def decoded(block: bytes) -> Health:
    """What the registers from `present_position` to `present_temperature` say."""
    position, _speed, load, decivolts, celsius = _PRESENT.unpack(block)
    return Health(
        (position - CENTRE) * RAD_PER_STEP, (load & 1023) / 1023 * (-1 if load & 1024 else 1), decivolts / 10, float(celsius)
    )
