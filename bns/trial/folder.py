"""The folder of a trial: its journal, spec and measurements, and what of it can be resumed."""

from __future__ import annotations

import json
import shlex
import sys
import warnings
from collections.abc import Iterable, Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
from filelock import FileLock, Timeout

from bns.errors import BnsError, HardwareError, StoreError, TrialFileError
from bns.hardware.link.hardware_log import events
from bns.hardware.link.sealed_lines import LogWarning
from bns.measurements import write_measurements
from bns.spec import RunSpec, parameters_in
from bns.trial.driver import REPEATED, Stuck
from bns.trial.evaluation import Evaluation
from bns.trial.table_lines import edits, free_name, moving_away, old_tables, rows_before_odd

JOURNAL, MEASUREMENTS, REPEATS, PICTURE = "journal.jsonl", "measurements.csv", "repeats.csv", "last-drive.png"


@contextmanager
def locked(folder: Path) -> Iterator[None]:
    """One process drives the trial of a folder; HardwareError for the second. The lock goes with the process that has it."""
    folder.parent.mkdir(parents=True, exist_ok=True)
    lock = FileLock(folder.with_suffix(".lock"))
    try:
        lock.acquire(timeout=0)
    except Timeout as error:
        raise HardwareError(f"this trial is being driven by another process ({folder}); wait for it.") from error
    try:
        yield
    finally:
        lock.release()


@contextmanager
def robot_stands(path: Path) -> Iterator[None]:
    """A file that cannot be written once the robot has been driven, ``path`` or what the fault names, is a TrialFileError."""
    try:
        yield
    except StoreError as error:
        raise TrialFileError.after(error) from error
    except OSError as error:
        raise TrialFileError.of(error.filename or path, error) from error


class TrialFolder:
    """`results/trials/NAME`, to be locked while it is used."""

    def __init__(self, results: Path, spec: RunSpec, emulated: bool) -> None:
        name = f"{spec.robot}-{spec.task}-{spec.seed}-{spec.run_id}" + ("-emulated" if emulated else "")
        self.path, self.spec = results / "trials" / name, spec

    @property
    def journal(self) -> Path:
        """Path of the journal."""
        return self.path / JOURNAL

    def past(self, resume: bool) -> list[Evaluation]:
        """The evaluations it holds. HardwareError if it was begun and is not to be resumed, or the reverse."""
        if self.journal.exists() and not resume:
            raise HardwareError(
                f"this trial was started before, in {self.path}. Continue it with --resume, or start another with --seed "
                f"{self.spec.seed + 1}; to repeat this one from the start, move its folder away."
            )
        check_not_lost(self.journal)
        if resume and not self.journal.exists():
            raise HardwareError(f"there is nothing to resume: no journal in {self.path}. Start without --resume.")
        if not resume:
            return []
        check_not_cut(self.journal)
        return past_evaluations(self.journal)


def check_not_lost(journal: Path) -> None:
    """HardwareError if tables of a trial lie where the journal is gone: a new trial would write over them."""
    left = [path for path in (journal.with_name(MEASUREMENTS), journal.with_name(REPEATS)) if path.exists()]
    if not left or journal.exists():
        return
    compare = f" It can still be compared (bns compare --model MODEL {shlex.quote(str(left[0]))})."
    compared = compare if left[0].name == MEASUREMENTS else ""
    raise HardwareError(
        f"{left[0]} is there, and {journal.name}, from which it was made, is gone: what was measured is in that table alone."
        f"{compared} Restore the journal from a copy to resume the trial; to repeat the trial from the start, move the folder "
        f"{journal.parent} away."
    )


