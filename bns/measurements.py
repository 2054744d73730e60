"""The table of what was commanded and where the robot was; simulated or real, never told apart.

One row a tracked pose. The command columns hold what is in force from this row's time on, and are empty where
no command is. Further columns are kept. A robot without wheels has columns of its own (`bns/robots/ROBOT`).
"""

from __future__ import annotations

import os
from collections.abc import Sequence
from contextlib import suppress
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike

from bns.errors import ModelError
from bns.targets import obstacle

if TYPE_CHECKING:  # half a second to load, and a run needs no table
    import pandas as pd

COMMANDS = ("left_m_s", "right_m_s")
SET = "_set_rad"
"""How the columns of joints' set points end."""
POSE = ("x_m", "y_m", "heading_rad")
SESSION = "session_s"
"""Time since the session began, where it was logged."""
BEFORE = ("before_left_m_s", "before_right_m_s")
"""Wheel speeds before the trial's first row, where it began in motion; the trial's first value counts, none is rest."""
DISCARDED = "discarded"
"""1 of a drive that whoever watched it did not keep; it is judged by nobody."""
RUN_UP = "run_up"
"""1 in rows that a trial takes along from before it begins: they hold commands and no poses, and their t_s is below 0."""
LEFT_OUT = "left_out"
"""1 in rows whose pose takes no part: their commands stay in force, and nothing is judged across them."""
COLUMNS = ("trial", "t_s", *COMMANDS, *POSE)
"""A robot on two wheels. trial: number; t_s: since the trial began; wheel-surface speeds; heading counter-clockwise from x."""


def trial_table(trial: int, commands: ArrayLike, poses: ArrayLike) -> pd.DataFrame:
    """Rows of one trial with the columns `COLUMNS`.

    ``commands`` (n, 3): left_m_s, right_m_s, duration_s, back to back. ``poses`` (n + 1, 3): x_m, y_m,
    heading_rad at the start and at the end of every command. ModelError if the shapes do not fit.
    """
    given, tracked = np.asarray(commands, dtype=np.float64), np.asarray(poses, dtype=np.float64)
    if given.ndim != 2 or given.shape[1] != 3 or tracked.shape != (len(given) + 1, 3):
        raise ModelError(
            f"trial {trial}: commands have the shape {given.shape} and poses {tracked.shape}; "
            "give (n, 3) commands and (n + 1, 3) poses, the first at the start."
        )
    speeds = np.vstack([given[:, :2], [[np.nan, np.nan]]])
    times = np.concatenate([[0.0], np.cumsum(given[:, 2])])
    numbers = np.column_stack([times, speeds, tracked])
    import pandas as pd  # noqa: PLC0415  # as above

    table = pd.DataFrame(numbers, columns=list(COLUMNS[1:]))
    table.insert(0, "trial", trial)
    return table


def check_table_name(path: Path) -> None:
    """ModelError unless a table can be written there."""
    if path.suffix not in {".csv", ".parquet"}:
        raise ModelError(f"Measurements cannot be written to {path}; the name must end in .csv or .parquet.")
    if found := obstacle(path):
        raise ModelError(f"Measurements cannot be written to {path}: {found}; choose another place.")


def write_measurements(table: pd.DataFrame, path: str | Path, columns: Sequence[str] = COLUMNS) -> None:
    """Write a table as .csv or .parquet; a reader never meets half a file.

    `columns` are those that it must have. ModelError if one is missing or the name ends otherwise.
    """
    path = Path(path)
    missing = [name for name in columns if name not in table.columns]
    if missing:
        raise ModelError(
            f"A table of measurements for {path} lacks {', '.join(missing)}; it needs {', '.join(columns)}."
        )
    check_table_name(path)
    unfinished = path.with_name(f".{path.name}.{os.getpid()}.part")
    try:
        if path.suffix == ".csv":
            table.to_csv(unfinished, index=False)
        else:
            table.to_parquet(unfinished, index=False)
        unfinished.replace(path)
    except BaseException as error:  # a part of a table would take the space that is missing
        with suppress(OSError):
            unfinished.unlink(missing_ok=True)
        if isinstance(error, OSError) and error.errno is not None:  # with the name that was given, not the unfinished file's
            raise OSError(error.errno, os.strerror(error.errno), str(path)) from error
        raise
