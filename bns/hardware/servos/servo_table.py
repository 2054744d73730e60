"""What tells one model of a Dynamixel servo from another, as data: its registers, its units, what a drive needs of its settings.

Registers that mean the same have the same name in all tables, whatever a model's manual calls them.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import NamedTuple

BAUD = 1_000_000
"""The rate at which chains are driven: a round of twelve servos takes milliseconds."""


class Register(NamedTuple):
    """Address, bytes, value after a reset, highest value, whether it may be written, whether it can be less than nothing."""

    address: int
    size: int
    default: int
    highest: int
    writable: bool = True
    signed: bool = False


@dataclass(frozen=True)
class ServoTable:
    """One model, and the `number` that it answers to a ping. What a register holds stands for SI by the factors here."""

    model: str
    number: int
    protocol: int
    registers: Mapping[str, Register]
    centre: int
    rad_per_step: float
    rad_s_per_step: float
    """Of `moving_speed`."""
    full_torque: int
    """Of `torque_limit` and `present_load`."""
    no_load_rad_s: float
    volts: tuple[float, float]
    """That its makers allow."""
    new_baud: int
    """The rate at which a new one answers."""
    bauds: Mapping[int, int]
    """Rate -> value of `baud_rate`."""
    wanted: Mapping[str, int]
    """Settings that a drive needs; the angle limits may be narrower than these."""
    alarms: Mapping[int, str]
    """Bit -> what a servo says is wrong with it: in the error byte of its packets, or where those only say that there is
    something, in `hardware_error`."""
    needed: tuple[str, ...] = ()
    """Those of the wanted settings without which it must not move."""
    still_steps: int = 1
    """A joint within so many steps (0.3 degrees) of where it was at the last look stands still: readings jump a little."""
    minus_bit: int = 0
    """What makes a signed value negative; 0: two's complement."""
    locked_below: int = 0
    """Registers below this address cannot be written while the torque is on."""
    alarm_bits: int = 0xFF
    """Of an error byte: the servo's own alarms. The rest is a number: why an instruction was refused."""
    refusals: Mapping[int, str] = field(default_factory=dict)
    garbled_bit: int = 0
    """Of an error byte: the packet that the servo received was damaged; 0 where a number says so."""
    garbled_number: int = 0
    """Of a refusal: the same; 0 where a bit says so."""

    def garbled(self, error: int) -> bool:
        """Whether an error byte says that the instruction arrived damaged, so that it should be sent again."""
        return bool(error & self.garbled_bit) or bool(self.garbled_number and error & ~self.alarm_bits == self.garbled_number)

    @property
    def gapless(self) -> bool:
        """Whether there is a register at every address from `torque_enable` to `present_position`."""
        return self.without_gaps("torque_enable", "present_position")

    def without_gaps(self, first: str, last: str) -> bool:
        """Whether there is a register at every address from one to another: reading where there is none is refused."""
        address, size = self.span(first, last)
        held = {r.address + i for r in self.registers.values() for i in range(r.size)}
        return held >= set(range(address, address + size))

    def span(self, first: str, last: str) -> tuple[int, int]:
        """Address and bytes of the registers from one to another."""
        begin, end = self.registers[first], self.registers[last]
        return begin.address, end.address + end.size - begin.address

    def in_block(self, name: str, block: bytes, address: int) -> int:
        """The value of a register in bytes read from this address on."""
        register = self.registers[name]
        at = register.address - address
        return self.value(name, int.from_bytes(block[at : at + register.size], "little"))

    def value(self, name: str, raw: int) -> int:
        """With its sign, where a register has one."""
        register = self.registers[name]
        if not register.signed:
            return raw
        if self.minus_bit:
            return -(raw & ~self.minus_bit) if raw & self.minus_bit else raw
        return raw - (1 << 8 * register.size) if raw >> 8 * register.size - 1 else raw

    def raw(self, name: str, value: int) -> int:
        """As it stands in the register."""
        if value >= 0:
            return value
        return -value | self.minus_bit if self.minus_bit else value + (1 << 8 * self.registers[name].size)

    def in_words(self, bits: int, hardware: int = 0) -> str:
        """What an error byte says, and the register `hardware_error`, where there is one."""
        found = hardware if "hardware_error" in self.registers else bits & self.alarm_bits
        said = [text for bit, text in self.alarms.items() if found & (1 << bit)]
        if refused := bits & ~self.alarm_bits:
            said.append(self.refusals.get(refused, f"error {refused}"))
        return ", ".join(said) or "an alarm that has ended"
