"""What one tab of the browser is about: its log, its model, its switches, its diagnosis. It outlives the page that shows it."""

from __future__ import annotations

import secrets
import shutil
import tempfile
import weakref
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, fields, replace
from os import PathLike, fspath
from pathlib import Path
from typing import Any

from bns.api.common.prepared import are_networks, check_displacements
from bns.api.compare import CompareResult, compare
from bns.api.diagnose import DiagnoseResult, diagnose
from bns.api.measurements import Log, Measurements
from bns.api.model import Given, Model, as_model
from bns.api.propose import ProposeResult
from bns.api.run import RunResult
from bns.app.background import Background
from bns.app.log.part import ALL, Part
from bns.app.switches import History, Switches
from bns.app.workbench import Workbench
from bns.diagnose.data.located import BEGINS
from bns.diagnose.data.sources.read import read_table
from bns.errors import DataError, ModelError
from bns.safe_yaml import read_yaml, shown

FIRST_MODEL = "khepera"
_LONGEST_S = 600.0
MOST_TABS = 16
"""Tabs whose state is kept; the one that was looked at longest ago goes first."""


@dataclass
class Tab:
    """``log``: all trials as read; ``part``: what of it takes part; ``bench`` is None until a log is open.

    ``data_words``, ``model_words``: what to write for them on a command line; ``files``: where the log lies; ``mapping``: how its
    columns were read, where the user wrote that; ``networks``: the name or file of those that are compared instead of the model;
    ``snapshots``: states of the switches that the user named. ``asked``: the files that were asked for last; where they could not
    be read, ``why_no_log`` says why. ``screen``: the one that was looked at last.
    ``alone``: what each effect earns by itself, as far as the diagnosis under way has come.
    """

    log: Measurements | None = None
    data_words: tuple[str, ...] = ()
    files: tuple[str, ...] = ()
    mapping: Mapping[str, Any] | None = None
    part: Part = ALL
    model: Model = field(default_factory=lambda: Model(FIRST_MODEL))
    networks: str = ""
    model_words: tuple[str, ...] = (FIRST_MODEL,)
    bench: Workbench | None = None
    history: History = field(default_factory=History)
    snapshots: dict[str, Switches] = field(default_factory=dict)
    alone: dict[str, Mapping[str, Any]] = field(default_factory=dict)
    diagnosis: Background[DiagnoseResult] = field(default_factory=Background)
    evolution: Background[RunResult] = field(default_factory=Background)
    experiment: Background[ProposeResult] = field(default_factory=Background)
    why_no_bench: str = ""
    asked: tuple[Path, ...] = ()
    why_no_log: str = ""
    screen: str = ""
    _folder: Path | None = None
    _used: Measurements | None = None
    _compared: dict[Any, CompareResult] = field(default_factory=dict)

    @property
    def folder(self) -> Path:
        """Where uploaded files lie while the tab lives."""
        if self._folder is None:
            self._folder = Path(tempfile.mkdtemp(prefix="bns-explore-"))
            weakref.finalize(self, shutil.rmtree, self._folder, ignore_errors=True)
        return self._folder

    def open(
        self, log: Log, words: str | Sequence[str], mapping: Mapping[str, Any] | None = None, files: Sequence[str] = ()
    ) -> None:
        """Another log; ``words``: what its files are called, ``files``: where they lie, if it is read already.

        DataError: it cannot be used, and all stays as it was.
        """
        read = log if isinstance(log, Measurements) else Measurements(log, mapping=mapping)
        check_displacements(read.measured)
        self.log = self._used = read
        self.data_words = (words,) if isinstance(words, str) else tuple(words)
        self.part, self.mapping = ALL, mapping
        self.files = tuple(files) or tuple(str(path.absolute()) for path in files_of(log))
        self.asked, self.why_no_log = tuple(map(Path, self.files)), ""
        self._lay_on()

    def ask(self, paths: Sequence[Path], words: Sequence[str]) -> None:
        """Open files; where their columns say nothing, keep the question for the page, which has menus for that.

        DataError: they cannot be read at all, or hold no displacement.
        """
        try:
            log = Measurements([str(path) for path in paths])
        except DataError as fault:
            for path in paths:
                read_table(path)
            self.asked, self.why_no_log = tuple(paths), str(fault)
        else:
            self.open(log, words, files=[str(path.absolute()) for path in paths])

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
        self.open(list(map(str, logs)), [path.name for path in logs])

    def become(self, other: Tab) -> None:
        """All that another tab is about; its own folder stays."""
        self.diagnosis.stop()
        for each in fields(self):
            if each.name not in {"_folder", "screen"}:
                setattr(self, each.name, getattr(other, each.name))

    def twin(self) -> Tab:
        """A tab that begins as this one stands; what one does from then on, the other does not see."""
        other = replace(
            self,
            history=History(),
            snapshots=dict(self.snapshots),
            diagnosis=self.diagnosis if self.diagnosis.result is not None else Background(),
            evolution=Background(),
            experiment=Background(),
            alone={},
            screen="",
            _folder=None,
            _compared=dict(self._compared),
        )
        other.history.to(self.now)
        return other

    def take_part(self, part: Part) -> None:
        """Something else of the log takes part. DataError if nothing is left of it, and all stays as it was."""
        if self.log is not None and part != self.part:
            self._used = part.of(self.log)
            self.part = part
            self._lay_on()

    def take(self, model: Given, words: tuple[str, ...]) -> None:
        """Another model, or networks. ModelError if there are none."""
        if are_networks(model):
            self.networks = fspath(model)  # type: ignore[arg-type]  # a model with effects is no networks
        else:
            self.model, self.networks = as_model(model), ""
        self.model_words = words
        self._lay_on()

    @property
    def used(self) -> Measurements | None:
        """The measurements that take part."""
        return self._used

    @property
    def as_it_lies(self) -> bool:
        """Does a command read the log's own files as the page does?"""
        return not self.part and self.mapping is None

    @property
    def now(self) -> Switches:
        """The state of the switches."""
        return self.history.now

    def compared(self, model: Model) -> CompareResult:
        """`bns.compare` of the used measurements and a model; the model as given, or as it is now."""
        assert self.bench is not None
        key = self.bench, self.networks or model.canonical_json()
        if key not in self._compared:
            self._compared[key] = compare(self.bench.ready.log, self.networks or model)
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
        self.bench, self.history, self.alone = None, History(), {}
        self.diagnosis, self.evolution, self.experiment = Background(), Background(), Background()
        self.snapshots.clear()
        self._compared.clear()
        self.why_no_bench = ""
        if self._used is None:
            return
        try:
            self.bench = Workbench(self._used, self.networks or self.model)
        except (DataError, ModelError) as fault:
            self.why_no_bench = str(fault)


def files_of(log: Log | Any) -> tuple[Path, ...]:
    """Of a log that is files; none where it is a table in memory."""
    given = [log] if isinstance(log, str | PathLike) else log
    if not isinstance(given, list | tuple) or not all(isinstance(one, str | PathLike) for one in given):
        return ()
    return tuple(Path(one) for one in given)


def mapping_of(text: str) -> dict[str, Any]:
    """A mapping as the user wrote it; DataError if it is no YAML."""
    rules, _ = read_yaml(text, BEGINS, DataError)
    if not isinstance(rules, dict):
        raise DataError(f"{BEGINS}: it is {shown(rules)}; it must have keys such as columns (docs/logs.md has them all).")
    return rules


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
        name = secrets.token_urlsafe(6)
        tab = Tab() if self.first is None else self.first.twin()
        self.known[name] = tab
        while len(self.known) > MOST_TABS:
            self.known.pop(next(iter(self.known))).diagnosis.stop()
        return name, tab
