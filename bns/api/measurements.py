"""`bns.Measurements`: what was commanded and where the robot was, from files or tables, checked."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from copy import copy
from functools import cached_property
from os import PathLike, fspath
from pathlib import Path
from typing import TYPE_CHECKING, Any, Union

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from bns.api.common.shown import Shown, counted
from bns.diagnose.data.apply_mapping import applied
from bns.diagnose.data.bodies.cycles import CycleTracks
from bns.diagnose.data.checks import left_out_rows, own_rows, rows_by_trial, rows_of_losses
from bns.diagnose.data.load import Measured, load_measured, measured_table, table_sha256
from bns.diagnose.data.mapping import checked_mapping, files_behind, load_mapping
from bns.diagnose.data.sources.read import read_table
from bns.diagnose.predict.check_robot import suggested_wheelbase_m
from bns.diagnose.report.text import findings_text
from bns.errors import DataError
from bns.measurements import LEFT_OUT, POSE

if TYPE_CHECKING:
    from matplotlib.axes import Axes

Log = Union[str, PathLike[str], pd.DataFrame, "Measurements", Sequence[str | PathLike[str]]]
"""A file (.csv, .csv.gz, .parquet), several, a table, or measurements already read."""
Rules = Mapping[str, Any] | str | PathLike[str]
"""A mapping of columns and units, or its file."""
MARGIN_S = 0.5
"""What spoils a pose (a hidden marker, a push) often lasts, so so much before and after goes with it."""
_SAVED_AS = "measurements.csv"
SAVED = f'log.frame.to_csv("{_SAVED_AS}", index=False)'
"""Python that writes the file which a command line reads instead of what is only in memory; ``log`` is the measurements."""
_GIVEN_IN_MEMORY: dict[str, Any] = {"data": _SAVED_AS, "more": (), "robot": None, "without": ()}
_TABLE = Path("table")
"""What a table that came from no file is called."""


class Measurements(Shown):
    """Checked measurements of one robot.

    ``log`` is a file, a table (`pandas.DataFrame`) or a list of files, whose trials are taken together. Columns and units are
    those of docs/logs.md: trial, t_s (s), left_m_s, right_m_s (m/s, wheel surface), x_m, y_m (m), heading_rad (rad,
    counter-clockwise from x); or the cycles and markers of a snake.

    Args:
        robot: the robot whose rows are used, if a column ``robot`` names several.
        mapping: how other columns and units are read: a dictionary or the path of a mapping file (docs/logs.md). A file
            with FILE.import.yaml next to it needs none.

    Raises:
        DataError: what cannot be used; the message says what to do.
    """

    def __init__(
        self, log: Log, *more: str | PathLike[str], robot: str | None = None, mapping: Rules | None = None
    ) -> None:
        self._measured = _read(log, more, robot, mapping)
        if isinstance(log, Measurements):
            self._in_memory, self._given = log.only_in_memory, log.given
        else:
            self._in_memory = isinstance(log, pd.DataFrame) or mapping is not None
            self._given = _GIVEN_IN_MEMORY if self._in_memory else _words_given(log, more, robot)

    @property
    def frame(self) -> pd.DataFrame:
        """A copy of the table: one row per tracked pose, in SI units; rows that the checks leave out included."""
        return self._measured.table.copy()

    @cached_property
    def trials(self) -> pd.DataFrame:
        """One row per trial, in order: trial (its name), poses and, on wheels, commands (how many of each), duration_s (s)."""
        tracks = self._measured.tracks
        table = pd.DataFrame({"trial": tracks.names, "poses": np.diff(tracks.first)})
        if not isinstance(tracks, CycleTracks):
            lasts = tracks.duration_s
            lead = 0.0 if tracks.lead_s is None else tracks.lead_s
            table["commands"], table["duration_s"] = (lasts > 0).sum(axis=1), lasts.sum(axis=1) - lead
        return table

    @property
    def findings(self) -> pd.DataFrame:
        """Irregularities: trial, row (of the table, from 0), text (what it is, and what was done about it)."""
        return pd.DataFrame([vars(each) for each in self._measured.findings], columns=["trial", "row", "text"])

    @property
    def robot(self) -> str:
        """The value of the column ``robot``; "" if there is none."""
        return self._measured.robot

    @property
    def name(self) -> str:
        """Of the (first) file; ``table`` for a table."""
        return self._measured.path.name

    @property
    def given(self) -> dict[str, Any]:
        """What a command line repeats to read the same: data and more (files), robot (or None), without (names of trials).

        Of what no file holds (`only_in_memory`), the file that `SAVED` writes.
        """
        return dict(self._given)

    @property
    def files(self) -> tuple[Path, ...]:
        """The files that were read, with their mappings; none for a table."""
        if self.only_in_memory:
            return (self._measured.path,) if self._measured.path.is_file() else ()
        return tuple(files_behind([Path(self._given["data"]), *map(Path, self._given["more"])]))

    @property
    def only_in_memory(self) -> bool:
        """Whether a command line cannot read the same: a table, a mapping given in Python, rows that were left out here."""
        return self._in_memory

    @property
    def measured(self) -> Measured:
        """The same for the library's own functions: tracks as arrays, findings, digest."""
        return self._measured

    def without(self, trials: Iterable[str]) -> Measurements:
        """The same measurements without some trials, by their names. DataError if there is no such trial, or none is left."""
        trials = (str(trials),) if isinstance(trials, str) or not isinstance(trials, Iterable) else tuple(map(str, trials))
        left_out, there = set(trials), self._rows_of_trials
        unknown = sorted(left_out - set(there))
        if unknown:
            raise DataError(f"There is no trial {', '.join(unknown)}; there are {', '.join(there)}.")
        if not left_out:
            return self
        if set(there) <= left_out:
            raise DataError("All trials are left out; keep at least one.")
        kept = np.ones(len(self._measured.table), dtype=bool)
        kept[np.concatenate([there[name] for name in left_out])] = False
        fewer = self._of(self._measured.table[kept])
        if not self.only_in_memory:
            fewer._given = {**self._given, "without": (*self._given["without"], *dict.fromkeys(trials))}
        return fewer

    def checked_again(self) -> Measurements:
        """The same rows, checked under the settings that are in force."""
        return self._of(self._measured.table, same=True)

    def without_rows(self, rows: Iterable[int]) -> Measurements:
        """The same measurements without the poses of some rows (of `frame`, from 0, as `findings` counts them).

        Their commands stay in force, and no window spans them. `frame` marks them in a column ``left_out``, so that a saved table
        reads the same. Of a robot in cycles the whole cycle is left out. DataError if there is no such row, or no pose is left.
        """
        chosen = np.unique(np.fromiter((int(row) for row in rows), dtype=np.int64))
        count = len(self._measured.table)
        if len(chosen) and not 0 <= chosen[0] <= chosen[-1] < count:
            wrong = chosen[0] if chosen[0] < 0 else chosen[-1]
            raise DataError(f"There is no row {wrong}; the table has the rows 0 to {count - 1}.")
        return self._without(np.isin(np.arange(count), chosen))

    def cut(self, kept: Mapping[str, tuple[float, float]]) -> Measurements:
        """The same measurements with some trials cut: of each named trial, the part from one time (s, of the trial) to another.

        What was commanded before stays known, so that the robot is in motion where a trial begins in motion. DataError if there
        is no such trial, or nothing of it is left.
        """
        out = np.zeros(len(self._measured.table), dtype=bool)
        for name, ends in kept.items():
            rows, time_s = self.times_of(name)
            from_s, to_s = _two_times(name, ends)
            inside = (time_s >= from_s) & (time_s <= to_s)
            if not inside.any():
                raise DataError(
                    f"Trial {name} has nothing from {from_s:g} s to {to_s:g} s; it lasts from 0 s to {time_s[-1]:g} s."
                )
            out[rows[~inside]] = True
        return self._without(out)

    def times_of(self, trial: str) -> tuple[NDArray[np.int64], NDArray[np.float64]]:
        """The rows of a trial (of `frame`, from 0), and their times (s) since it began. DataError if there is no such trial."""
        table, rows = self._measured.table, self._rows_of_trials.get(str(trial))
        if rows is None:
            raise DataError(f"There is no trial {trial}; there are {', '.join(self._rows_of_trials)}.")
        time_s = pd.to_numeric(table["t_s"].iloc[rows], errors="coerce").to_numpy(dtype=float)
        own = own_rows(table.iloc[rows])
        return rows, time_s - time_s[own][0] if own.any() else time_s

    def rows_around(self, *rows: int, margin_s: float = MARGIN_S) -> NDArray[np.int64]:
        """The rows (n,) that findings are about, which are named by theirs: with all from ``margin_s`` before to as long after.

        What a finding is about ends where the robot is seen again; of lost poses one finding counts all of a trial. All rows
        are of the findings' own trials. DataError if there is no such row.
        """
        table = self._measured.table
        for row in rows:
            if not 0 <= row < len(table):
                raise DataError(f"There is no row {row}; the table has the rows 0 to {len(table) - 1}.")
        names = table["trial"].iloc[list(rows)].astype(str)
        found = [self._around(name, np.array(rows)[(names == name).to_numpy()], margin_s) for name in dict.fromkeys(names)]
        return np.sort(np.concatenate([np.zeros(0, dtype=np.int64), *found]))

    def _around(self, trial: str, odd: NDArray[np.int64], margin_s: float) -> NDArray[np.int64]:
        """The same for rows of one trial."""
        rows, time_s = self.times_of(trial)
        seen, about = _seen(self._measured.table.iloc[rows]), np.isin(rows, odd)
        if not seen[about].all():
            about |= rows_of_losses(time_s, seen)
        ends = np.sort(time_s[about | np.append(False, about[:-1])])  # a gap ends with the row after it
        at = np.searchsorted(ends, time_s)
        before, after = ends[(at - 1).clip(min=0)], ends[at.clip(max=len(ends) - 1)]
        return np.asarray(rows[np.minimum(np.abs(time_s - before), np.abs(after - time_s)) <= margin_s], dtype=np.int64)

    @cached_property
    def _rows_of_trials(self) -> dict[str, NDArray[np.int64]]:
        """Rows of the table by the name of their trial."""
        return {name: np.sort(at) for name, at in rows_by_trial(self._measured.table)}

    def _without(self, out: NDArray[np.bool_]) -> Measurements:
        """Rows (rows,) marked as left out, beside those that are."""
        if not out.any():
            return self
        table = self._measured.table
        fewer = self._of(table.assign(**{LEFT_OUT: (out | left_out_rows(table)).astype(int)}))
        fewer._given, fewer._in_memory = _GIVEN_IN_MEMORY, True
        return fewer

    def _of(self, table: pd.DataFrame, same: bool = False) -> Measurements:
        """Some of the same rows, or the same with other marks; ``same``: all of them as they are."""
        fewer, was = copy(self), self._measured
        files = was.files if same else tuple((name, "") for name, _ in was.files)
        fewer.__dict__ = {
            "_measured": measured_table(table, was.path, was.digest if same else "", files=files),
            "_given": self._given,
            "_in_memory": self._in_memory,
        }
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
        """The amount of data, and the irregularities."""
        return f"{self._line()}\n{findings_text(self._measured.findings)}"

    def _line(self) -> str:
        poses, odd = int(self.trials["poses"].sum()), len(self._measured.findings)
        return f"{self.name}, {counted(len(self), 'trial')}, {counted(poses, 'pose')}, {counted(odd, 'finding')}"

    def plot_paths(self, ax: Axes | None = None, trials: Iterable[int] | None = None) -> Axes:
        """Where the robot went, one line per trial, m; ``trials``: which, by their number from 0 (default: all)."""
        from bns.api.common.axes import drawn  # noqa: PLC0415  # matplotlib is slow to load
        from bns.plotting.style import OKABE_ITO  # noqa: PLC0415  # matplotlib is slow to load

        tracks = self._measured.tracks
        chosen = range(len(tracks)) if trials is None else trials

        def draw(axes: Axes) -> None:
            for number, trial in enumerate(chosen):
                pose = tracks.pose[tracks.first[trial] : tracks.first[trial + 1]]
                axes.plot(pose[:, 0], pose[:, 1], color=OKABE_ITO[number % len(OKABE_ITO)], linewidth=0.8)
                axes.plot(pose[:1, 0], pose[:1, 1], "k^", markersize=3)
            axes.set(aspect="equal", xlabel="x, east (m)", ylabel="y, north (m)", title=f"{self.name}: measured paths")

        return drawn(ax, draw)


