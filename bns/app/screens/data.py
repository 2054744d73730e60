"""Pick or drop a log, say what its columns mean, see where the robot went and what is odd, leave trials out."""

from __future__ import annotations

from dataclasses import replace
from html import escape
from pathlib import Path
from typing import Any

import numpy as np
import panel as pn

from bns.app.figures.paths import LogFigure, paths_of
from bns.app.jobs import Jobs
from bns.app.log.columns import ColumnsPart
from bns.app.log.cutting import CutPart
from bns.app.log.findings import MOST, FindingsPart, in_words
from bns.app.log.part import Part
from bns.app.log.roles import Mapped, Menus
from bns.app.names import called
from bns.app.parts import WIDE, Problem, beside, button, drawn, heading, html, on_change, row
from bns.app.session import is_session, opened
from bns.app.tab import Tab
from bns.diagnose.data.mapping import mapping_beside
from bns.diagnose.data.sources.bags import ENDINGS as BAGS
from bns.diagnose.data.sources.read import read_table
from bns.diagnose.data.sources.text_tables import ENDINGS as TEXTS
from bns.examples import FOLDER
from bns.measurements import COLUMNS

SAMPLES = {"A Khepera with a hidden effect, 14 trials": FOLDER / "khepera-log.csv"}
ENDINGS = (*TEXTS, ".gz", ".parquet", ".tuple", *BAGS)


