"""One long log cut into trials: the diagnosis counts trials, and holds some of them out."""

from __future__ import annotations

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from bns.diagnose.settings import DEFAULTS
from bns.errors import DataError
from bns.measurements import BEFORE, COMMANDS, POSE, RUN_UP, SESSION, SET

STILL_M_S = DEFAULTS.data.still_m_s
KEPT_S = DEFAULTS.data.kept_standing_s
_STAND_S, _GAP_S, PIECE_S = DEFAULTS.data.guess_cuts
RUN_UP_S = DEFAULTS.data.run_up_taken_s


def split(table: pd.DataFrame, by: str, seconds: float) -> pd.DataFrame:
    """The table with a column trial, times since each trial's first row, and the log's own time as ``session_s``.

    ``by``: `standing_s` cuts wherever the robot is told to stand for so long (or told nothing) and leaves out all but the
    `KEPT_S` around a drive; `gap_s` where so long nothing was written; `lasting_s` into pieces of that length, which begin in
    motion and so bring along what was commanded in the seconds before (`RUN_UP_S`), in rows with ``run_up`` 1 and without
    poses. Trials that the log has already are cut each by itself, and the pieces are named by both: 7-0, 7-1; one that remains
    whole keeps its name. DataError where that makes fewer than two trials, or no more than there were.
    """
    missing = [name for name in ("t_s", *COMMANDS) if name not in table.columns]
    if missing and any(str(name).endswith(SET) for name in table.columns):
        raise DataError("A log of joints' set points is not cut into trials: give it a column trial, another value in each.")
    if missing:
        raise DataError(f"To be cut into trials, a log needs {', '.join(missing)}; add entries for them.")
    if "trial" not in table.columns:
        t = table["t_s"].to_numpy(dtype=float)
        return _cut(table if SESSION in table.columns else table.assign(**{SESSION: t - t[0]}), by, seconds)
    if begun := [name for name in (RUN_UP, *BEFORE) if name in table.columns]:
        raise DataError(
            f"{', '.join(begun)}: these columns say how the trials of this log began, not how pieces of them do. Cut the log "
            "that it was made from, or leave the columns out."
        )
    parts, cuts = [table[table["trial"].isna()]], 0  # the checks say that they belong to no trial
    for name, one in table.groupby("trial", sort=False):
        called = f"{name:g}" if isinstance(name, float) else str(name)  # as numbers are where a row has none
        try:
            pieces = _cut(one.drop(columns="trial").reset_index(drop=True), by, seconds, fewest=0)
        except DataError as error:
            raise DataError(f"Trial {called}: {error}") from error
        cut = pieces["trial"].nunique() > 1
        parts.append(pieces.assign(trial=f"{called}-" + pieces["trial"].astype(str) if cut else called))
        cuts += cut
    if not cuts:
        trials = table["trial"].nunique()
        raise DataError(f"trials: {{{by}: {seconds:g}}} cuts none of the {trials} trials of this log; cut finer.")
    return pd.concat([part for part in parts if len(part)], ignore_index=True)


def _cut(table: pd.DataFrame, by: str, seconds: float, fewest: int = 2) -> pd.DataFrame:
    """A table without trials cut into so many at least."""
    t = table["t_s"].to_numpy(dtype=float)
    if not (np.diff(t) >= 0).all():
        row = int(np.flatnonzero(~(np.diff(t) >= 0))[0]) + 1
        raise DataError(
            f"Row {row}: t_s runs backwards or is empty; a log that is cut into trials must be sorted by time. If the time "
            "starts again with every trial, give the log a column trial (in pandas: (log.t_s.diff() < 0).cumsum())."
        )
    trial = _CUTS[by](table, t, seconds)
    if trial.max() + 1 < fewest:
        text = f"trials: {{{by}: {seconds:g}}} cuts this log of {t[-1] - t[0]:.0f} s into fewer than two trials. "
        raise DataError(text + _hint(table, t))
    out = table.assign(trial=trial)
    if by == "lasting_s":
        return _with_run_up(out, t)
    out = out[out["trial"] >= 0]
    return out.assign(t_s=out["t_s"] - out.groupby("trial")["t_s"].transform("first")).reset_index(drop=True)


