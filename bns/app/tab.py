"""What one tab of the browser is about: its log, its model, its switches, its diagnosis. It outlives the page that shows it."""

from __future__ import annotations

import secrets
import shutil
import tempfile
import weakref
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, fields
from os import PathLike
from pathlib import Path
from typing import Any

import yaml

from bns.api.compare import CompareResult, compare
from bns.api.diagnose import DiagnoseResult, diagnose
from bns.api.measurements import Log, Measurements
from bns.api.model import Given, Model, as_model
from bns.api.propose import ProposeResult
from bns.api.run import RunResult
from bns.app.background import Background
from bns.app.switches import History, Switches
from bns.app.workbench import Workbench
from bns.diagnose.data.guess.mapping import drafted
from bns.diagnose.data.sources.read import read_table
from bns.errors import DataError, ModelError

FIRST_MODEL = "khepera"
_LONGEST_S = 600.0
MOST_TABS = 16
"""Tabs whose state is kept; the one that was looked at longest ago goes first."""


@dataclass
class Tab:
    """``log``: all trials as read; ``left_out``: names of trials that take no part; ``bench`` is None until a log is open.

    ``data_words``, ``model_words``: what to write for them on a command line; ``files``: where the log lies; ``mapping``: how its
    columns were read, where the user wrote that; ``snapshots``: states of the switches that the user named.
    """

    log: Measurements | None = None
    data_words: str = ""
    files: tuple[str, ...] = ()
    mapping: Mapping[str, Any] | None = None
    left_out: tuple[str, ...] = ()
    model: Model = field(default_factory=lambda: Model(FIRST_MODEL))
    model_words: tuple[str, ...] = (FIRST_MODEL,)
    bench: Workbench | None = None
    history: History = field(default_factory=History)
    snapshots: dict[str, Switches] = field(default_factory=dict)
    diagnosis: Background[DiagnoseResult] = field(default_factory=Background)
    evolution: Background[RunResult] = field(default_factory=Background)
    experiment: Background[ProposeResult] = field(default_factory=Background)
    why_no_bench: str = ""
    _folder: Path | None = None
    _compared: dict[Any, CompareResult] = field(default_factory=dict)

    @property
    def folder(self) -> Path:
        """Where uploaded files lie while the tab lives."""
        if self._folder is None:
            self._folder = Path(tempfile.mkdtemp(prefix="bns-explore-"))
            weakref.finalize(self, shutil.rmtree, self._folder, ignore_errors=True)
        return self._folder

    def open(self, log: Log, words: str, mapping: Mapping[str, Any] | None = None, files: Sequence[str] = ()) -> None:
        """Another log, which lies in ``files`` if it is read already. DataError: it cannot be used, and all stays as it was."""
        self.log = log if isinstance(log, Measurements) else Measurements(log, mapping=mapping)
        self.data_words, self.left_out, self.mapping = words, (), mapping
        self.files = tuple(files) or _files_of(log)
        self._lay_on()

    def keep(self, files: Mapping[str, bytes]) -> list[Path]:
        """Files of the browser, by their names, written where the tab keeps them."""
        paths = [self.folder / Path(name).name for name in files]
        for path, content in zip(paths, files.values(), strict=True):
            path.write_bytes(content)
        return paths

    def upload(self, files: Sequence[Path]) -> None:
        """Open files that were kept: logs, and mappings that belong beside them."""
        logs = [path for path in files if path.suffix not in {".yaml", ".yml"}]
        if not logs:
            raise DataError("There is no log among these files; give a .csv or .parquet file of measurements.")
        self.open(list(map(str, logs)), logs[0].name)

    def become(self, other: Tab) -> None:
        """All that another tab is about; its own folder stays."""
        self.diagnosis.stop()
        for each in fields(self):
            if each.name != "_folder":
                setattr(self, each.name, getattr(other, each.name))

    def leave_out(self, trials: tuple[str, ...]) -> None:
        """Other trials take no part. DataError if none would be left."""
        if self.log is not None and trials != self.left_out:
            self.log.without(trials)
            self.left_out = trials
            self._lay_on()

    def take(self, model: Given, words: tuple[str, ...]) -> None:
        """Another model. ModelError if there is none."""
        self.model, self.model_words = as_model(model), words
        self._lay_on()

    @property
    def used(self) -> Measurements | None:
        """The measurements that take part."""
        return None if self.log is None else self.log.without(self.left_out)

    @property
    def now(self) -> Switches:
        """The state of the switches."""
        return self.history.now

    def compared(self, model: Model) -> CompareResult:
        """`bns.compare` of the used measurements and a model; the model as given, or as it is now."""
        assert self.bench is not None
        key = self.bench, model.canonical_json()
        if key not in self._compared:
            self._compared[key] = compare(self.bench.ready.log, model)
        return self._compared[key]

    def report(self, path: Path) -> bytes:
        """The page of `bns report`, written to ``path``: of the diagnosis that is there, else of a new one."""
        assert self.bench is not None
        if self.diagnosis.result is None:
            self.diagnosis.wait(_LONGEST_S)
        found = self.diagnosis.result or diagnose(self.bench.ready.log, self.model)
        return found.report(path).path.read_bytes()

    def _lay_on(self) -> None:
        """Log and model on the bench, all switches off; why that cannot be is kept in words."""
        for work in (self.diagnosis, self.evolution, self.experiment):
            work.stop()
        self.bench, self.history = None, History()
        self.diagnosis, self.evolution, self.experiment = Background(), Background(), Background()
        self.snapshots.clear()
        self._compared.clear()
        self.why_no_bench = ""
        if self.used is None:
            return
        try:
            self.bench = Workbench(self.used, self.model)
        except (DataError, ModelError) as fault:
            self.why_no_bench = str(fault)


