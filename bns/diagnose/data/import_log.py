"""A lab's files as one table of measurements, or what keeps them from being one."""

from __future__ import annotations

import shlex
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import pandas as pd

from bns.diagnose.data.apply_mapping import applied
from bns.diagnose.data.bodies.cycles import are_cycles
from bns.diagnose.data.bodies.joints import are_joints
from bns.diagnose.data.checks import Finding, checked, own_rows
from bns.diagnose.data.guess.mapping import guessed, lacking
from bns.diagnose.data.load import naming
from bns.diagnose.data.located import located
from bns.diagnose.data.mapping import mapping_beside
from bns.diagnose.data.sources.read import read_table
from bns.errors import DataError
from bns.measurements import COLUMNS, POSE


@dataclass(frozen=True)
class Imported:
    """The table as it is written, the trials that passed the checks, and what was odd."""

    table: pd.DataFrame
    trials: int
    findings: tuple[Finding, ...]
    mapping: Mapping[str, Any] | None

    @property
    def poses(self) -> int:
        """Rows that hold a whole pose."""
        return int(self.table[list(POSE)].notna().all(axis=1).sum())

    def summary(self, where: str) -> str:
        """How much was written; rows without a pose hold commands (or other columns) alone."""
        alone = int(own_rows(self.table).sum()) - self.poses
        rest = f", {alone} without a pose" if alone else ""
        return f"{len(self.table)} rows of {self.trials} trials written to {where}: {self.poses} with a pose{rest}"


def check_new_mapping(output: Path) -> None:
    """DataError if a proposed mapping may not be written there: a mapping that was checked by hand is not replaced."""
    if output.suffix not in {".yaml", ".yml"}:
        raise DataError(f"{output} is no name for a mapping: with --propose give -o FILE.yaml, e.g. LOG.import.yaml.")
    if output.exists():
        raise DataError(f"{output} exists and may have been corrected by hand; nothing was written. Give another file with -o.")


def import_log(files: Sequence[Path], mapping: Mapping[str, Any] | None = None) -> Imported:
    """The first of the files, joined with the others by time, under ``mapping`` or the one that lies beside the first.

    Raises:
        DataError: no mapping and other columns (the message proposes one), a mapping that leaves something out, or measurements
            that cannot be used.
    """
    first, *others = files
    mapping = mapping_beside(first) if mapping is None else mapping
    table = read_table(first)
    if mapping is None and not others and set(COLUMNS) <= set(table.columns):
        return _checked(first, table, None)
    if mapping is None:
        _refuse_bodies(first, table)
        raise DataError(_proposed(first, table, others))
    rules = located(mapping)
    named = {one["file"] for one in rules.get("also", ())}
    missing = [path for path in others if path.name not in named and str(path) not in named]
    with rules.at("also" if named else "columns"):
        if missing:
            raise DataError(f"nothing is taken from {missing[0]}; add it under also:, or leave the file out.")
    with naming(first), rules.at("columns"):
        try:
            out = applied(table, rules, first.parent, read_table)
        except DataError as error:
            more = lacking(rules)
            raise DataError(" ".join([str(error), *more])) from error
        gone = lacking(rules) if not set(COLUMNS) <= set(out.columns) else ()
        if gone:
            raise DataError(" ".join(gone))
    return _checked(first, out, mapping)


def _refuse_bodies(path: Path, table: pd.DataFrame) -> None:
    """DataError for a log of joints or cycles: these are read as they are, and a mapping of wheels would lose their commands."""
    if are_joints(table) or are_cycles(table):
        kind = "set points of joints (JOINT_set_rad)" if are_joints(table) else "cycles and markers"
        raise DataError(
            f"{path} holds {kind}, which need no mapping and no import: give it to bns compare or bns diagnose as it is, in "
            "radians, metres and seconds."
        )


def _checked(path: Path, table: pd.DataFrame, mapping: Mapping[str, Any] | None) -> Imported:
    with naming(path):
        usable, findings = checked(table)
    return Imported(table, usable["trial"].nunique(), tuple(findings), mapping)


def proposal(files: Sequence[Path]) -> str:
    """The mapping that names and numbers suggest for the first file, joined with the others by time: YAML with comments."""
    first, *others = files
    _refuse_bodies(first, read_table(first))
    return guessed(read_table(first), _tables(first, others)).text


def _proposed(first: Path, table: pd.DataFrame, others: Sequence[Path]) -> str:
    """What is in the files, and the mapping that their names suggest."""
    tables = _tables(first, others)
    guess = guessed(table, tables)
    columns = [f"{first} has the columns {', '.join(map(str, table.columns))}"]
    columns += [f"{name} has the columns {', '.join(map(str, one.columns))}" for name, one in tables.items()]
    several = f" It joins {len(files)} files by time." if len(files := [first, *others]) > 1 else ""
    command = shlex.join(["bns", "import", *map(str, files), "--propose"])
    return (
        f"There is no mapping next to {first}. {'; '.join(columns)}. Write {first.name}.import.yaml, or give such a file with "
        f"--map; docs/logs.md lists all possible entries.{several} "
        f"A proposal, guessed from names and numbers; check it line by line "
        f"({command} > {shlex.quote(f'{first}.import.yaml')} saves it):\n\n{guess.text}"
    )


def _tables(first: Path, others: Sequence[Path]) -> dict[str, pd.DataFrame]:
    return {_beside(path, first): read_table(path) for path in others}


def _beside(path: Path, first: Path) -> str:
    """How a mapping beside ``first`` names another file."""
    return path.name if path.parent == first.parent else str(path.absolute())
