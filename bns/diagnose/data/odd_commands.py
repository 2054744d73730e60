"""Commands that a log can hardly mean: none for one of the wheels, or none but zero."""

from __future__ import annotations

import shlex
from collections.abc import Sequence

import numpy as np
import pandas as pd

from bns.diagnose.data.spread import moved
from bns.errors import DataError, in_both
from bns.measurements import COMMANDS

NEVER_TOLD = "all commands are 0 in all trials: the robot was never told to move. Are these the columns of the commands?"
_WRITE = "Are these the columns of the commands? A log needs the speed of both wheels, or of the body, where it changes."


def half_told(table: pd.DataFrame) -> tuple[int, str] | None:
    """The first row (from 0) with a command for one wheel only, and what is odd; an empty cell means that none is in force."""
    empty = table[list(COMMANDS)].isna().to_numpy()
    rows = np.flatnonzero(empty[:, 0] != empty[:, 1])
    if not len(rows):
        return None
    lacks = COMMANDS[int(empty[rows[0], 1])]
    return int(rows[0]), (
        f"{len(rows)} rows have a command for one wheel only, the first here ({lacks} is empty); an empty cell means that no "
        "command is in force, and such a wheel counts as told to stand. Fill both cells, or leave both empty"
    )


def untold_trials(table: pd.DataFrame, trials: Sequence[tuple[str, np.ndarray]]) -> tuple[int, str] | None:
    """The first row of trials that hold no command at all, what is done with them and how to leave them out.

    ``trials``: names and row numbers.
    """
    told = table[list(COMMANDS)].notna().any(axis=1).to_numpy()
    empty = [(name, rows) for name, rows in trials if len(rows) and not told[rows].any()]
    if not empty or len(empty) == len(trials):
        return None
    moving = [name for name, rows in empty if moved(table, [(name, rows)])]
    many = f"{len(empty)} trials hold" if len(empty) > 1 else "this trial holds"
    said = f"{many} no command from beginning to end, and the robot counts as told to stand in all that time"
    if not moving:
        return int(table.index[empty[0][1][0]]), f"{said}. It does stand: the poses are used for the noise of the tracker"
    named = moving[:5]
    typed = shlex.join(word for name in named for word in ("--without", name))
    rest = f", and so on for {len(moving) - len(named)} more" if len(moving) > len(named) else ""
    return int(table.index[empty[0][1][0]]), (
        f"{said}. {'But' if len(empty) == 1 else f'In {len(moving)} of them'} it moves, which counts as an error of every model "
        f"and in every fit. If the commands were not logged, leave {'it' if len(moving) == 1 else 'them'} out: "
        f"{in_both(typed, f'log.without({named})')}{rest}"
    )


def never_told(table: pd.DataFrame) -> tuple[int, str] | None:
    """The first row and what is odd, if no command moves a wheel."""
    moves = (table[list(COMMANDS)].abs() > 0).any(axis=None)
    return None if moves else (int(table.index[0]), NEVER_TOLD)


def refuse_untold(table: pd.DataFrame, trials: Sequence[tuple[str, np.ndarray]]) -> None:
    """DataError if no command is ever in force, or if all are 0 and the robot moves. ``trials``: names and row numbers."""
    told = table[list(COMMANDS)].notna()
    empty = [name for name in COMMANDS if not told[name].any()]
    if empty:
        columns = f"{' and '.join(empty)} {'is' if len(empty) == 1 else 'are'}"
        raise DataError(f"{columns} empty in all rows: no command is ever in force. {_WRITE}")
    if not told.all(axis=1).any():
        raise DataError(
            f"No row has a value in both {COMMANDS[0]} and {COMMANDS[1]}: no command is ever in force. Fill both cells where "
            "one changes; `hold_commands_s: .inf` in the mapping of `bns import` keeps each until the next."
        )
    if never_told(table) and moved(table, trials):
        raise DataError(f"All values of {COMMANDS[0]} and {COMMANDS[1]} are 0, but the robot moves. {_WRITE}")
