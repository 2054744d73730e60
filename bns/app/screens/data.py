"""Pick or drop a log, see where the robot went and what is odd, leave trials out."""

from __future__ import annotations

from html import escape
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
import panel as pn

from bns.app.figures.paths import LogFigure
from bns.app.html import table
from bns.app.jobs import Jobs
from bns.app.parts import WIDE, Problem, beside, button, drawn, heading, html, row
from bns.app.session import is_session, opened
from bns.app.tab import Tab, draft_for, mapping_of
from bns.diagnose.data.cycles import CycleTracks
from bns.examples import FOLDER

SAMPLES = {"A Khepera with a hidden effect, 14 trials": FOLDER / "khepera-log.csv"}
MOST_FINDINGS = 200


class DataScreen:
    """Takes another log; all switches go off then."""

    def __init__(self, tab: Tab, jobs: Jobs) -> None:
        self._tab, self._jobs = tab, jobs
        self._problem, self._bench_problem = Problem(), Problem()
        self._sample = pn.widgets.Select(name="A sample log", options=list(SAMPLES), **WIDE)
        self._path = pn.widgets.TextInput(name="Or a file of this machine", placeholder="/path/to/log.csv", **WIDE)
        self._file = pn.widgets.FileInput(
            name="Or drop files here", accept=".csv,.gz,.parquet,.yaml,.yml", multiple=True
        )
        self._mapping = pn.widgets.TextAreaInput(
            name="What its columns mean (guessed: check every line)", height=220, **WIDE
        )
        self._again = button("Read it with this", self._read_mapped)
        self._map = pn.Column(self._mapping, self._again, visible=False, **WIDE)
        self._asked: Path | None = None
        self._said, self._findings, self._picture = html(), html(), LogFigure()
        self._left_out = pn.widgets.MultiSelect(name="Trials left out", options=[], size=8, width=200)
        self._leave = button("Leave these out", self._leave_out)
        self._brushed = button("Leave out what is selected in the picture", self._leave_selected)
        self._file.param.watch(lambda _event: self._read_uploaded(), "value")
        self.view = self._laid_out()

    def enter(self) -> None:
        """The log as the tab has it."""
        log = self._tab.log
        self._bench_problem.show(self._tab.why_no_bench)
        if log is None:
            self._said.object = "<p>Nothing is open yet.</p>"
            return
        self._said.object = f"<p id='bns-log'><b>{escape(log.summary().splitlines()[0])}</b></p>"
        rows = [[f.trial, f.row, f.text] for f in log.measured.findings[:MOST_FINDINGS]]
        more = f" (the first {MOST_FINDINGS})" if len(log.measured.findings) > MOST_FINDINGS else ""
        findings = table(["trial", "row", "what"], rows, f"What is odd{more}", "bns-findings")
        self._findings.object = findings if rows else "<p>Nothing odd in the data.</p>"
        names = [str(n) for n in log.trials["trial"]]
        self._left_out.options, self._left_out.value = names, list(self._tab.left_out)
        self._draw()

    def _open_sample(self) -> None:
        self._read(SAMPLES[self._sample.value])

    def _open_path(self) -> None:
        text = (self._path.value_input or self._path.value).strip()
        if text:
            self._read(Path(text).expanduser())

    def _read(self, path: Path) -> None:
        self._asked = path

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
        files = dict(zip(names, contents, strict=True))
        kept = self._tab.keep(files)
        self._asked = next((path for path in kept if path.suffix not in {".yaml", ".yml"}), None)
        sessions = [path for path in kept if is_session(path)]

        def work() -> None:
            if sessions:
                self._tab.become(opened(sessions[0]))
            else:
                self._tab.upload(kept)

        self._jobs.run(f"reading {', '.join(names)}", work, self._done, self._failed)

    def _read_mapped(self) -> None:
        path = self._asked
        if path is None:
            return

        def work() -> None:
            self._tab.open(path, path.name, mapping_of(self._mapping.value_input or self._mapping.value))

        self._jobs.run(f"reading {path.name}", work, self._done, self._failed)

    def _done(self, _none: None) -> None:
        self._problem.show("")
        self._map.visible = False
        self.enter()

    def _failed(self, text: str) -> None:
        self._problem.show(text)
        draft = draft_for(self._asked) if self._asked is not None and self._asked.is_file() else ""
        if draft and not self._map.visible:
            self._mapping.value = draft
            self._map.visible = True

    def _leave_out(self) -> None:
        chosen = tuple(self._left_out.value)
        self._jobs.run("leaving trials out", lambda: self._tab.leave_out(chosen), self._done, self._problem.show)

    def _leave_selected(self) -> None:
        names = self._picture.paths.data["trial"]
        picked = {names[i] for i in self._picture.paths.selected.indices}
        self._left_out.value = [n for n in self._left_out.options if n in picked or n in self._left_out.value]
        self._leave_out()

    def _draw(self) -> None:
        log = self._tab.log
        assert log is not None
        tracks = log.measured.tracks
        if isinstance(tracks, CycleTracks):
            self._problem.show(
                "These are cycles and markers of a snake: bns compare FILE --model snake holds networks against them."
            )
            return
        shown = [i for i, name in enumerate(tracks.names) if name not in self._tab.left_out]
        paths = [tracks.pose[a:b] for a, b in pairwise(tracks.first)]
        self._picture.fill([paths[i] for i in shown], [tracks.names[i] for i in shown], self._marks())

    def _marks(self) -> dict[str, list[Any]]:
        """Findings where the robot was last seen before them."""
        log = self._tab.log
        assert log is not None
        findings = [f for f in log.measured.findings[:MOST_FINDINGS] if f.trial not in self._tab.left_out]
        frame = log.frame
        places = frame.groupby("trial", sort=False)[["x_m", "y_m"]].ffill().to_numpy(dtype=float)
        known = [(f, places[f.row]) for f in findings if 0 <= f.row < len(places) and np.isfinite(places[f.row]).all()]
        text = [f"trial {f.trial}, row {f.row}: {f.text}" for f, _ in known]
        return {"x": [p[0] for _, p in known], "y": [p[1] for _, p in known], "text": text}

    def _laid_out(self) -> Any:
        left = pn.Column(
            heading("Open a log"),
            self._sample,
            button("Open the sample", self._open_sample, "primary"),
            self._path,
            button("Open the file", self._open_path),
            html(
                "<p>Or drop files on the button: logs (.csv, .parquet), FILE.import.yaml where one has it, "
                "or a saved session with its log.</p>"
            ),
            self._file,
            self._problem.view,
            self._map,
            **WIDE,
        )
        right = pn.Column(
            self._said,
            self._bench_problem.view,
            drawn(self._picture.figure),
            row(self._left_out, pn.Column(self._leave, self._brushed)),
            self._findings,
            **WIDE,
        )
        return beside(left, right, least=330)
