"""Messages, a datagram each: a number that the answer repeats, a word, two numbers.

    17 drive 250 200      speeds of the wheels, mm/s           -> 17 ok 250 200 (as they were set)
    18 speed              what the wheels do, mm/s             -> 18 speed 248 199
    19 ways               ways of the wheels, mm               -> 19 ways 1201 1180
    20 battery            millivolts                           -> 20 battery 11100 0
"""

from __future__ import annotations

from typing import NamedTuple

WATCHDOG_S = 0.5
"""A robot that hears nothing for so long stops by itself."""
FASTEST_MM_S = 500


class Message(NamedTuple):
    """What goes either way."""

    number: int
    word: str
    left: float = 0.0
    right: float = 0.0

    def encoded(self) -> bytes:
        """As a datagram."""
        return f"{self.number} {self.word} {self.left:.3f} {self.right:.3f}".encode()


def decoded(data: bytes) -> Message | None:
    """A datagram's message; None if it is none."""
    try:
        number, word, left, right = data.decode("ascii").split()
        return Message(int(number), word, float(left), float(right))
    except ValueError:
        return None
