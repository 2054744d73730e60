"""Commands that a log can hardly mean: none for one of the wheels, or none but zero."""

from __future__ import annotations

import shlex
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import pandas as pd

from bns.diagnose.data.spread import drifts, moved
from bns.diagnose.settings import DEFAULTS
from bns.errors import DataError, in_both
from bns.measurements import COMMANDS, POSE

_MOMENT_S, _ALIKE, _LEAST = DEFAULTS.data.lost_commands
_FEWEST = DEFAULTS.data.lost_commands_fewest
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


def untold_begins(table: pd.DataFrame, trials: Sequence[tuple[str, np.ndarray]]) -> list[tuple[str, np.ndarray, str]]:
    """Of trials in which the robot moves before their first command: name, numbers of the rows before it, and what is odd."""
    told = table[list(COMMANDS)].notna().any(axis=1).to_numpy()
    times, poses, found = table["t_s"].to_numpy(float), table[list(POSE)].to_numpy(float), []
    for name, rows in trials:
        before = rows[: int(np.argmax(told[rows]))] if len(rows) and told[rows].any() else rows[:0]
        if drifts(poses[before]):
            lasted = f"{times[rows[len(before)]] - times[before[0]]:.2f} s ({len(before)} rows)"
            said = f"the robot moves in the {lasted} before the first command: left out, since nobody knows why"
            found.append((name, before, said))
    return found


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


def lost_commands(table: pd.DataFrame, trials: Sequence[tuple[str, np.ndarray]]) -> tuple[int, str] | None:
    """The first row of a command 0 that stands for a moment between two that are alike, how often, and how much way it takes.

    ``trials``: names and row numbers. No motor follows so short a command; a program that writes 0 beside its speeds, or a log
    that lost some, leaves such rows, and the robot then goes further than it seems to have been told to.
    """
    lost, share = _lost(table, [rows for _, rows in trials])
    if not lost:
        return None
    lasted = [one.held_s for one in lost]
    return int(table.index[lost[0].rows[0]]), (
        f"{len(lost)} times both commands are 0 for {1e3 * min(lasted):.0f} to {1e3 * max(lasted):.0f} ms between two that are "
        f"alike, the first time here: {share:.1%} of the way. No motor follows that. If the robot was "
        "not told so (a sender that writes 0 beside its speeds, a log with losses), it seems to go that much too far: "
        "`lost_commands: held` in the mapping of `bns import` puts the command before in their place"
    )


def count_lost(table: pd.DataFrame, trials: Sequence[np.ndarray]) -> int:
    """How many commands `lost_commands` would tell; 0 if there are too few. ``trials``: row numbers, in the order of time."""
    return len(_lost(table, trials)[0])


def with_commands_held(table: pd.DataFrame, trials: Sequence[np.ndarray]) -> pd.DataFrame:
    """The table with the command before in place of each command 0 that `lost_commands` would tell. ``trials``: row numbers."""
    commands = table[list(COMMANDS)].to_numpy(float, copy=True)
    for one in _lost(table, trials)[0]:
        commands[one.rows] = one.before
    return table.assign(**{name: commands[:, number] for number, name in enumerate(COMMANDS)})


@dataclass(frozen=True)
class _Lost:
    """A moment without a command: its rows (numbers), how long it lasts, and the command before it (both wheels, m/s)."""

    rows: np.ndarray
    held_s: float
    before: np.ndarray

    @property
    def speed_m_s(self) -> float:
        """Of the faster wheel."""
        return float(np.abs(self.before).max())


def _lost(table: pd.DataFrame, trials: Sequence[np.ndarray]) -> tuple[list[_Lost], float]:
    """Moments without a command in trials, which are given by their rows' numbers, and the share of the way that they take.

    None where they are few, or take hardly any way: speeds that were measured are 0 where a wheel turns back.
    """
    of_trial = np.repeat(np.arange(len(trials)), [len(rows) for rows in trials])
    at = np.concatenate([np.zeros(0, int), *trials])
    commands = np.full((len(table), 2), np.nan)
    commands[at] = table[list(COMMANDS)].iloc[at].groupby(of_trial).ffill().to_numpy(float)
    times = table["t_s"].to_numpy(float)
    found, told_m = list[_Lost](), 0.0
    for rows in trials:
        told, t = commands[rows], times[rows]
        begins = np.flatnonzero(np.r_[True, (told[1:] != told[:-1]).any(axis=1)]) if len(told) else np.zeros(0, int)
        held_s = np.diff(np.r_[t[begins], t[-1:]])
        speed = np.abs(told[begins]).max(axis=1, initial=0.0)
        told_m += float(np.nansum(speed * held_s))
        inner = np.arange(1, len(begins) - 1)
        before, after = told[begins[inner - 1]], told[begins[inner + 1]]
        alike = (np.abs(after - before) <= _ALIKE * np.abs(before).max(axis=1, keepdims=True, initial=0.0)).all(axis=1)
        lost = inner[(speed[inner] == 0) & (speed[inner - 1] > 0) & alike & (held_s[inner] <= _MOMENT_S)]
        found += [_Lost(rows[begins[i] : begins[i + 1]], float(held_s[i]), told[begins[i - 1]]) for i in lost]
    lacking_m = sum(one.held_s * one.speed_m_s for one in found)
    share = lacking_m / (told_m + lacking_m) if found else 0.0
    return (found, share) if len(found) >= _FEWEST and share >= _LEAST else ([], 0.0)


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