class DataScreen:
    """Takes another log; all switches go off then."""

    def __init__(self, tab: Tab, jobs: Jobs) -> None:
        self._tab, self._jobs = tab, jobs
        self._problem, self._bench_problem, self._part_problem = Problem(), Problem(), Problem()
        self._sample = pn.widgets.Select(**called("A sample log"), options=list(SAMPLES), **WIDE)
        self._path = pn.widgets.TextInput(**called("Or a file of this machine"), placeholder="/path/to/log.csv", **WIDE)
        self._file = pn.widgets.FileInput(
            **called("Or choose files"), accept=",".join((*ENDINGS, ".yaml", ".yml")), multiple=True
        )
        self._columns = ColumnsPart(self._read_mapped)
        self._other = button("Columns and units", self._ask_columns, visible=False)
        self._said, self._picture = html(), LogFigure()
        self._findings, self._cut = FindingsPart(tab, self._to_part), CutPart(tab, self._to_part)
        self._left_out = pn.widgets.MultiSelect(**called("Trials excluded"), options=[], size=8, width=200)
        self._leave = button("Exclude these", self._leave_out)
        self._brushed = button("Exclude the selection in the picture", self._leave_selected)
        on_change(self._file, self._read_uploaded)
        self._open_log = pn.Column(**WIDE)
        self.view = self._laid_out()

    def enter(self) -> None:
        """The log as the tab has it."""
        self._refresh()

    def _refresh(self) -> None:
        log = self._tab.log
        self._bench_problem.show(self._tab.why_no_bench)
        self._other.visible = log is not None and bool(self._tab.asked)
        if log is None:
            self._said.object = "<p>Nothing is open yet.</p>"
            if self._tab.asked:
                self._failed(self._tab.why_no_log)
            return
        summary, model = escape(log.summary().splitlines()[0]), escape(" ".join(self._tab.model_words))
        compared = f"<br>Compared with the model {model}; the Model screen has others."
        self._said.object = f"<p id='bns-log'><b>{summary}</b>{self._taking_part()}{compared}</p>"
        self._findings.enter()
        self._cut.refresh()
        names = [str(n) for n in log.trials["trial"]]
        self._left_out.options, self._left_out.value = names, list(self._tab.part.trials)
        self._draw()
        if not self._open_log.objects:  # a picture that is hidden has no size to begin with, which Bokeh complains of
            self._open_log.objects = self._of_open_log()

    def _taking_part(self) -> str:
        """How much takes part, where something does not."""
        used = self._tab.used
        if used is None or not self._tab.part:
            return ""
        poses = int(used.trials["poses"].sum())
        return f"<br><span id='bns-part'>{len(used)} trials and {poses} poses of it are used.</span>"

    def _open_sample(self) -> None:
        self._read(SAMPLES[self._sample.value])

    def _open_path(self) -> None:
        text = (self._path.value_input or self._path.value).strip()
        if text:
            self._read(Path(text).expanduser())

    def _read(self, path: Path) -> None:
        self._tab.asked = (path,)

        def work() -> None:
            if is_session(path):
                self._tab.become(opened(path))
            else:
                self._tab.open(path, str(path))

        self._jobs.run(f"reading {path.name}", work, self._done, self._failed)

    def _read_uploaded(self) -> None:
        if not self._file.value:
            return
        contents = self._file.value if isinstance(self._file.value, list) else [self._file.value]
        names = self._file.filename if isinstance(self._file.filename, list) else [self._file.filename]
        kept = self._tab.keep(dict(zip(names, contents, strict=True)))
        self._tab.asked = tuple(path for path in kept if path.suffix not in {".yaml", ".yml"})
        sessions = [path for path in kept if is_session(path)]

        def work() -> None:
            if sessions:
                self._tab.become(opened(sessions[0]))
            else:
                self._tab.upload(kept)

        self._jobs.run(f"reading {', '.join(names)}", work, self._done, self._failed)

    def _read_mapped(self, mapping: Mapped) -> None:
        tab, paths = self._tab, self._tab.asked
        words = str(paths[0]) if tab.folder not in paths[0].parents else paths[0].name

        def work() -> None:
            tab.open(str(paths[0]), words, mapping, files=[str(path.absolute()) for path in paths])

        self._jobs.run(f"reading {paths[0].name}", work, self._done, self._failed)

    def _done(self, _none: None) -> None:
        self._problem.show("")
        self._part_problem.show("")
        self._columns.hide()
        self._refresh()
        self._jobs.changed(self)

    def _failed(self, text: str) -> None:
        self._problem.show(text)
        if not self._columns.view.visible:
            self._ask_columns()

    def _ask_columns(self) -> None:
        """Menus for the files that were asked for, where these can be read at all."""
        paths = self._tab.asked
        if not paths:
            return

        def work() -> Menus:
            return Menus({"": read_table(paths[0]), **{path.name: read_table(path) for path in paths[1:]}})

        def show(menus: Menus) -> None:
            mapping = self._tab.mapping if self._tab.log is not None else None
            mapping = mapping or mapping_beside(paths[0])
            self._columns.show(menus, mapping, paths[0].name, paths[0].parent)
            if mapping is None and not set(COLUMNS) <= set(menus.tables[""].columns):
                self._problem.show(
                    f"The columns of {paths[0].name} have other names than those of a table of measurements. Choose them below, "
                    "then click 'Read it with this'."
                )

        self._jobs.run(f"looking at the columns of {paths[0].name}", work, show, lambda _text: None)

    def _to_part(self, part: Part) -> None:
        text = "leaving out" if part else "taking all"

        def failed(text: str) -> None:
            self._refresh()
            self._part_problem.show(text)

        self._jobs.run(text, lambda: self._tab.take_part(part), self._done, failed)

    def _leave_out(self) -> None:
        self._to_part(replace(self._tab.part, trials=tuple(self._left_out.value)))

    def _leave_selected(self) -> None:
        names = self._picture.paths.data["trial"]
        picked = {names[i] for i in self._picture.paths.selected.indices}
        self._left_out.value = [n for n in self._left_out.options if n in picked or n in self._left_out.value]
        self._leave_out()

    def _draw(self) -> None:
        used = self._tab.used
        if used is not None:
            self._picture.fill(paths_of(used.measured.tracks), self._marks())

    def _marks(self) -> dict[str, list[Any]]:
        """Findings where the robot was last seen before them."""
        log = self._tab.log
        assert log is not None
        findings = [f for f in log.measured.findings[:MOST] if f.trial not in self._tab.part.trials]
        table = log.measured.table
        east = next(name for name in ("x_m", *map(str, table.columns)) if name in table and name.endswith("x_m"))
        north = f"{east.removesuffix('x_m')}y_m"
        places = table.groupby("trial", sort=False)[[east, north]].ffill().to_numpy(dtype=float)
        known = [(f, places[f.row]) for f in findings if 0 <= f.row < len(places) and np.isfinite(places[f.row]).all()]
        text = [in_words(f) for f, _ in known]
        return {"x": [p[0] for _, p in known], "y": [p[1] for _, p in known], "text": text}

    def _of_open_log(self) -> list[Any]:
        return [
            drawn(self._picture.figure),
            html("<p>To exclude trials, choose them in the list, or tap or brush their paths above.</p>"),
            row(self._left_out, pn.Column(self._leave, self._brushed)),
            self._part_problem.view,
            self._findings.view,
            self._cut.view,
        ]

    def _laid_out(self) -> Any:
        left = pn.Column(
            heading("Open a log"),
            self._sample,
            button("Open the sample", self._open_sample, "primary"),
            self._path,
            button("Open the file", self._open_path),
            html(
                "<p>Or drop files anywhere on this screen: logs (.csv, .parquet, ROS bags), with their .import.yaml if there is "
                "one, or a saved session with its log.</p>"
            ),
            self._file,
            self._problem.view,
            **WIDE,
        )
        right = pn.Column(
            row(self._said, self._other),
            self._bench_problem.view,
            self._open_log,
            **WIDE,
        )
        return pn.Column(beside(left, right, least=330), self._columns.view, **WIDE)
