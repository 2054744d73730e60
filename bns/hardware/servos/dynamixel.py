"""A chain of Dynamixel servos over the makers' SDK: every answer's result and error byte is looked at, every write is confirmed.

Which model, and so which protocol, registers and units, is said by a table.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from contextlib import suppress
from dataclasses import asdict

from bns.errors import HardwareError
from bns.extras import extra
from bns.hardware.clock import Clock
from bns.hardware.link.hardware_log import HardwareLog
from bns.hardware.link.terminal_error import TerminalError
from bns.hardware.servos.ax12_table import AX12
from bns.hardware.servos.dynamixel_port import ClockedPort
from bns.hardware.servos.packets import BROADCAST
from bns.hardware.servos.servo_chain import (
    Health,
    RestartedServoError,
    ServoAlarmError,
    ServoError,
    ServoLimits,
    narrow,
)
from bns.hardware.servos.servo_models import name_of
from bns.hardware.servos.servo_table import BAUD, ServoTable
from bns.hardware.stop import Stop

with extra("robot"):
    from dynamixel_sdk import COMM_RX_CORRUPT, COMM_SUCCESS, GroupSyncWrite, PacketHandler

ATTEMPTS = 6
_BETWEEN_S = 0.02
_SURE = 2
"""So often a second answer comes again if there is a second servo, and not if it was a late one."""
_REBOOTS_S = 0.5
"""A guess: the manual does not say how long a servo takes."""


class DynamixelChain:
    """Driver of servos `ids` in the order of the joints. Opening checks that each is there, once, of the table's model, and that
    its angle limits leave `reach_rad` to both sides."""

    def __init__(
        self,
        port: str,
        ids: Sequence[int],
        clock: Clock,
        journal: HardwareLog,
        limits: ServoLimits | None = None,
        table: ServoTable = AX12,
        reach_rad: float = 0.0,
    ) -> None:
        self.ids, self._clock, self._journal = tuple(ids), clock, journal
        self.limits, self.table = limits or ServoLimits(), table
        self.step_rad, self._reach_rad = table.rad_per_step, reach_rad
        self.retries = 0
        self._limits_of: dict[int, tuple[int, int]] = {}
        self._armed, self._turn = False, 0
        """Whether the servos were given their torque; which of them is asked for it next, where that takes a question."""
        self._in_one = table.without_gaps("torque_enable", self._present()[1])
        self._port, self._packets = ClockedPort(port, clock), PacketHandler(float(table.protocol))
        if not self._port.setBaudRate(BAUD):
            raise HardwareError(f"{port} cannot be set to {BAUD} baud; another adapter may be needed.")
        self._check()

    def _check(self) -> None:
        wrong = self._all_that_is_wrong()
        if wrong and not self._port.echoes:
            self._port.find_echo()
            wrong = self._all_that_is_wrong() if self._port.echoes else wrong
        if len(self.ids) > 1 and len(wrong) == len(self.ids) and all(" is missing (" in text for text in wrong):
            self.close()
            raise HardwareError(
                f"none of the {len(wrong)} servos answers at {self._port.port_name} ({self.table.model}, {BAUD} baud). Is their "
                "supply on, is the adapter connected to them, are model and baud rate right? bns servos scan lists who answers."
            )
        if wrong:
            self.close()
            raise HardwareError("; ".join(wrong) + ". Check cables, power and ids (bns servos scan lists who answers).")

    def _all_that_is_wrong(self) -> list[str]:
        return [text for number in self.ids if (text := self._what_is_wrong(number))]

    def _what_is_wrong(self, number: int) -> str:
        try:
            return self._setting_that_is_wrong(number)
        except ServoAlarmError as error:
            return str(error)
        except ServoError as error:
            if "corrupt" in str(error):
                return f"servo {number}: answers are garbled; two servos may have this id ({error})"
            return f"servo {number} is missing ({error})"

    def _setting_that_is_wrong(self, number: int) -> str:
        model = self.read(number, "model_number")
        if self._port.more_comes() and all(self._comes_twice(number) for _ in range(_SURE)):
            return f"servo {number} answers twice: two servos have this id. Connect them one at a time: bns servos set-id"
        if model != self.table.number:
            return f"servo {number} is of the model {name_of(self.table.protocol, model)}, not {self.table.model}"
        for name in self.table.needed:
            if (value := self.read(number, name)) != self.table.wanted[name]:
                wanted = self.table.wanted[name]
                return f"servo {number} has {name} {value}, not {wanted} (bns servos check --fix --port PORT sets it)"
        # The limits now: behind a slow adapter they would hold up the first look at a robot that moves.
        why = narrow(number, self._angle_limits(number), self.table, self._reach_rad)
        return f"{why} (bns servos check --fix --port PORT sets them)" if why else ""

    def _comes_twice(self, number: int) -> bool:
        self.read(number, "model_number")
        return self._port.more_comes()

    def read(self, number: int, name: str, alarms: bool = False) -> int:
        """A register; ServoError if the servo does not answer or reports an alarm (which `alarms` lets pass)."""
        return self.table.in_block(name, self._block(number, name, name, alarms), self.table.registers[name].address)

    def write(self, number: int, name: str, value: int, alarms: bool = False) -> None:
        """Write a register and take the servo's confirmation."""
        address, size = self.table.span(name, name)
        data = list(value.to_bytes(size, "little"))
        self._checked(
            number,
            f"write {name} {value}",
            lambda: (b"", *self._packets.writeTxRx(self._port, number, address, size, data)),
            alarms,
        )

    def _checked(
        self, number: int, what: str, call: Callable[[], tuple[bytes, int, int]], alarms: bool, attempts: int = ATTEMPTS
    ) -> bytes:
        """Registers from a call that answers (registers, result, error byte); asked again when nothing or nonsense comes."""
        problem = ""
        for attempt in range(attempts):
            self.retries += attempt > 0
            try:
                self._reopen()
                data, result, bits = call()
                result = COMM_RX_CORRUPT if self._port.heard_itself else result
            except IndexError:  # the SDK reads past the end of a status packet that is too short
                data, result, bits = b"", COMM_RX_CORRUPT, 0
                problem = "corrupt status packet"
            except (OSError, TerminalError, HardwareError) as error:
                self._lose(error)
                raise ServoError(f"the port is gone ({error})") from error
            finally:
                self._port.is_using = False  # an exchange broken off leaves it set, and every later call fails
            self._journal.note("servo", id=number, what=what, result=result, error=bits, data=data.hex())
            if result == COMM_SUCCESS and self.table.garbled(bits):
                problem = "what reached it was garbled"
            elif result == COMM_SUCCESS:
                if bits & ~self.table.alarm_bits or (bits and not alarms):
                    alarm = self.table.in_words(bits, self._hardware_error(number, bits))
                    raise ServoAlarmError(number, alarm)
                return data
            else:
                problem = problem or str(self._packets.getTxRxResult(result))
        often = "once" if attempts == 1 else f"{attempts} times"
        raise ServoError(f"servo {number}: {what}: {problem}; asked {often}")

    def _hardware_error(self, number: int, bits: int) -> int:
        """The register that says which alarm, where the packets only say that there is one."""
        if not bits & self.table.alarm_bits or "hardware_error" not in self.table.registers:
            return 0
        return self.read(number, "hardware_error", alarms=True)

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
                self.write(number, "torque_limit", self._torque(share))
                self.write(number, "torque_enable", 1)
            self._clock.sleep(0.05)
        self._armed = True

    def _torque(self, share: float = 1.0) -> int:
        """So much of what the limits allow, as the register has it."""
        return round(self.table.full_torque * self.limits.torque * share)

    def move(self, angles_rad: Sequence[float], speeds_rad_s: Sequence[float]) -> list[float]:
        """Set goals and speeds of all joints at once; the angles really sent, after clipping, once all confirmed them.

        A speed of 0 would be as fast as the servo can: the slowest speed is sent instead.
        """
        sent = [self._goal(number, angle) for number, angle in zip(self.ids, angles_rad, strict=True)]
        first, last = sorted(("goal_position", "moving_speed"), key=lambda name: self.table.registers[name].address)
        together = GroupSyncWrite(self._port, self._packets, *self.table.span(first, last))
        for number, goal, speed in zip(self.ids, sent, speeds_rad_s, strict=True):
            steps = round(abs(speed) / self.table.rad_s_per_step)
            fastest = self.table.registers["moving_speed"].highest
            values = {"goal_position": goal, "moving_speed": max(1, min(fastest, steps))}
            data = [values[name].to_bytes(self.table.registers[name].size, "little") for name in (first, last)]
            together.addParam(number, [*b"".join(data)])
        for _ in range(ATTEMPTS):
            self._port.is_using = False
            together.txPacket()
            heard = [self.read(number, "goal_position") for number in self.ids]  # nobody answers a sync write
            if heard == sent:
                return [(goal - self.table.centre) * self.table.rad_per_step for goal in sent]
        raise ServoError(f"goals {sent} were sent and {heard} read back, {ATTEMPTS} times")

    def _goal(self, number: int, angle_rad: float) -> int:
        if not math.isfinite(angle_rad):
            raise ServoError(f"servo {number}: the angle is {angle_rad}")
        low, high = self._angle_limits(number)
        return max(low, min(high, self.table.centre + round(angle_rad / self.table.rad_per_step)))

    def _angle_limits(self, number: int) -> tuple[int, int]:
        """Both in one answer: a late one for one of them would pass for the other."""
        if number not in self._limits_of:
            names = "cw_angle_limit", "ccw_angle_limit"
            first, last = sorted(names, key=lambda name: self.table.registers[name].address)
            block, address = self._block(number, first, last), self.table.registers[first].address
            low, high = (self.table.in_block(name, block, address) for name in names)
            self._limits_of[number] = low, high
        return self._limits_of[number]

    def health(self) -> Mapping[int, Health]:
        """What every servo says; ServoError if one is beyond its limits, or has lost the torque that it was given.

        Where another question is needed for the torque, one servo in turn is asked.
        """
        found = {number: self._health(number) for number in self.ids}
        self.limits.check(found)
        if self._armed and not self._in_one:
            self._turn = (self._turn + 1) % len(self.ids)
            self._ask_torque(self.ids[self._turn])
        return found

    def check_torque(self) -> None:
        """ServoError if a servo has lost the torque that it was given."""
        for number in self.ids if self._armed else ():
            self._ask_torque(number)

    def _ask_torque(self, number: int) -> None:
        self._keeps_torque(number, self.read(number, "torque_enable"), self.read(number, "torque_limit"))

    def _keeps_torque(self, number: int, enabled: int, limit: int) -> None:
        """A servo that restarts has its torque off, or on again with the next goal, and the highest limit that it allows."""
        if enabled and limit == self._torque():
            return
        lost = "its torque is off" if not enabled else f"its torque limit is {limit}, not {self._torque()}"
        raise RestartedServoError(number, lost)

    def _health(self, number: int) -> Health:
        """One exchange for all of it: the registers stand side by side, and of some servos those of the torque before them."""
        first, last = self._present()
        if not self._armed or not self._in_one:
            return self.decoded(self._block(number, first, last))
        block, (address, _) = self._block(number, "torque_enable", last), self.table.span("torque_enable", last)
        self._keeps_torque(number, *(self.table.in_block(name, block, address) for name in ("torque_enable", "torque_limit")))
        return self.decoded(block[self.table.registers[first].address - address :])

    def _present(self) -> tuple[str, str]:
        """First and last of the registers that say how a servo is."""
        names = ("present_position", "present_load", "present_voltage", "present_temperature")
        ordered = sorted(names, key=lambda name: self.table.registers[name].address)
        return ordered[0], ordered[-1]

    def decoded(self, block: bytes) -> Health:
        """What those registers say."""
        address = self.table.registers[self._present()[0]].address
        position, load, decivolts, celsius = (
            self.table.in_block(name, block, address)
            for name in ("present_position", "present_load", "present_voltage", "present_temperature")
        )
        angle_rad = (position - self.table.centre) * self.table.rad_per_step
        return Health(angle_rad, load / self.table.full_torque, decivolts / 10, float(celsius))

    def _block(self, number: int, first: str, last: str, alarms: bool = False, attempts: int = ATTEMPTS) -> bytes:
        """The registers from `first` to `last`."""
        start, size = self.table.span(first, last)

        def call() -> tuple[bytes, int, int]:
            data, result, bits = self._packets.readTxRx(self._port, number, start, size)
            refused = bits & ~self.table.alarm_bits
            good = result != COMM_SUCCESS or refused or self._port.took(self.table.protocol, number, size)
            return bytes(data), result if good else COMM_RX_CORRUPT, bits

        return self._checked(number, f"read {first}" + f" to {last}" * (last != first), call, alarms, attempts)

    def recover(self, number: int) -> None:
        """After an overload shutdown, when its cause is gone: the torque limit is written again, or the servo rebooted where it
        takes that; and no alarm may be left. Its torque is off: the chain has to be armed again."""
        self._armed = False
        if "hardware_error" in self.table.registers:
            self._checked(number, "reboot", lambda: (b"", *self._packets.reboot(self._port, number)), True)
            self._clock.sleep(_REBOOTS_S)
        self.write(number, "torque_limit", self._torque(), alarms=True)
        self.read(number, "present_position")

    def stop(self, patience_s: float = 5.0) -> Stop:
        """Torque off, confirmed by every servo: torque reads 0, and no joint moves from one look to the next. Never raises.

        The order goes to all at once, in every round; each is asked once a round, so that one that is silent holds up nobody's
        else confirmation.
        """
        began_s, acknowledged_s, off = self._clock.now_s(), None, dict[int, int]()
        patience_s -= self._journal.held_up_s  # what the journal's disk takes from now on does not count
        self._armed = False
        while True:
            round_s = self._clock.now_s()
            self._all_off()  # every round: a guard that has taken the port gives it back for an order to stop alone
            left = {number: why for number in self.ids if (why := self._not_still(number, off))}
            now_s = self._clock.now_s()
            acknowledged_s = acknowledged_s or (now_s - began_s if len(off) == len(self.ids) else None)
            if not left or now_s - began_s > patience_s + self._journal.held_up_s:
                break
            self._clock.sleep(round_s + _BETWEEN_S - now_s)
        stop = Stop(not left, now_s - began_s, acknowledged_s, _in_words(left))
        self._journal.note("stop", **asdict(stop))
        return stop

    def _all_off(self) -> None:
        """Take the torque off all servos at once; nobody answers that."""
        self._port.is_using = False
        with suppress(OSError, TerminalError, HardwareError):
            self._reopen()
            self._packets.write1ByteTxOnly(self._port, BROADCAST, self.table.registers["torque_enable"].address, 0)
            self._port.is_using = False
            self._journal.note("servo", id=BROADCAST, what="write torque_enable 0 to all")

    def _not_still(self, number: int, places: dict[int, int]) -> str:
        """Why a servo does not stand still yet, or nothing. `places`: where those whose torque is off were at the last look."""
        try:
            powered, place = self._torque_and_place(number)
        except ServoError as error:
            return str(error).removeprefix(f"servo {number}: ")
        if powered:
            places.pop(number, None)
            return "torque still on"
        before, places[number] = places.get(number), place
        still = before is not None and abs(place - before) <= self.table.still_steps
        return "" if still else "still moving"

    def _torque_and_place(self, number: int) -> tuple[int, int]:
        """Together, where no register is missing in between: reading one that is not there is refused."""
        if self.table.gapless:
            block = self._block(number, "torque_enable", "present_position", alarms=True, attempts=1)
            address = self.table.registers["torque_enable"].address
            return block[0], self.table.in_block("present_position", block, address)
        torque = self._block(number, "torque_enable", "torque_enable", alarms=True, attempts=1)
        place = self._block(number, "present_position", "present_position", alarms=True, attempts=1)
        address = self.table.registers["present_position"].address
        return torque[0], self.table.in_block("present_position", place, address)


def _in_words(problems: Mapping[int, str]) -> str:
    """Servo -> what keeps it from being confirmed; servos with the same problem are named together."""
    servos: dict[str, list[int]] = {}
    for number, why in problems.items():
        servos.setdefault(why, []).append(number)
    return "; ".join(
        f"servo{'s' if len(numbers) > 1 else ''} {', '.join(map(str, numbers))}: {why}" for why, numbers in servos.items()
    )