def _seen(table: pd.DataFrame) -> NDArray[np.bool_]:
    """Rows that hold a whole pose, or all markers and sites; (rows,)."""
    whole = set(POSE) <= set(table.columns)
    places = list(POSE) if whole else [name for name in table.columns if str(name).endswith(("_x_m", "_y_m"))]
    return np.asarray(table[places].notna().all(axis=1), dtype=bool)


def _two_times(trial: str, ends: Any) -> tuple[float, float]:
    """From when to when (s) a trial is kept. DataError for anything but two numbers."""
    try:
        from_s, to_s = map(float, ends)
    except (TypeError, ValueError):
        raise DataError(
            f"Trial {trial} is to be kept for {ends!r}; give two times in seconds, from when and to when, such as (2.0, 6.5)."
        ) from None
    return from_s, to_s


def _words_given(log: Any, more: Iterable[str | PathLike[str]], robot: str | None) -> dict[str, Any]:
    """As `Measurements.given` has it, of files."""
    files = [*(log if isinstance(log, list | tuple) else (log,)), *more]
    return {"data": fspath(files[0]), "more": tuple(map(fspath, files[1:])), "robot": robot, "without": ()}


def as_measurements(log: Log) -> Measurements:
    """Measurements as they are, or read."""
    return log if isinstance(log, Measurements) else Measurements(log)


