"""New Dynamixel servos made ready for a chain: who is on the bus, an id each, and settings that a drive needs.

New servos are all number 1 and answer at once, over each other; so one at a time is given its number. Registers and what they
mean, and the makers' voltages: the tables of the models.
"""

from __future__ import annotations

import os
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path
from typing import NamedTuple

from bns.errors import HardwareError
from bns.extras import extra
from bns.hardware.clock import Clock
from bns.hardware.doctor import Finding, latency_of
from bns.hardware.link.terminal_error import TerminalError
from bns.hardware.servos.ax12_table import AX12
from bns.hardware.servos.dynamixel_port import ClockedPort
from bns.hardware.servos.packets import BROADCAST, PING, WIRES
from bns.hardware.servos.servo_chain import narrow
from bns.hardware.servos.servo_models import TABLES, name_of, table_of
from bns.hardware.servos.servo_table import BAUD, ServoTable
from bns.hardware.servos.snake_settings import limits_of
from bns.physics.snake.gait import GREATEST_RAD

with extra("robot"):
    from dynamixel_sdk import COMM_RX_TIMEOUT, COMM_SUCCESS, COMM_TX_FAIL, INST_PING, PacketHandler

PROTOCOLS = (1, 2)
_LAST_ID = 252
_MOST_DELAY = 25
"""A return delay of 50 µs: above it, a round of twelve servos takes milliseconds longer for nothing."""
_EEPROM_S = 0.02
_ANSWERS_ALL = 2
_SURE = 3
_MOST_UNSENT = 5
"""A busy computer holds an echo up; an adapter that has none any more is broken."""
_ALL_ANSWER_S = 0.8
"""So long, by the makers' SDK, after a ping to all the last servo may begin to answer: 3 ms a number, and 16."""
MUTE = -1
_MUTE = "answers a ping and nothing else (status return level 0)"
_MOST_DOUBLED = 3
"""New servos all have id 1: so many garbled ids and no other are no doubled ones, but noise."""
NO_SERVO = "is this the port of the bus, and its rate? A line without servos may be noisy, too."
_NAMES = {"return_delay": "return delay", "status_return": "status return level"}


class Rate(NamedTuple):
    """Bits a second, and the protocol spoken at it."""

    baud: int
    protocol: int


def rates(protocols: Sequence[int] = PROTOCOLS, every: bool = False) -> list[Rate]:
    """Where servos are looked for: at the rate of a chain, and at that of new ones; or at every rate that they can be set to."""
    tables = [table for table in TABLES.values() if table.protocol in protocols]
    usual = [Rate(BAUD, table.protocol) for table in tables] + [Rate(table.new_baud, table.protocol) for table in tables]
    others = [Rate(baud, table.protocol) for table in tables for baud in table.bauds] if every else []
    return list(dict.fromkeys(usual + others))


def _others(looked: Sequence[Rate]) -> list[Rate]:
    """All rates of those protocols at which nobody has looked yet."""
    return [rate for rate in rates(sorted({rate.protocol for rate in looked}), every=True) if rate not in looked]


class OnTheBus(NamedTuple):
    """A number at which something answers; `model` is 0 where the answer is garbled, or comes twice, as by two servos of the same
    number, and `MUTE` where a ping is answered and nothing else: at status return level 0 (control tables: AX-12A, address 16; X
    series, address 68)."""

    number: int
    baud: int
    model: int
    protocol: int = 1

    @property
    def table(self) -> ServoTable | None:
        """Of its model, if there is one."""
        return table_of(self.protocol, self.model)

    @property
    def mute(self) -> bool:
        """Whether it answers a ping alone."""
        return self.model == MUTE

    def __str__(self) -> str:
        if self.mute:
            return f"id {self.number} at {self.baud} baud: {_MUTE}; bns servos check --fix --port PORT corrects it"
        if not self.model:
            return f"id {self.number} at {self.baud} baud: garbled; more than one servo has this id. Connect them one at a time"
        return f"id {self.number} at {self.baud} baud: {name_of(self.protocol, self.model)}"


