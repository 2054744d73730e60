"""What the first paths of a log look like under a mapping, before it is taken: as `bns import` would read them."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pandas as pd

from bns.app.log.roles import Mapped
from bns.diagnose.data.apply_mapping import applied
from bns.diagnose.data.checks import checked, rows_by_trial
from bns.diagnose.data.guess.mapping import lacking
from bns.diagnose.data.mapping import checked_mapping
from bns.diagnose.data.sources.read import read_table
from bns.diagnose.data.tracks import Array
from bns.errors import DataError
from bns.measurements import COLUMNS, POSE

MOST_ROWS = 30_000
"""Of the log's beginning; a preview follows every choice at once."""
MOST_TRIALS = 6


@dataclass(frozen=True)
class Preview:
    """Poses (frames, 3) of the first trials, their names, and what stands against reading the log so ("" for nothing)."""

    paths: tuple[Array, ...]
    names: tuple[str, ...]
    problem: str
    said: str

    def __bool__(self) -> bool:
        """Can the log be read so, as far as its beginning tells?"""
        return not self.problem


def preview(tables: Mapping[str, pd.DataFrame], mapping: Mapped, folder: Path = Path()) -> Preview:
    """``tables``: files by name, the first is ""; ``mapping``: as menus or a user wrote it, perhaps with a mistake.

    ``folder``: where files are that the mapping names and nobody has read yet.
    """
    whole = tables[""]

    def read(path: Path) -> pd.DataFrame:
        return tables[path.name] if path.name in tables else read_table(path)

    try:
        rules = checked_mapping(mapping)
        table = applied(whole.iloc[:MOST_ROWS], rules, folder, read)
    except DataError as fault:
        if "trials" in mapping:  # what cannot be cut can be drawn in one
            uncut = preview(tables, {key: value for key, value in mapping.items() if key != "trials"}, folder)
            return Preview(uncut.paths, uncut.names, str(fault), "")
        return Preview((), (), str(fault), "")
    missing = " ".join(lacking(rules)) if not set(COLUMNS) <= set(table.columns) else ""
    if missing:
        return Preview(*_drawn(table), missing, "")
    try:
        usable, findings = checked(table)
    except DataError as fault:  # what a wrong unit makes of the paths says more than the message
        return Preview(*_drawn(table), str(fault), "")
    part = f"the first {MOST_ROWS} of {len(whole)} rows" if len(whole) > MOST_ROWS else f"{len(whole)} rows"
    seen = int(usable[list(POSE)].notna().all(axis=1).sum())
    said = f"{part}: {usable['trial'].nunique()} trials, {seen} poses, {len(findings)} findings"
    return Preview(*_drawn(usable), "", said)


def _drawn(table: pd.DataFrame) -> tuple[tuple[Array, ...], tuple[str, ...]]:
    """Paths of the first trials; none where a place cannot be told."""
    if not {"x_m", "y_m"} <= set(table.columns):
        return (), ()
    places = table[["x_m", "y_m"]].apply(pd.to_numeric, errors="coerce").to_numpy(dtype=float)
    trials = rows_by_trial(table)[:MOST_TRIALS] if "trial" in table.columns else []
    found = [(name, places[at][np.isfinite(places[at]).all(axis=1)]) for name, at in trials]
    kept = [(name, path) for name, path in found if len(path)]
    return tuple(path for _, path in kept), tuple(name for name, _ in kept)
