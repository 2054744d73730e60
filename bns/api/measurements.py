"""`bns.Measurements`: what was commanded and where the robot was, from files or tables, checked."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from copy import copy
from functools import cached_property
from os import PathLike
from pathlib import Path
from typing import Any, Union

import numpy as np
import pandas as pd
from matplotlib.axes import Axes

from bns.api.common.shown import Shown, drawn
from bns.diagnose.data.apply_mapping import applied
from bns.diagnose.data.cycles import CycleTracks
from bns.diagnose.data.load import Measured, load_measured, measured_table, table_sha256
from bns.diagnose.data.mapping import checked_mapping, load_mapping
from bns.diagnose.data.sources.read import read_table
from bns.diagnose.predict.check_robot import suggested_wheelbase_m
from bns.diagnose.report.text import findings_text
from bns.errors import DataError
from bns.plotting.style import OKABE_ITO

Log = Union[str, PathLike[str], pd.DataFrame, "Measurements", Sequence[str | PathLike[str]]]
"""A file (.csv, .csv.gz, .parquet), several, a table, or measurements already read."""
Rules = Mapping[str, Any] | str | PathLike[str]
"""A mapping of columns and units, or its file."""
_TABLE = Path("table")
"""What a table that came from no file is called."""


class Measurements(Shown):
    """Checked measurements of one robot.

    ``log`` is a file, a table (`pandas.DataFrame`) or a list of files, whose trials are taken together. Columns and units are
    those of docs/logs.md: trial, t_s (s), left_m_s, right_m_s (m/s, wheel surface), x_m, y_m (m), heading_rad (rad,
    counter-clockwise from x); or the cycles and markers of a snake.

    Args:
        robot: whose rows, where a column ``robot`` names several.
        mapping: how other columns and units are to be read: a dictionary or the path of a mapping file (docs/logs.md). A file
            with FILE.import.yaml beside it needs none.

    Raises:
        DataError: what cannot be used; the message says what to do.
    """

    def __init__(
        self, log: Log, *more: str | PathLike[str], robot: str | None = None, mapping: Rules | None = None
    ) -> None:
        self._measured = _read(log, more, robot, mapping)

    @property
    def frame(self) -> pd.DataFrame:
        """A copy of the table: a row a tracked pose, in SI units; rows that the checks leave out included."""
        return self._measured.table.copy()

    @cached_property
    def trials(self) -> pd.DataFrame:
        """A row a trial, in order: trial (its name), poses and, on wheels, commands (how many of each), duration_s (s)."""
        tracks = self._measured.tracks
        table = pd.DataFrame({"trial": tracks.names, "poses": np.diff(tracks.first)})
        if not isinstance(tracks, CycleTracks):
            lasts = tracks.duration_s
            lead = 0.0 if tracks.lead_s is None else tracks.lead_s
            table["commands"], table["duration_s"] = (lasts > 0).sum(axis=1), lasts.sum(axis=1) - lead
        return table

    @property
    def findings(self) -> pd.DataFrame:
        """What was odd: trial, row (of the table, from 0), text (what, and what was done about it)."""
        return pd.DataFrame([vars(each) for each in self._measured.findings], columns=["trial", "row", "text"])

    @property
    def robot(self) -> str:
        """What a column ``robot`` says; "" where there is none."""
        return self._measured.robot

    @property
    def name(self) -> str:
        """Of the (first) file; ``table`` for a table."""
        return self._measured.path.name

    @property
    def measured(self) -> Measured:
        """The same for the library's own functions: tracks as arrays, findings, digest."""
        return self._measured

    def without(self, trials: Iterable[str]) -> Measurements:
        """The same measurements without some trials, by their names. DataError if there is no such trial, or none is left."""
        left_out, table = set(map(str, trials)), self._measured.table
        of = table["trial"].astype(str)
        unknown = sorted(left_out - set(of))
        if unknown:
            raise DataError(f"There is no trial {', '.join(unknown)}; there are {', '.join(dict.fromkeys(of))}.")
        if not left_out:
            return self
        if set(of) <= left_out:
            raise DataError("All trials are left out; keep at least one.")
        fewer = copy(self)
        fewer.__dict__ = {"_measured": measured_table(table[~of.isin(left_out)], self._measured.path)}
        return fewer

    @cached_property
    def suggested_wheelbase_m(self) -> float | None:
        """The distance of the wheels (m) with which a plain drive turns as this robot did; None where nothing tells."""
        tracks = self._measured.tracks
        return None if isinstance(tracks, CycleTracks) else suggested_wheelbase_m(tracks)

    @cached_property
    def sha256(self) -> str:
        """Of the table's values (64 digits): the same from .csv, .parquet or memory."""
        return table_sha256(self._measured.table)

    def __len__(self) -> int:
        """How many trials."""
        return len(self._measured.tracks)

    def summary(self) -> str:
        """How much there is, and what is odd about it."""
        return f"{self._line()}\n{findings_text(self._measured.findings)}"

    def _line(self) -> str:
        poses, odd = int(self.trials["poses"].sum()), len(self._measured.findings)
        return f"{self.name}, {len(self)} trials, {poses} poses, {odd} finding{'' if odd == 1 else 's'}"

    def plot_paths(self, ax: Axes | None = None, trials: Iterable[int] | None = None) -> Axes:
        """Where the robot went, a line a trial, m; ``trials``: which, by their number from 0 (default: all)."""
        tracks = self._measured.tracks
        chosen = range(len(tracks)) if trials is None else trials

        def draw(axes: Axes) -> None:
            for number, trial in enumerate(chosen):
                pose = tracks.pose[tracks.first[trial] : tracks.first[trial + 1]]
                axes.plot(pose[:, 0], pose[:, 1], color=OKABE_ITO[number % len(OKABE_ITO)], linewidth=0.8)
                axes.plot(pose[:1, 0], pose[:1, 1], "k^", markersize=3)
            axes.set(aspect="equal", xlabel="x, east (m)", ylabel="y, north (m)", title=f"{self.name}: measured paths")

        return drawn(ax, draw)


def as_measurements(log: Log) -> Measurements:
    """Measurements as they are, or read."""
    return log if isinstance(log, Measurements) else Measurements(log)


def _read(log: Log, more: tuple[str | PathLike[str], ...], robot: str | None, mapping: Rules | None) -> Measured:
    if isinstance(log, Measurements):
        if more or robot or mapping:
            raise DataError(
                "These measurements are read already; give the files themselves to choose a robot or a mapping."
            )
        return log.measured
    if isinstance(log, pd.DataFrame):
        if more:
            raise DataError(
                "A table and files cannot be taken together; join them with pandas.concat, or give files only."
            )
        return measured_table(_mapped(log, mapping, Path()), _TABLE, robot=robot)
    files = [Path(each) for each in ([log] if isinstance(log, str | PathLike) else log)] + [Path(each) for each in more]
    if not files:
        raise DataError("No file is given; give at least one .csv or .parquet file of measurements.")
    if mapping is None:
        return load_measured(files[0], robot, files[1:])
    if len(files) > 1:
        raise DataError("A mapping is of one file; lay FILE.import.yaml beside each of several.")
    return measured_table(_mapped(read_table(files[0]), mapping, files[0].parent), files[0], robot=robot)


def _mapped(table: pd.DataFrame, mapping: Rules | None, folder: Path) -> pd.DataFrame:
    if mapping is None:
        return table
    rules = (
        checked_mapping(dict(mapping), Path("mapping")) if isinstance(mapping, Mapping) else load_mapping(Path(mapping))
    )
    return applied(table, rules, folder, read_table)
