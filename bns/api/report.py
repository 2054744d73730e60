"""`bns.report`: a diagnosis as one HTML page for people."""

from __future__ import annotations

import html
from collections.abc import Iterable
from dataclasses import dataclass
from os import PathLike, fspath
from pathlib import Path

from bns.api.common.arguments import as_path, checked_progress
from bns.api.common.next_command import limits_in_words
from bns.api.common.progress import Meter, Progress, part
from bns.api.common.shown import Shown
from bns.api.diagnose import DiagnoseResult, diagnose
from bns.api.measurements import Log
from bns.api.model import Given
from bns.api.propose import checked_minutes, checked_output, proposed
from bns.diagnose.report.page import gathered, report_html
from bns.diagnose.settings.chosen import in_force
from bns.physics.effect import Effect
from bns.store.disk.files import publish

PHASES = {"where the model fails": 0.0, "the error, step by step": 0.1, "the next experiment": 0.3, "paths": 0.9}
"""What share of the page is done when it tells so."""


@dataclass(frozen=True, repr=False)
class ReportResult(Shown):
    """The page that was written; can be used as a path (``open(report)``)."""

    path: Path
    diagnosis: DiagnoseResult
    bytes: int

    @property
    def verdict(self) -> str:
        """That of the diagnosis."""
        return self.diagnosis.verdict

    def summary(self) -> str:
        """Verdict, and where the page is."""
        size = f"{self.bytes / 1e6:.1f} MB"
        return (
            f"verdict: {self.verdict}\nwritten to {self.path} ({size}): one file; open it in a browser or mail it"
        )

    def __fspath__(self) -> str:
        return fspath(self.path)

    def _line(self) -> str:
        return f"{self.path}, verdict {self.verdict}"

    def _repr_html_(self) -> str:
        return f'<a href="{html.escape(str(self.path))}">{html.escape(self._line())}</a>'


def report(
    log: Log,
    model: Given,
    path: str | PathLike[str] = "report.html",
    *,
    minutes: float = 10.0,
    arena: tuple[float, float] | None = None,
    start: tuple[float, float, float] | None = None,
    speeds: tuple[float, float] | None = None,
    also: Iterable[Effect | str | PathLike[str]] = (),
    fresh: bool = False,
    progress: Progress | None = None,
) -> ReportResult:
    """Diagnose, propose the next experiment, and write both as one page that needs no other file and no network.

    ``path`` must end in .html. The rest is as for `bns.propose`.

    Raises:
        DataError: measurements that cannot be used, limits that make no sense, a page that cannot be written.
        ModelError: no such model.
    """
    checked_minutes(minutes)
    checked_output(as_path(path), "The report", ".html")
    checked_progress(progress)
    found = diagnose(log, model, also=also, fresh=fresh, progress=part(progress, 0.0, 0.4))
    rest = part(progress, 0.4, 1.0)
    return reported(found, path, minutes=minutes, arena=arena, start=start, speeds=speeds, progress=rest)


def reported(
    found: DiagnoseResult,
    path: str | PathLike[str],
    *,
    minutes: float = 10.0,
    arena: tuple[float, float] | None = None,
    start: tuple[float, float, float] | None = None,
    speeds: tuple[float, float] | None = None,
    command: dict[str, str] | None = None,
    progress: Progress | None = None,
) -> ReportResult:
    """The page of a diagnosis that is there. ``command``: words (data, model) that the commands shown on the page repeat."""
    checked_minutes(minutes)
    target, ready = checked_output(as_path(path), "The report", ".html"), found.ready
    meter = Meter(progress, PHASES, pace=1)
    planning = part(progress, PHASES["the next experiment"], PHASES["paths"])
    with in_force(found.settings):
        material = gathered(
            ready.measured,
            ready.predictor,
            ready.model,
            found.diagnosis,
            lambda: proposed(found, minutes=minutes, arena=arena, start=start, speeds=speeds, progress=planning).proposal,
            meter,
        )
        words = command or {**found.command, **limits_in_words(minutes, arena, start, speeds)}
        page = report_html(material, words).encode()
    publish(page, target.with_name(f".{target.name}.part"), target)
    meter.done()
    return ReportResult(target, found, len(page))
