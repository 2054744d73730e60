"""How a robot is stopped, as data: what to write, which answers confirm it. For the guard, which knows no robot."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass

from bns.hardware.servos.ax12_table import AX12
from bns.hardware.servos.bridge_frames import ANSWER, POSITION, START, STARTED_S, STOP, STOPPED, Frame, encoded
from bns.hardware.servos.packets import BROADCAST, READ, WIRES, WRITE
from bns.hardware.servos.servo_table import BAUD, ServoTable


@dataclass(frozen=True)
class StopRecipe:
    """A stop: `steps` are written one after the other, each with a pattern of its answer (None: nobody answers).

    The groups of the patterns are numbers: with `text` in digits, speeds of at most `within`; without, places in two bytes or
    more, low one first, that change by at most `within` from one round to the next. An answer is waited for `wait_s`, twice as
    long after every round without one, up to `longest_s`. `own_stop` finds the order to stop in what the robot's driver writes.
    Nothing is written for `quiet_s` after the port was opened, unless something comes from there.
    """

    baud: int
    steps: Sequence[tuple[bytes, bytes | None]]
    own_stop: bytes
    within: int
    text: bool
    wait_s: float
    longest_s: float
    quiet_s: float = 0.0

    def as_json(self) -> dict[str, object]:
        """For the guard; bytes become text, one letter each."""
        return {
            "baud": self.baud,
            "steps": [(send.decode("latin-1"), reply and reply.decode("latin-1")) for send, reply in self.steps],
            "own_stop": self.own_stop.decode("latin-1"),
            "within": self.within,
            "text": self.text,
            "wait_s": self.wait_s,
            "longest_s": self.longest_s,
            "quiet_s": self.quiet_s,
        }


def khepera_recipe(baud: int, still_units: int) -> StopRecipe:
    """Speeds to zero, and both wheels read back no faster than `still_units`."""
    steps = ((b"D,l0,l0\n", rb"(?:^|\n)d\r?\n"), (b"E\n", rb"(?:^|\n)e,(-?\d{1,6}),(-?\d{1,6})\r?\n"))
    return StopRecipe(baud, steps, rb"D,l0,l0\n", still_units, True, 0.12, 1.0)


def bus_recipe(ids: Sequence[int], table: ServoTable = AX12) -> StopRecipe:
    """Torque off all servos at once; each read back without torque, no joint moved."""
    wire, torque = WIRES[table.protocol], table.registers["torque_enable"]
    order = wire.instruction(BROADCAST, WRITE, torque.address.to_bytes(wire.word, "little") + b"\0")
    asks = [ask for number in ids for ask in (_together(number, table) if table.gapless else _apart(number, table))]
    return StopRecipe(BAUD, ((order, None), *asks), re.escape(order), table.still_steps, False, 0.04, 0.2)


def _together(number: int, table: ServoTable) -> list[tuple[bytes, bytes]]:
    """Torque and place in one answer: error byte, torque (which must be 0), what stands between, the place, checksum."""
    address, size = table.span("torque_enable", "present_position")
    answer = b"\xff\xff" + re.escape(bytes([number, size + 2])) + b"." + b"\x00" + b".{%d}(..)." % (size - 3)
    return [(_read(number, table, address, size), answer)]


def _apart(number: int, table: ServoTable) -> list[tuple[bytes, bytes]]:
    """The torque, which must be 0, then the place. Neither answer is long enough to hold a header that would be stuffed."""
    found = []
    for name, wanted in (("torque_enable", b"\x00"), ("present_position", b"(....)")):
        address, size = table.span(name, name)
        head = b"\xff\xff\xfd\x00" + bytes([number]) + (size + 4).to_bytes(2, "little") + b"\x55"
        found.append((_read(number, table, address, size), re.escape(head) + b"." + wanted + b".."))
    return found


def _read(number: int, table: ServoTable, address: int, size: int) -> bytes:
    wire = WIRES[table.protocol]
    return wire.instruction(number, READ, b"".join(value.to_bytes(wire.word, "little") for value in (address, size)))


def bridge_recipe(baud: int, count: int) -> StopRecipe:
    """The bridge's own stop: it takes the torque off and answers with what it read back."""
    size = STOPPED + POSITION.size * count
    head = re.escape(bytes([START, size, STOP | ANSWER])) + b"."
    answer = head + b"\x00" * STOPPED + b"(..)" * count + b".."
    own = re.escape(bytes([START, 0, STOP]))
    return StopRecipe(baud, ((encoded(Frame(STOP, 0, b"")), answer),), own, AX12.still_steps, False, 0.08, 0.5, STARTED_S)