def _with_run_up(table: pd.DataFrame, t: NDArray[np.float64]) -> pd.DataFrame:
    """Every trial behind the rows of the `RUN_UP_S` before it; t_s is 0 where the trial itself begins."""
    trial, parts = table["trial"].to_numpy(), []
    poses = {name: np.nan for name in POSE if name in table.columns}
    for number in range(int(trial.max()) + 1):
        own = np.flatnonzero(trial == number)
        if not len(own):  # nothing was logged for so long
            continue
        began = t[own[0]]
        ahead = np.flatnonzero((t >= began - RUN_UP_S - 1e-9) & (np.arange(len(t)) < own[0]))
        rows = table.iloc[own].assign(**{RUN_UP: 0})
        if len(ahead):
            rows = pd.concat([table.iloc[ahead].assign(trial=number, **poses, **{RUN_UP: 1}), rows])
        parts.append(rows.assign(t_s=rows["t_s"] - began))
    return pd.concat(parts, ignore_index=True)


def _hint(table: pd.DataFrame, t: NDArray[np.float64]) -> str:
    longest = max((t[b] - t[a] for a, b in _stands(table, t, 0.0)), default=0.0)
    gap = np.diff(t).max(initial=0.0)
    return f"The robot stands for {longest:.2f} s at most, and the longest gap is {gap:.2f} s; lasting_s cuts anywhere."


def _stands(table: pd.DataFrame, t: NDArray[np.float64], seconds: float) -> list[tuple[int, int]]:
    """First row of each standing phase of at least so long, and the row at which it ends: the next drive's first, or the last."""
    still = np.nan_to_num(table[list(COMMANDS)].to_numpy(dtype=float))
    turned = np.diff(np.concatenate([[0], (np.abs(still).max(axis=1) < STILL_M_S).astype(int), [0]]))
    begins, ends = np.flatnonzero(turned > 0), np.minimum(np.flatnonzero(turned < 0), len(t) - 1)
    return [(int(a), int(b)) for a, b in zip(begins, ends, strict=True) if t[b] - t[a] >= seconds - 1e-9]


def _between_stands(table: pd.DataFrame, t: NDArray[np.float64], seconds: float) -> NDArray[np.int64]:
    trial = np.full(len(t), -1)
    stands = _stands(table, t, seconds)
    drives, begin, before_s = [], 0, 0.0
    for a, b in stands:
        kept_s = min(KEPT_S, (t[b] - t[a]) / 2)
        if a > begin:
            drives.append((t[begin] - before_s, t[a] + kept_s))
        begin, before_s = b, kept_s
    if begin < len(t) - 1:
        drives.append((t[begin] - before_s, t[-1]))
    for number, (first, last) in enumerate(drives):
        trial[(t >= first - 1e-9) & (t <= last + 1e-9) & (trial < 0)] = number
    return trial


def _between_gaps(table: pd.DataFrame, t: NDArray[np.float64], seconds: float) -> NDArray[np.int64]:
    return np.cumsum(np.diff(t, prepend=t[0]) > seconds)


def _pieces(table: pd.DataFrame, t: NDArray[np.float64], seconds: float) -> NDArray[np.int64]:
    """Equal pieces; what is left at the end belongs to the last."""
    count = max(int((t[-1] - t[0]) / seconds + 1e-9), 1)
    return np.minimum(((t - t[0]) / seconds + 1e-9).astype(np.int64), count - 1)


_CUTS = {"standing_s": _between_stands, "gap_s": _between_gaps, "lasting_s": _pieces}
"""As `mapping.SPLITS`: (table, times, seconds) -> trial of every row, -1 for rows of none."""


def finer(lasted_s: NDArray[np.float64]) -> str:
    """Advice to cut trials (trials,) that last twice as long as pieces do, or longer, as a sentence behind another; else ""."""
    pieces = int(np.maximum(lasted_s // PIECE_S, 1).sum())
    if pieces < 2 * len(lasted_s) or not len(lasted_s):
        return ""
    return (
        f" These last {lasted_s.mean():.0f} s on average: cut each into pieces (trials: {{lasting_s: {PIECE_S:g}}} in a mapping "
        f"of bns import), and the same drives are {pieces} trials."
    )
