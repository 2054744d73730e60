"""Logs of single relative motions (scan matching, increments of odometry): each row a trial of two poses.

The first pose is zero, the second the displacement as the sensor measured it in its own frame. What the wheels did is their
mean speed, from the way that encoders counted. Such motions have no place, no start from rest and no time between them.
"""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pandas as pd

from bns.diagnose.data.mapping import DURATION, WAYS
from bns.errors import DataError
from bns.measurements import COMMANDS, POSE


def relative_motions(table: pd.DataFrame) -> pd.DataFrame:
    """Two rows for each row of ``table``, which has duration_s, the wheels' mean speeds and x_m, y_m, heading_rad.

    left_m and right_m, the ways of the wheels, may stand for their speeds. Further columns stand in both. Rows that lasted
    no time or lack a number are left out. DataError where a column is missing or no row is left.
    """
    ways = {
        c: table[way] / table[DURATION] for c, way in zip(COMMANDS, WAYS, strict=True) if {way, DURATION} <= set(table)
    }
    rows = table.drop(columns=[way for way in WAYS if way in table]).assign(**ways)
    wanted = [DURATION, *COMMANDS, *POSE]
    missing = [name for name in wanted if name not in rows.columns]
    if missing:
        raise DataError(
            f"Relative motions need entries for {', '.join(wanted)} (or {' and '.join(WAYS)}, the distances of the wheels, "
            f"instead of their speeds); the mapping lacks {', '.join(missing)}."
        )
    good = np.isfinite(rows[wanted].to_numpy(dtype=float)).all(axis=1) & (rows[DURATION] > 0).to_numpy()
    if not good.any():
        raise DataError(f"No row has a {DURATION} above 0 and all numbers of a motion.")
    ended = rows[good].rename(columns={DURATION: "t_s"}).reset_index(drop=True)
    ended["trial"] = np.arange(len(ended))
    began = ended.assign(t_s=0.0, **dict.fromkeys(POSE, 0.0))
    return pd.concat([began, ended]).sort_values(["trial", "t_s"], kind="stable", ignore_index=True)


def read_json_lines(path: Path) -> pd.DataFrame:
    """One JSON object a line; a list of numbers becomes columns NAME_0, NAME_1, ... DataError names a line that does not read."""
    rows = []
    for number, line in enumerate(path.read_text(encoding="utf-8").splitlines(), start=1):
        if not line.strip():
            continue
        try:
            rows.append(_flat(json.loads(line)))
        except ValueError as fault:
            raise DataError(f"{path}, line {number}, is no JSON object: {fault}. Write one object a line.") from fault
    return pd.DataFrame(rows)


def _flat(row: object) -> dict[str, object]:
    if not isinstance(row, dict):
        raise ValueError(f"it is {row!r}")  # noqa: TRY004  # of the file's text, as json's own
    out: dict[str, object] = {}
    for name, value in row.items():
        out |= {f"{name}_{i}": v for i, v in enumerate(value)} if isinstance(value, list) else {name: value}
    return out