class ServoBus:
    """A bus opened to set servos up; no other process can have it meanwhile. `say` is told what becomes of a servo's torque."""

    def __init__(self, port: str, clock: Clock, say: Callable[[str], None] = lambda _text: None) -> None:
        self.port, self._clock, self._say = port, clock, say
        self._packets = {protocol: PacketHandler(float(protocol)) for protocol in PROTOCOLS}
        self._line, self._baud = ClockedPort(port, clock), 0
        self._bits = 0
        self.untried: list[int] = []
        """Rates at which a scan could not look."""
        self.at(BAUD)
        self._line.find_echo()

    def at(self, baud: int) -> None:
        """Go on at this rate; HardwareError if the port cannot be opened or set to it."""
        if not self._set_to(baud):
            raise HardwareError(f"{self.port} cannot be set to {baud} baud; another adapter may be needed.")

    def _set_to(self, baud: int) -> bool:
        if baud != self._baud:
            self._baud = baud if self._line.setBaudRate(baud) else 0
        return self._baud == baud

    def scan(self, looked: Sequence[Rate] | None = None, numbers: Sequence[int] | None = None) -> Iterator[OnTheBus]:
        """All that answers, number by number; rates that the adapter does not have are passed over, and listed in `untried`."""
        self.untried = []
        for baud, protocol in rates() if looked is None else looked:
            if not self._set_to(baud):
                self.untried.append(baud)
                continue
            if numbers is None and protocol == 2 and self._nobody():
                continue
            packets = self._packets[protocol]
            for number in range(_LAST_ID + 1) if numbers is None else numbers:
                model, result = self._pinged(packets, number)
                if result != COMM_RX_TIMEOUT:
                    alone = result == COMM_SUCCESS and not all(self._comes_twice(packets, number, i) for i in range(_SURE))
                    alone = alone and self._of_one(packets, number, table_of(protocol, model))
                    yield OnTheBus(number, baud, model if alone else 0, protocol)

    def _nobody(self) -> bool:
        """Whether no byte comes back to pings to all, which in protocol 2 all servos answer, one after the other.

        In protocol 1 they may answer over each other, or not at all, so that each number has to be asked.
        """
        ping = WIRES[2].instruction(BROADCAST, PING)
        try:
            for _ in range(_SURE):  # one may be lost
                self._line.clearPort()
                if self._line.writePort(ping) != len(ping):
                    return False
                in_vain = self._clock.in_vain(_ALL_ANSWER_S)
                while not self._line.readPort(1):
                    if in_vain():
                        break
                else:
                    self._clock.sleep(_ALL_ANSWER_S)  # the others answer, too: whoever is asked next must not speak over them
                    return False
        except (OSError, TerminalError) as error:
            raise HardwareError(f"the port {self.port} is gone ({error}).") from error
        return True

    def set_id(self, new: int, old: int | None = None, looked: Sequence[Rate] | None = None) -> OnTheBus:
        """Give the servo on the bus a number, and the rate of a chain; HardwareError unless it is alone there (or alone has the
        number `old`)."""
        if not 0 <= new <= _LAST_ID:
            raise HardwareError(f"the id {new} is none; ids go from 0 to {_LAST_ID}.")
        looked = rates() if looked is None else looked
        there = list(self.scan(looked))
        if old is not None and all(servo.number != old for servo in there):
            there += self.scan(_others(looked), sorted({old, new}))
        meant = [servo for servo in there if old is None or servo.number == old]
        if not there:
            raise HardwareError(
                f"no servo answers{'' if old is None else f', and none has the id {old} at another rate'}. Is the supply on, is "
                "the cable connected? One at another rate: bns servos scan --all-bauds finds it, --from ID takes it from there."
            )
        if len(there) > _MOST_DOUBLED and not any(servo.model for servo in there):
            raise HardwareError(f"{len(there)} ids seem to answer, and none as a servo does: {NO_SERVO}")
        if len(meant) != 1 or not meant[0].model:
            which = "Connect one servo alone" if old is None else f"No single servo has the id {old}"
            raise HardwareError(f"{which}: {'; '.join(map(str, there))}. Name one of several with --from ID.")
        (servo,) = (self.unmuted(one) if one.mute else one for one in meant)
        if any(other.number == new for other in there if other is not meant[0]):
            raise HardwareError(f"another servo on this bus has the id {new}; take a free one, or connect one servo alone.")
        try:
            return self._numbered(servo, new)
        except HardwareError as error:
            raise HardwareError(f"{error} {_as_it_may_be(servo, new)}") from error

    def _numbered(self, servo: OnTheBus, new: int) -> OnTheBus:
        """Its number and rate written, and seen to be so."""
        if new != servo.number:
            self.write(servo, "id", new)
            servo = servo._replace(number=new)
        if servo.baud != BAUD and servo.table is not None:
            self.write(servo, "baud_rate", servo.table.bauds[BAUD])
        found = list(self.scan([Rate(BAUD, servo.protocol)], [new]))
        if len(found) != 1 or not found[0].model:
            raise HardwareError(f"no single servo answers as {new}.")
        return found[0]

    def check(self, servo: OnTheBus) -> Iterator[Finding]:
        """What of a servo's settings is not as a drive needs it."""
        number, table = servo.number, servo.table
        if servo.mute:
            yield Finding(False, f"servo {number} {_MUTE}", f"bns servos check --fix --port {self.port}")
            return
        name = name_of(servo.protocol, servo.model)
        usable = table is not None and servo.baud == BAUD
        replace_it = f"replace it; suitable are {', '.join(TABLES)}"
        at_rate = f"bns servos set-id {number} --from {number} --port {self.port}"
        try_next = "" if usable else at_rate if table else replace_it
        yield Finding(usable, f"servo {number}: {name} at {servo.baud} baud", try_next)
        if table is None:
            return
        mend = f"bns servos check --fix --port {self.port}"
        if alarm := self._alarm(servo, table):
            yield Finding(False, f"servo {number}: alarm: {alarm}", "find out what blocks or heats it; then switch it off and on")
        for what, wanted in table.wanted.items():
            if not what.endswith("angle_limit"):
                value = self.read(servo, what)
                good = value <= _MOST_DELAY if what == "return_delay" else value == wanted
                shown = f"{2 * value} µs" if what == "return_delay" else str(value)
                yield Finding(good, f"servo {number}: {_NAMES.get(what, what.replace('_', ' '))} {shown}", "" if good else mend)
        low, high = self.read(servo, "cw_angle_limit"), self.read(servo, "ccw_angle_limit")
        wide = not narrow(number, (low, high), table, GREATEST_RAD)
        yield Finding(wide, f"servo {number}: angle limits {low} to {high}", "" if wide else f"90° to both sides: {mend}")
        if unguarded := self._unguarded(servo, table):
            said = ", ".join(text for bit, text in table.alarms.items() if unguarded & (1 << bit))
            yield Finding(False, f"servo {number}: does not switch itself off where new ones do: {said}", mend)
        strongest = self.read(servo, "max_torque")
        if strongest < table.full_torque:
            address = table.registers["max_torque"].address
            weak = f"write {table.full_torque} to its register {address}, unless it is meant to be as weak as that"
            yield Finding(False, f"servo {number}: torque limited to {strongest} of {table.full_torque}", weak)
        volts, limits, (least_v, most_v) = self.read(servo, "present_voltage") / 10, limits_of(table), table.volts
        fed = limits.low_v <= volts <= limits.high_v
        supply = f"a supply of {limits.low_v:g} to {limits.high_v:g} V; the makers allow {least_v:g} to {most_v:g} V"
        yield Finding(fed, f"servo {number}: {volts:.1f} V", "" if fed else supply)

    def _alarm(self, servo: OnTheBus, table: ServoTable) -> str:
        """What it says is wrong with it, or nothing."""
        self.read(servo, "torque_enable")
        if not self._bits & table.alarm_bits:
            return ""
        hardware = self.read(servo, "hardware_error") if "hardware_error" in table.registers else 0
        return table.in_words(self._bits & table.alarm_bits, hardware)

    def _unguarded(self, servo: OnTheBus, table: ServoTable) -> int:
        """The alarms, bit by bit, at which a new servo of its model switches itself off and this one does not."""
        return table.registers["alarm_shutdown"].default & ~self.read(servo, "alarm_shutdown")

    def mend(self, servo: OnTheBus) -> list[str]:
        """Write the settings that a drive needs, read them back; names of those that were changed."""
        changed = []
        wanted = {} if servo.table is None else servo.table.wanted
        # What it confirms goes first, so that the others are confirmed.
        for name in sorted(wanted, key=lambda name: name != "status_return"):
            if self.read(servo, name) != wanted[name]:
                self.write(servo, name, wanted[name])
                changed.append(name)
        if servo.table is not None and (unguarded := self._unguarded(servo, servo.table)):
            self.write(servo, "alarm_shutdown", self.read(servo, "alarm_shutdown") | unguarded)
            changed.append("alarm_shutdown")
        return changed

    def unmuted(self, servo: OnTheBus) -> OnTheBus:
        """A servo that answered a ping alone, told to answer everything; HardwareError if it still does not."""
        table = next(one for one in TABLES.values() if one.protocol == servo.protocol)  # where models of one protocol agree
        address, _ = table.span("status_return", "status_return")
        packets = self._packets[servo.protocol]
        self.at(servo.baud)
        self._asked(lambda: (0, *packets.writeTxRx(self._line, servo.number, address, 1, [_ANSWERS_ALL])), attempts=1)
        self._clock.sleep(_EEPROM_S)
        found = list(self.scan([Rate(servo.baud, servo.protocol)], [servo.number]))
        if len(found) != 1 or found[0].model in {0, MUTE}:
            raise HardwareError(f"servo {servo.number} {_MUTE}, also after it was told to; switch it off and on.")
        return found[0]

    def read(self, servo: OnTheBus, name: str) -> int:
        """A register of one servo; HardwareError if it does not answer."""
        table = servo.table or AX12
        address, size = table.span(name, name)
        packets, found = self._packets[servo.protocol], list[int]()

        def call() -> tuple[int, int, int]:
            data, result, bits = packets.readTxRx(self._line, servo.number, address, size)
            found[:] = data
            return 0, result, bits

        self.at(servo.baud)
        _, result, self._bits = self._asked(call)
        if result != COMM_SUCCESS or len(found) != size:
            raise HardwareError(f"servo {servo.number} does not answer ({packets.getTxRxResult(result)}); check its cable.")
        return table.value(name, int.from_bytes(bytes(found), "little"))

    def write(self, servo: OnTheBus, name: str, value: int) -> None:
        """Write a register and read it back: whether a servo confirms a write depends on what is being set."""
        table = servo.table or AX12
        address, size = table.span(name, name)
        # X series take settings only so; an AX-12 that leaves wheel mode would turn to an old goal as fast as it can
        if address < table.registers["torque_enable"].address and self.read(servo, "torque_enable"):
            self.write(servo, "torque_enable", 0)
            self._say(f"servo {servo.number}: its torque was on and is switched off: its joint is limp now")
        data = list(value.to_bytes(size, "little"))
        self.at(servo.baud)
        packets = self._packets[servo.protocol]
        self._asked(lambda: (0, *packets.writeTxRx(self._line, servo.number, address, size, data)), attempts=1)
        self._clock.sleep(_EEPROM_S)
        now = servo._replace(number=value) if name == "id" else servo
        if name == "baud_rate":
            now = servo._replace(baud=next(baud for baud, code in table.bauds.items() if code == value))
        if (found := self.read(now, name)) != value:
            raise HardwareError(f"servo {servo.number}: {name} is {found} after {value} was written; switch it off and on.")

    def _pinged(self, packets: PacketHandler, number: int) -> tuple[int, int]:
        """Who answers a ping: the model, or `MUTE`; and how the SDK calls the answer."""
        ping = [0, 0, number, 2, INST_PING, 0]  # of protocol 1; the SDK's own reads the model as well, which some do not answer
        first = packets is self._packets[1]
        result = self._asked(lambda: packets.txRxPacket(self._line, list(ping)) if first else packets.ping(self._line, number))[1]
        if result != COMM_SUCCESS:
            return 0, result
        for _ in range(_SURE):  # a busy computer may miss an answer
            model, result, _ = self._asked(lambda: packets.read2ByteTxRx(self._line, number, 0))
            if result != COMM_RX_TIMEOUT:
                return int(model), result
        return MUTE, COMM_SUCCESS

    def _comes_twice(self, packets: PacketHandler, number: int, again: int) -> bool:
        """Whether two servos answer; `again`: it was asked before, and the second answer may have been a late one."""
        if again:
            self._pinged(packets, number)
        try:
            return self._line.more_comes()
        except (OSError, TerminalError) as error:
            raise HardwareError(f"the port {self.port} is gone ({error}).") from error

    def _of_one(self, packets: PacketHandler, number: int, table: ServoTable | None) -> bool:
        """Whether what is measured comes back whole: of two servos that answer in lock-step, the rest is the same bit by bit."""
        if table is None:
            return True
        address, size = table.span("present_position", "present_temperature")

        def call() -> tuple[int, int, int]:
            return 0, *packets.readTxRx(self._line, number, address, size)[1:]

        return any(self._asked(call, attempts=1)[1] in {COMM_SUCCESS, COMM_RX_TIMEOUT} for _ in range(_SURE))

    def close(self) -> None:
        """Give the port free."""
        if self._line.is_open:
            self._line.closePort()

    def _asked(self, call: Callable[[], tuple[int, int, int]], attempts: int = 2) -> tuple[int, int, int]:
        answer = (0, COMM_RX_TIMEOUT, 0)
        for _ in range(attempts):
            answer = self._sent(call)
            if answer[1] == COMM_SUCCESS:
                break
        return answer

    def _sent(self, call: Callable[[], tuple[int, int, int]]) -> tuple[int, int, int]:
        """What a call answers whose packet came back, where the adapter echoes: else it counts as not sent, and nobody has
        answered it."""
        for _ in range(_MOST_UNSENT):
            answer = self._once(call)
            if answer[1] != COMM_TX_FAIL:
                return answer
        raise HardwareError(
            f"the adapter at {self.port} echoed what it was sent, and does not any more: {_MOST_UNSENT} packets did not come "
            "back. Is the computer too busy? End other programs, plug the adapter in again."
        )

    def _once(self, call: Callable[[], tuple[int, int, int]]) -> tuple[int, int, int]:
        try:
            return call()
        except IndexError:  # the SDK reads past the end of a status packet that is too short
            return 0, COMM_RX_TIMEOUT + 1, 0
        except (OSError, TerminalError) as error:
            raise HardwareError(f"the port {self.port} is gone ({error}).") from error
        finally:
            self._line.is_using = False


def _as_it_may_be(servo: OnTheBus, new: int) -> str:
    """What is known of a servo that could not be given a number and the rate of a chain to the end."""
    by_now = [f"the id {new} by now, or still {servo.number}"] * (new != servo.number)
    by_now += [f"{BAUD} baud by now, or still {servo.baud}"] * (servo.baud != BAUD)
    if not by_now:
        return "Neither its id nor its rate was to be changed: check its cable and the supply, then try again."
    scan = "bns servos scan" + " --all-bauds" * (servo.baud != BAUD)
    return f"The servo may have {'; '.join(by_now)}: switch it off and on, then {scan} tells."


def adapter(port: str, root: Path = Path("/sys/class/tty")) -> Iterator[Finding]:
    """How long the adapter of a port holds answers back, where its driver tells."""
    timer = root / os.path.realpath(port).rpartition("/")[2] / "device" / "latency_timer"
    if timer.exists():
        yield latency_of(port, int(timer.read_text()))

