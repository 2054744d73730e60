"""New AX-12 servos made ready for a chain: who is on the bus, an id each, and settings that a drive needs.

New servos are all number 1 and answer at once, over each other; so one at a time is given its number. Registers and what they
mean: the AX-12's manual, control table. The makers' highest voltage is 12 V.
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
from bns.hardware.servos.ax12_table import REGISTERS
from bns.hardware.servos.dynamixel import BAUD
from bns.hardware.servos.dynamixel_port import ClockedPort
from bns.hardware.servos.servo_chain import ServoLimits

with extra("robot"):
    from dynamixel_sdk import COMM_RX_TIMEOUT, COMM_SUCCESS, PacketHandler

BAUDS = (1_000_000, 57_600, 115_200, 500_000, 400_000, 250_000, 200_000, 19_200, 9_600)
"""That a servo can be set to; the first is how it comes, the second how newer kinds come."""
MODELS = {12: "AX-12", 18: "AX-18", 300: "AX-12W"}
_AX12, _LAST_ID = 12, 252
_MOST_DELAY = 25
"""A return delay of 50 µs: above it, a round of twelve servos takes milliseconds longer for nothing."""
_ANSWERS_ALL = 2
_EEPROM_S = 0.02
_REACH = 512 - 307
"""Angle limits of this and its mirror leave 90 degrees to both sides of the middle."""
_WANTED = {"return_delay": 0, "status_return": _ANSWERS_ALL, "cw_angle_limit": 0, "ccw_angle_limit": 1023}


class OnTheBus(NamedTuple):
    """A number at which something answers; `model` is 0 where the answer is garbled, as by two servos of the same number."""

    number: int
    baud: int
    model: int

    def __str__(self) -> str:
        if not self.model:
            return f"id {self.number} at {self.baud} baud: garbled; more than one servo has this id. Connect them one at a time"
        return f"id {self.number} at {self.baud} baud: {MODELS.get(self.model, f'model {self.model}')}"


class ServoBus:
    """A bus opened to set servos up; no other process can have it meanwhile."""

    def __init__(self, port: str, clock: Clock) -> None:
        self.port, self._clock, self._packets = port, clock, PacketHandler(1.0)
        self._line = ClockedPort(port, clock)
        self.at(BAUD)

    def at(self, baud: int) -> None:
        """Go on at this rate; HardwareError if the port cannot be opened or set to it."""
        if not self._line.setBaudRate(baud):
            raise HardwareError(f"{self.port} cannot be set to {baud} baud; another adapter may be needed.")

    def scan(self, bauds: Sequence[int] = (BAUD,), numbers: Sequence[int] | None = None) -> Iterator[OnTheBus]:
        """All that answers, number by number."""
        for baud in bauds:
            self.at(baud)
            for number in range(_LAST_ID + 1) if numbers is None else numbers:
                model, result, _ = self._packets_of(lambda n=number: self._packets.ping(self._line, n))  # type: ignore[misc]
                if result != COMM_RX_TIMEOUT:
                    yield OnTheBus(number, baud, int(model) if result == COMM_SUCCESS else 0)

    def set_id(self, new: int, old: int | None = None) -> OnTheBus:
        """Give the servo on the bus a number; HardwareError unless it is alone there (or alone has the number `old`)."""
        if not 0 <= new <= _LAST_ID:
            raise HardwareError(f"the id {new} is none; ids go from 0 to {_LAST_ID}.")
        there = list(self.scan())
        meant = [servo for servo in there if old is None or servo.number == old]
        if len(meant) != 1 or not meant[0].model:
            listed = "; ".join(str(servo) for servo in there) or "no servo answers"
            which = "Connect one servo alone" if old is None else f"No single servo has the id {old}"
            raise HardwareError(f"{which}: {listed}. Name one of several with --from ID.")
        if any(servo.number == new for servo in there if servo is not meant[0]):
            raise HardwareError(f"another servo on this bus has the id {new}; take a free one, or connect one servo alone.")
        if new != meant[0].number:
            self.write(meant[0].number, "id", new)
        found = list(self.scan(numbers=[new]))
        if len(found) != 1 or not found[0].model:
            raise HardwareError(f"the servo does not answer as {new}; switch it off and on, then: bns servos scan")
        return found[0]

    def check(self, number: int, limits: ServoLimits) -> Iterator[Finding]:
        """What of a servo's settings is not as a drive needs it."""
        values = {name: self.read(number, name) for name in (*_WANTED, "model_number", "present_voltage", "alarm_shutdown")}
        model = MODELS.get(values["model_number"], str(values["model_number"]))
        yield Finding(values["model_number"] == _AX12, f"servo {number} is a {model}", "" if model == "AX-12" else "replace it")
        mend = f"bns servos check --fix --port {self.port}"
        yield _fit(number, "return delay", 2 * values["return_delay"], "µs", values["return_delay"] <= _MOST_DELAY, mend)
        yield _fit(number, "status return level", values["status_return"], "", values["status_return"] == _ANSWERS_ALL, mend)
        low, high = values["cw_angle_limit"], values["ccw_angle_limit"]
        wide = low <= _REACH and high >= 1023 - _REACH
        yield Finding(wide, f"servo {number}: angle limits {low} to {high}", "" if wide else f"90° to both sides: {mend}")
        volts = values["present_voltage"] / 10
        fed = limits.low_v <= volts <= limits.high_v
        supply = f"a supply of {limits.low_v:g} to {limits.high_v:g} V; the makers allow 12 V"
        yield Finding(fed, f"servo {number}: {volts:.1f} V", "" if fed else supply)

    def mend(self, number: int) -> list[str]:
        """Write the settings that a drive needs, read them back; names of those that were changed."""
        changed = []
        # What it confirms goes first, so that the others are confirmed.
        for name in ("status_return", *(n for n in _WANTED if n != "status_return")):
            if self.read(number, name) != _WANTED[name]:
                self.write(number, name, _WANTED[name])
                changed.append(name)
        return changed

    def read(self, number: int, name: str) -> int:
        """A register of one servo; HardwareError if it does not answer."""
        register = REGISTERS[name]
        call = self._packets.read1ByteTxRx if register.size == 1 else self._packets.read2ByteTxRx
        value, result, _ = self._packets_of(lambda: call(self._line, number, register.address))
        if result != COMM_SUCCESS:
            raise HardwareError(f"servo {number} does not answer ({self._packets.getTxRxResult(result)}); check its cable.")
        return int(value)

    def write(self, number: int, name: str, value: int) -> None:
        """Write a register and read it back: whether a servo confirms a write depends on what is being set."""
        register = REGISTERS[name]
        call = self._packets.write1ByteTxRx if register.size == 1 else self._packets.write2ByteTxRx
        self._packets_of(lambda: (0, *call(self._line, number, register.address, value)), attempts=1)
        self._clock.sleep(_EEPROM_S)
        now = value if name == "id" else number
        if (found := self.read(now, name)) != value:
            raise HardwareError(f"servo {number}: {name} is {found} after {value} was written; switch it off and on.")

    def close(self) -> None:
        """Give the port free."""
        if self._line.is_open:
            self._line.closePort()

    def _packets_of(self, call: Callable[[], tuple[int, int, int]], attempts: int = 2) -> tuple[int, int, int]:
        answer = (0, COMM_RX_TIMEOUT, 0)
        for _ in range(attempts):
            try:
                answer = call()
            except IndexError:  # the SDK reads past the end of a status packet that is too short
                answer = (0, COMM_RX_TIMEOUT + 1, 0)
            except (OSError, TerminalError) as error:
                raise HardwareError(f"the port {self.port} is gone ({error}).") from error
            finally:
                self._line.is_using = False
            if answer[1] == COMM_SUCCESS:
                break
        return answer


def adapter(port: str, root: Path = Path("/sys/class/tty")) -> Iterator[Finding]:
    """How long the adapter of a port holds answers back, where its driver tells."""
    timer = root / os.path.realpath(port).rpartition("/")[2] / "device" / "latency_timer"
    if timer.exists():
        yield latency_of(port, int(timer.read_text()))


def _fit(number: int, what: str, value: int, unit: str, good: bool, mend: str) -> Finding:
    return Finding(good, f"servo {number}: {what} {value}{f' {unit}' if unit else ''}", "" if good else mend)