def _read(log: Log, more: tuple[str | PathLike[str], ...], robot: str | None, mapping: Rules | None) -> Measured:
    if isinstance(log, Measurements):
        if more or robot or mapping:
            raise DataError(
                "These measurements have already been read; give the files to choose a robot or a mapping."
            )
        return log.measured
    if isinstance(log, pd.DataFrame):
        if more:
            raise DataError(
                "A table and files cannot be taken together; join them with pandas.concat, or give files only."
            )
        return measured_table(_mapped(log, mapping, Path()), _TABLE, robot=robot)
    many = isinstance(log, list | tuple) and all(isinstance(each, str | PathLike) for each in log)
    if not (many or isinstance(log, str | PathLike)):
        raise DataError(
            f"Measurements cannot be read from {type(log).__name__}; give the path of a file, several paths, a pandas.DataFrame, "
            "or bns.Measurements."
        )
    files = [Path(each) for each in ([log] if isinstance(log, str | PathLike) else log)] + [Path(each) for each in more]
    if not files:
        raise DataError("No file is given; give at least one .csv or .parquet file of measurements.")
    if mapping is None:
        return load_measured(files[0], robot, files[1:])
    if len(files) > 1:
        raise DataError("A mapping belongs to one file; with several, put FILE.import.yaml next to each.")
    return measured_table(_mapped(read_table(files[0]), mapping, files[0].parent), files[0], robot=robot)


def _mapped(table: pd.DataFrame, mapping: Rules | None, folder: Path) -> pd.DataFrame:
    if mapping is None:
        return table
    rules = (
        checked_mapping(dict(mapping)) if isinstance(mapping, Mapping) else load_mapping(Path(mapping))
    )
    return applied(table, rules, folder, read_table)
