"""Commands that a log can hardly mean: none for one of the wheels, or none but zero."""

from __future__ import annotations

import numpy as np
import pandas as pd

from bns.measurements import COMMANDS

NEVER_TOLD = "all commands are 0 in all trials: the robot was never told to move. Are these the columns of the commands?"


def half_told(table: pd.DataFrame) -> tuple[int, str] | None:
    """The first row (from 0) with a command for one wheel only, and what is odd; an empty cell means that none is in force."""
    empty = table[list(COMMANDS)].isna().to_numpy()
    rows = np.flatnonzero(empty[:, 0] != empty[:, 1])
    if not len(rows):
        return None
    lacks = COMMANDS[int(empty[rows[0], 1])]
    return int(rows[0]), (
        f"{len(rows)} rows have a command for one wheel only, the first here ({lacks} is empty); an empty cell means that no "
        "command is in force. Fill both cells, or leave both empty"
    )


def never_told(table: pd.DataFrame) -> tuple[int, str] | None:
    """The first row and what is odd, if no command moves a wheel."""
    moves = (table[list(COMMANDS)].abs() > 0).any(axis=None)
    return None if moves else (int(table.index[0]), NEVER_TOLD)