def check_not_cut(journal: Path) -> None:
    """HardwareError if the table of measurements in its folder has more rows than a journal holds, or others.

    Numbers and checksums of lines do not show that lines at the end are lost; and a trial that goes on writes over the table.
    So a LogWarning says where there is no table to compare with, and where cells of it are others than the journal's: such a
    table is kept as a copy.
    """
    table = journal.with_name(MEASUREMENTS)
    if not table.exists():
        _warn_without_table(journal, table)
        return
    try:
        lines = table.read_bytes().split(b"\n")[:-1]
    except OSError as error:
        raise HardwareError(f"cannot read {table}: {error}. It is compared with the journal; make it readable.") from error
    if not lines:
        return
    rows = measured(journal)
    held, kept = len(rows), len(lines) - 1
    good = rows_before_odd(lines, list(zip(rows["trial"], rows["t_s"], strict=True)) if held else [])
    if good > held:
        raise HardwareError(
            f"{journal} has lost its last lines, or was cut: it holds {held} rows of measurements, {table.name} in the same "
            f"folder {kept}. If lines were lost, restore the journal from a copy: what was measured after row {held} is in that "
            "table alone. If the journal was cut above a damaged line, or rows were added to the table, move the table away and "
            f"resume; it is made again from the journal: {moving_away(table)}"
        )
    if good < kept:
        raise HardwareError(
            f"line {good + 2} of {table} is no row of measurements of this trial (its journal holds {held} rows, the table "
            f"{kept}). The table is made from the journal; move it away and resume, and it is made again: {moving_away(table)}"
        )
    if kept and (edited := edits(lines, rows.to_csv(index=False).encode().splitlines())):
        _warn(
            f"{table} differs from {journal.name}, from which it is made, in {edited}. The journal decides, and the table is "
            f"made again; as it was it is kept as {_copied(table)}."
        )


def _warn_without_table(journal: Path, table: Path) -> None:
    """LogWarning, if anything was driven, that no table shows whether the journal is whole."""
    rows, older = measured(journal), old_tables(table)
    if not (len(rows) or older or journal.with_name(PICTURE).exists()):
        return
    holds = f"{len(rows)} rows of measurements, up to trial {rows['trial'].max()}" if len(rows) else "no measurements"
    beside = "".join(f"; {path.name} beside it has {_rows_in(path)} rows" for path in older)
    _warn(
        f"{table} is not there, so nothing shows whether {journal.name} has lost lines at its end. It decides, and the trial "
        f"goes on after what it holds: {holds}{beside}."
    )


def _rows_in(table: Path) -> int:
    return max(0, table.read_bytes().count(b"\n") - 1)


def _copied(table: Path) -> Path:
    """A copy of a table beside it, written once."""
    data = table.read_bytes()
    same = [path for path in old_tables(table) if path.read_bytes() == data]
    copy = same[0] if same else free_name(table)
    if not same:
        with robot_stands(copy):
            copy.write_bytes(data)
    return copy


def _warn(text: str) -> None:
    warnings.warn(text, LogWarning, stacklevel=4)


def spec_of(journal: Path) -> RunSpec:
    """The spec that a journal was driven with."""
    for event in events(journal, "trial"):
        return RunSpec(**parameters_in(event["spec"]))
    raise HardwareError(f"{journal} does not say which run it is of; name the journal.jsonl of a trial.")


def past_evaluations(journal: Path) -> list[Evaluation]:
    """Evaluations of a journal in order. One that was driven again counts as driven last, up to the first that is missing."""
    return _evaluations(events(journal, "driven", "marked", "evaluated", "discarded", "skipped"), 1)


def past_repeats(journal: Path, evaluation: int) -> list[Evaluation]:
    """The further drives of an evaluation's controller in a journal, in order, the second drive first."""
    kinds = (REPEATED + kind for kind in ("driven", "marked", "discarded", "skipped"))
    return _evaluations(
        (
            event | {"kind": event["kind"].removeprefix(REPEATED), "evaluation": event["repeat"]}
            for event in events(journal, *kinds)
            if event["evaluation"] == evaluation
        ),
        2,
    )


