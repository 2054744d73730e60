"""Who puts the robot back: somebody at the terminal, nobody, or the emulated rig itself."""

from __future__ import annotations

import sys
from collections.abc import Callable
from typing import Protocol

import numpy as np

from bns.errors import TrialPausedError
from bns.hardware.platform import Emulation

_PLACED_SD = np.array([0.005, 0.005, 0.03])


class Operator(Protocol):
    """Asked between drives, never during one."""

    def place(self, start: np.ndarray, why: str) -> None:
        """See to it that the robot stands at `start` (3,); TrialPausedError if that cannot be."""

    def accept(self, summary: str) -> str:
        """What to do with the evaluation just driven: `next`, `repeat` it, or `skip` it."""


class AtTheTerminal:
    """Asks on the terminal. `ask` is `input` but in tests."""

    def __init__(self, ask: Callable[[str], str] = input) -> None:
        self._ask = ask

    def place(self, start: np.ndarray, why: str) -> None:
        """Ask for it, and wait."""
        text = f"{why}.\nPut it at x {start[0]:.2f} m, y {start[1]:.2f} m, heading {np.degrees(start[2]):.0f}°"
        self._answer(f"{text}; then Enter (p: pause the trial): ", {"": "placed"})

    def accept(self, summary: str) -> str:
        """Ask what to do."""
        words = {"": "next", "r": "repeat", "s": "skip"}
        return self._answer(f"{summary}\nEnter: keep it; r: drive it again; s: skip it; p: pause the trial: ", words)

    def _answer(self, question: str, words: dict[str, str]) -> str:
        while True:
            try:
                given = self._ask(question).strip().lower()[:1]
            except (EOFError, KeyboardInterrupt) as error:
                raise TrialPausedError("paused by the operator") from error
            if given == "p":
                raise TrialPausedError("paused by the operator")
            if given in words:
                return words[given]
            print(f"{given!r} is none of: Enter, {', '.join(k for k in (*words, 'p') if k)}", file=sys.stderr)


class Nobody:
    """With `--yes`: nobody can put the robot back, so the trial pauses where it would have to be."""

    def place(self, start: np.ndarray, why: str) -> None:
        """Pause."""
        raise TrialPausedError(f"{why}, and with --yes nobody can put it back. Do so, then go on with --resume")

    def accept(self, summary: str) -> str:
        """Keep everything."""
        return "next"


class EmulatedHands:
    """Puts an emulated robot down, within some millimetres and degrees as hands do; keeps every evaluation."""

    def __init__(self, emulation: Emulation, seed: int) -> None:
        self._emulation, self._draw = emulation, np.random.default_rng([seed, 7])

    def place(self, start: np.ndarray, why: str) -> None:
        """Put it down."""
        self._emulation.put_down(start + _PLACED_SD * self._draw.standard_normal(3))

    def accept(self, summary: str) -> str:
        """Keep everything."""
        return "next"
