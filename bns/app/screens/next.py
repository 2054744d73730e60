"""Take it home: the model, the report, the measurements that took part, and the same as commands and as Python."""

from __future__ import annotations

import io
from html import escape

import panel as pn

from bns.app.jobs import Jobs
from bns.app.parts import WIDE, Problem, beside, button, heading, html
from bns.app.same_elsewhere import commands, python
from bns.app.tab import Tab

USED = "used.csv"


class NextScreen:
    """What is saved is what the switches say now."""

    def __init__(self, tab: Tab, jobs: Jobs) -> None:
        self._tab, self._jobs = tab, jobs
        self._problem, self._report_problem = Problem(), Problem()
        self._model = pn.widgets.FileDownload(callback=self._yaml, filename="extended.yaml", label="Save the model", button_type="primary")  # fmt: skip
        self._used = pn.widgets.FileDownload(
            callback=self._csv, filename=USED, label="Save the measurements that took part"
        )
        self._make = button("Make the report", self._begin_report)
        self._report = pn.widgets.FileDownload(filename="report.html", label="Save the report", visible=False)
        self._summary, self._commands, self._python = html(), html(), html()
        left = pn.Column(
            heading("Save"),
            self._problem.view,
            self._summary,
            self._model,
            self._used,
            html("<p>The report diagnoses the log with the model as given, as <code>bns report</code> does.</p>"),
            pn.FlexBox(self._make, self._report),
            self._report_problem.view,
            **WIDE,
        )
        right = pn.Column(heading("The same on a command line"), self._commands, heading("The same in Python"), self._python, **WIDE)  # fmt: skip
        self.view = beside(left, right)

    def enter(self) -> None:
        """The words for what is on now."""
        tab, bench = self._tab, self._tab.bench
        for widget in (self._model, self._used, self._make):
            widget.disabled = bench is None
        if bench is None:
            self._problem.show(tab.why_no_bench or "Open a log first: the screen Data.")
            return
        self._problem.show("")
        self._jobs.run("fitting", lambda: bench.shown(tab.now).model.summary(), self._summed_up, self._problem.show)
        data = USED if tab.left_out else tab.data_words
        notes = [f"# {USED}: the measurements that took part, saved here"] if tab.left_out else []
        notes += ["# numbers moved by hand are in the saved model alone"] if tab.now.by_hand else []
        typed = [*notes, *commands(data, tab.model_words, tab.now)]
        self._commands.object = (
            f"<pre class='bns-copy' id='bns-commands' tabindex='0'>{escape(chr(10).join(typed))}</pre>"
        )
        text = python(tab.data_words, tab.model_words, tab.now, tab.left_out)
        self._python.object = f"<pre class='bns-copy' id='bns-python' tabindex='0'>{escape(text)}</pre>"

    def _summed_up(self, text: str) -> None:
        self._summary.object = f"<pre class='bns-copy' id='bns-saved'>{escape(text)}</pre>"

    def _yaml(self) -> io.StringIO:
        assert self._tab.bench is not None
        return io.StringIO(self._tab.bench.shown(self._tab.now).model.to_yaml())

    def _csv(self) -> io.StringIO:
        used = self._tab.used
        assert used is not None
        return io.StringIO(used.frame.to_csv(index=False))

    def _begin_report(self) -> None:
        tab = self._tab

        def work() -> bytes:
            return tab.report(tab.folder / "report.html")

        self._jobs.run("diagnosing and reporting", work, self._made, self._report_problem.show)

    def _made(self, page: bytes) -> None:
        self._report_problem.show("")
        self._report.param.update(file=io.BytesIO(page), visible=True)