def stuck_before(journal: Path) -> list[Stuck]:
    """The drives of a journal that were stuck, and where: what is stuck there again is not driven a third time."""
    found: list[Stuck] = []
    for event in events(journal, "stuck", REPEATED + "stuck") if journal.exists() else ():
        numbers = tuple((name, event[name]) for name in ("evaluation", "repeat") if name in event)
        found.append((event["kind"].removesuffix("stuck"), numbers, event["what"]))
    return found


def _evaluations(noted: Iterable[dict[str, Any]], first: int) -> list[Evaluation]:
    driven: dict[int, dict] = {}
    rounds: dict[int, int] = {}
    unstable: dict[int, tuple[int, ...]] = {}
    for event in noted:
        number = event["evaluation"]
        rounds.pop(number, None)
        if event["kind"] in {"driven", "skipped"}:
            driven[number] = event
            unstable.pop(number, None)
        elif event["kind"] == "marked":
            unstable[number] = tuple(event["unstable"])
        elif event["kind"] == "discarded":
            driven.pop(number, None)
        else:
            rounds[number] = event["rounds"]
    found: list[Evaluation] = []
    while (number := first + len(found)) in driven:
        event = driven[number]
        if event["kind"] == "skipped":
            picked = np.asarray(event["picked"], np.float32)
            found.append(Evaluation(picked, picked[:0], np.empty((0, 3)), event["rounds"], skipped=True))
            continue
        picked, commands = (np.asarray(event[name], np.float32) for name in ("picked", "commands"))
        poses = np.asarray(event["poses"], np.float64)
        found.append(Evaluation(picked, commands, poses, rounds.get(number), unstable.get(number, ())))
    return found


def measured(journal: Path) -> pd.DataFrame:
    """The measurements of every drive in a journal; `trial` counts the drives, `discarded` is 1 of one that is not to count."""
    tables: list[pd.DataFrame] = []
    for event in events(journal, "driven", "marked", "discarded"):
        if event["kind"] == "discarded":
            if tables and tables[-1]["evaluation"].iloc[0] == event["evaluation"]:
                tables[-1]["discarded"] = 1
            continue
        if event["kind"] == "marked":
            led_here = tables[-1]["cycle"].shift(1)
            tables[-1].loc[led_here.isin(event["unstable"]), "stable"] = 0.0
            continue
        if not event["rows"]:  # it ended before the robot stood at its start
            continue
        table = pd.DataFrame(event["rows"]).astype(float)
        table.insert(0, "trial", len(tables) + 1)
        table["evaluation"], table["session_s"] = event["evaluation"], event["session_s"] + table["t_s"]
        tables.append(table.assign(**event["readings"], discarded=0))
    return pd.concat(tables, ignore_index=True) if tables else pd.DataFrame()


def keep_measurements(journal: Path, columns: Sequence[str]) -> pd.DataFrame:
    """The measurements of a journal, written beside it where there are any, with these columns. TrialFileError."""
    table = measured(journal) if journal.exists() else pd.DataFrame()
    if len(table):
        path = journal.with_name(MEASUREMENTS)
        with robot_stands(path):
            write_measurements(table, path, columns)
    return table


@contextmanager
def measurements_however_it_ends(journal: Path, columns: Sequence[str]) -> Iterator[None]:
    """Keep the measurements when a trial is over. A table that cannot be written does not hide the fault that ended the trial."""
    try:
        yield
    except BaseException as cause:
        try:
            keep_measurements(journal, columns)
        except BnsError as error:
            if not isinstance(cause, TrialFileError):  # then one word of it is enough
                print(f"bns: {error}", file=sys.stderr)
        raise
    keep_measurements(journal, columns)


def forget_unless(journal: Path, kind: str) -> None:
    """Remove a journal without an event of that kind: nothing has come of it, and the next attempt is no second one."""
    if journal.exists() and f'"kind":"{kind}"' not in journal.read_text(encoding="utf-8"):
        journal.unlink()


def spec_event(spec: RunSpec) -> dict:
    """What the first line of a journal holds."""
    return dict(json.loads(spec.canonical_json()))
