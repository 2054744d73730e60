"""Who puts the robot back: somebody at the terminal, nobody, or the emulated rig itself."""

from __future__ import annotations

import re
import sys
import time
from collections.abc import Callable, Sequence
from typing import NamedTuple, Protocol

import numpy as np

from bns.errors import TrialPausedError
from bns.hardware.platform import Emulation

_COUNTED = 3
_PLACED_SD = np.array([0.005, 0.005, 0.03])


Spans = Sequence[tuple[float, float]]


class Decision(NamedTuple):
    """What becomes of an evaluation: `next`, `repeat` it, or `skip` it; and which commands (numbers from 1) were unstable."""

    answer: str
    unstable: tuple[int, ...] = ()


class Operator(Protocol):
    """Asked between drives, never during one."""

    wants_picture: bool
    """Whether it helps to see what was driven."""

    def arm(self, what: str) -> None:
        """The robot is about to move for the first time; TrialPausedError if it is not to."""

    def place(self, start: np.ndarray, why: str) -> None:
        """See to it that the robot stands at `start` (3,); TrialPausedError if that cannot be."""

    def accept(self, summary: str, spans_s: Spans) -> Decision:
        """What to do with the evaluation just driven; `spans_s`: when each command was under way that can be unstable."""


def count_down(check: Callable[[], None], sleep: Callable[[float], None] = time.sleep) -> None:
    """Three seconds to step back in; `check` raises if the trial was asked to stop meanwhile."""
    for left in range(_COUNTED, 0, -1):
        print(f"the robot drives in {left}", file=sys.stderr, flush=True)
        sleep(1.0)
        check()


class TerminalOperator:
    """Asks on the terminal. `ask` is `input` but in tests; `check` raises when a signal asked for a pause."""

    wants_picture = True

    def __init__(
        self,
        ask: Callable[[str], str] = input,
        check: Callable[[], None] = lambda: None,
        sleep: Callable[[float], None] = time.sleep,
    ) -> None:
        self._ask, self._check, self._sleep = ask, check, sleep

    def arm(self, what: str) -> None:
        """Ask before the first drive, then count down."""
        self._answer(f"{what}\nStand clear, a hand at its switch; then Enter (p: pause the trial): ", {"": "armed"})
        count_down(self._check, self._sleep)

    def place(self, start: np.ndarray, why: str) -> None:
        """Ask for it, and wait."""
        text = f"{why}.\nPut it at x {start[0]:.2f} m, y {start[1]:.2f} m, heading {np.degrees(start[2]):.0f}°"
        self._answer(f"{text}; then Enter (p: pause the trial): ", {"": "placed"})

    def accept(self, summary: str, spans_s: Spans) -> Decision:
        """Ask what to do."""
        words = {"": "next", "r": "repeat", "s": "skip"}
        asked = f"{summary}\nEnter: keep it; discard it and r: drive it again; s: continue with the next; p: pause"
        if not spans_s:
            return Decision(self._answer(f"{asked}: ", words))
        answer = self._answer(f"{asked}; u: keep it, some cycles were unstable: ", words | {"u": "unstable"})
        return Decision("next", self._unstable(len(spans_s))) if answer == "unstable" else Decision(answer)

    def _unstable(self, count: int) -> tuple[int, ...]:
        while True:
            given = self._asked(
                f"Which of the cycles 1 to {count} (rolled over, links touched, a servo did not follow)? "
            )
            numbers = {int(word) for word in re.findall(r"\d+", given)}
            if numbers and numbers <= set(range(1, count + 1)):
                return tuple(sorted(numbers))
            print(
                f"{given!r} names no cycle, or one that is not there: write numbers from 1 to {count}", file=sys.stderr
            )

    def _asked(self, question: str) -> str:
        try:
            return self._ask(question).strip().lower()
        except EOFError as error:
            self._check()  # a terminal that is closed ends the input, too
            raise TrialPausedError("paused by the operator, whose input has ended (with --yes, nobody is asked)") from error
        except KeyboardInterrupt as error:
            self._check()  # other signals than Ctrl-C end a question as well, and say so
            raise TrialPausedError("paused by the operator") from error

    def _answer(self, question: str, words: dict[str, str]) -> str:
        while True:
            given = self._asked(question)[:1]
            if given == "p":
                raise TrialPausedError("paused by the operator")
            if given in words:
                return words[given]
            print(f"{given!r} is none of: Enter, {', '.join(k for k in (*words, 'p') if k)}", file=sys.stderr)


class UnattendedOperator:
    """With `--yes`: nobody can put the robot back, so the trial pauses where it would have to be."""

    wants_picture = False

    def __init__(self, check: Callable[[], None] = lambda: None, sleep: Callable[[float], None] = time.sleep) -> None:
        self._check, self._sleep = check, sleep

    def arm(self, what: str) -> None:
        """Nobody is asked; whoever is near hears of it in time."""
        print(what, file=sys.stderr)
        count_down(self._check, self._sleep)

    def place(self, start: np.ndarray, why: str) -> None:
        """Pause."""
        also = " With" if why.endswith("?") else ", and with"
        raise TrialPausedError(f"{why}{also} --yes there is no operator to put it back. Do so, then resume with --resume")

    def accept(self, summary: str, spans_s: Spans) -> Decision:
        """Keep everything."""
        return Decision("next")


class EmulatedHands:
    """Puts an emulated robot down, within some millimetres and degrees as hands do; keeps every evaluation,
    and sees what was unstable."""

    wants_picture = False

    def __init__(self, emulation: Emulation, seed: int) -> None:
        self._emulation, self._draw = emulation, np.random.default_rng([seed, 7])

    def arm(self, what: str) -> None:
        """Nobody can be hurt."""

    def place(self, start: np.ndarray, why: str) -> None:
        """Put it down."""
        self._emulation.put_down(start + _PLACED_SD * self._draw.standard_normal(3))

    def accept(self, summary: str, spans_s: Spans) -> Decision:
        """Keep everything, and mark what was seen."""
        observed = (number for number, span_s in enumerate(spans_s, 1) if self._emulation.unstable_between(*span_s))
        return Decision("next", tuple(observed))