def _files_of(log: Log) -> tuple[str, ...]:
    """Absolute paths of a log that is files; none where it is a table in memory."""
    given = [log] if isinstance(log, str | PathLike) else log
    if not isinstance(given, list | tuple) or not all(isinstance(one, str | PathLike) for one in given):
        return ()
    return tuple(str(Path(one).absolute()) for one in given)


def mapping_of(text: str) -> dict[str, Any]:
    """A mapping as the user wrote it; DataError if it is no YAML."""
    try:
        rules = yaml.safe_load(text)
    except yaml.YAMLError as fault:
        raise DataError(f"The mapping is no valid YAML: {fault}. Correct the place it names.") from fault
    if not isinstance(rules, dict):
        raise DataError("The mapping must have keys such as columns; docs/logs.md has all that may stand in it.")
    return rules


def draft_for(path: Path) -> str:
    """A mapping to begin with, guessed from a log's columns as `bns import` guesses; "" where the file does not read."""
    try:
        return drafted(read_table(path))
    except DataError:
        return ""


@dataclass
class Tabs:
    """All tabs by their names, which stand in their addresses; ``first``: what a new one begins with."""

    first: Tab | None = None
    known: dict[str, Tab] = field(default_factory=dict)

    def get(self, name: str) -> tuple[str, Tab]:
        """The tab of that name, or a new one under a new name."""
        if name in self.known:
            self.known[name] = tab = self.known.pop(name)
            return name, tab
        name, tab = secrets.token_urlsafe(6), Tab()
        if self.first is not None and self.first.log is not None:
            tab.log, tab.data_words, tab.files = self.first.log, self.first.data_words, self.first.files
            tab.model, tab.model_words, tab.mapping = self.first.model, self.first.model_words, self.first.mapping
            tab.left_out = self.first.left_out
            tab._lay_on()
            if self.first.diagnosis.result is not None:
                tab.diagnosis = self.first.diagnosis
            tab.history.to(self.first.now)
            tab.snapshots.update(self.first.snapshots)
        self.known[name] = tab
        while len(self.known) > MOST_TABS:
            self.known.pop(next(iter(self.known))).diagnosis.stop()
        return name, tab
