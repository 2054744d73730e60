"""Take it home: the model, the report, the measurements that were used, and the same as commands and as Python."""

from __future__ import annotations

from html import escape

import panel as pn

from bns.app.html import found_numbers
from bns.app.jobs import Jobs
from bns.app.parts import WIDE, Problem, beside, button, download, heading, html
from bns.app.same_elsewhere import commands, python
from bns.app.screens.evolve import EvolvePart
from bns.app.screens.experiment import ExperimentPart
from bns.app.session import ENDING, session_yaml
from bns.app.tab import Tab
from bns.app.workbench import Shown

USED = "used.csv"


class NextScreen:
    """What is saved is what the switches say now."""

    def __init__(self, tab: Tab, jobs: Jobs) -> None:
        self._tab, self._jobs = tab, jobs
        self._problem, self._report_problem = Problem(), Problem()
        self._make = button("Make the report", self._begin_report)
        self._prepare = button("Prepare the measurements that were used", self._begin_table)
        self._summary, self._model, self._used, self._report = html(), html(), html(), html()
        self._session = html()
        self._commands, self._python = html(), html()
        left = pn.Column(
            heading("Save"),
            self._problem.view,
            self._summary,
            self._model,
            self._session,
            self._prepare,
            self._used,
            html("<p>The report diagnoses the log with the model as given, as <code>bns report</code> does.</p>"),
            self._make,
            self._report,
            self._report_problem.view,
            **WIDE,
        )
        right = pn.Column(heading("The same on a command line"), self._commands, **WIDE)
        right.extend([heading("The same in Python"), self._python])
        self._experiment, self._evolve = ExperimentPart(tab), EvolvePart(tab)
        self.view = pn.Column(beside(left, right), self._experiment.view, self._evolve.view, **WIDE)

    def enter(self) -> None:
        """The words for what is on now."""
        tab, bench = self._tab, self._tab.bench
        self._prepare.disabled = bench is None
        self._make.disabled = bench is None or bench.of_networks
        self._model.object = self._used.object = self._report.object = self._session.object = ""
        if bench is None:
            self._problem.show(tab.why_no_bench or "Open a log first, on the Data screen.")
            return
        self._problem.show("")
        self._experiment.view.visible = not bench.of_networks
        if not bench.of_networks:
            self._experiment.enter()
        self._evolve.enter()
        state = tab.now
        self._jobs.run("fitting", lambda: bench.shown(state), self._fitted, self._problem.show)
        self._commands.object = _to_copy("\n".join(self._typed()), "bns-commands")
        text = python(tab.data_words, tab.model_words, state, tab.part, tab.mapping, bool(tab.networks))
        self._python.object = _to_copy(text, "bns-python")

    def _typed(self) -> list[str]:
        tab = self._tab
        notes = [f"# {USED}: the measurements that were used, saved here"] if not tab.as_it_lies else []
        notes += ["# parameters set by hand are only in the saved model"] if tab.now.by_hand else []
        return [*notes, *commands(tab.data_words if tab.as_it_lies else [USED], tab.model_words, tab.now, bool(tab.networks))]

    def _fitted(self, shown: Shown) -> None:
        if self._tab.networks:
            self._summary.object = "<p>Networks are compared: there is no model to save.</p>"
        else:
            sizes = "" if shown.switches.by_hand else found_numbers(shown.numbers).removeprefix("<br>")
            listed = f"<p id='bns-sizes'>{sizes}</p>" if sizes else ""
            self._summary.object = _to_copy(shown.model.summary(), "bns-saved") + listed
            text = shown.model.to_yaml().encode()
            self._model.object = download("Save the model", "extended.yaml", text, "text/yaml")
        if self._tab.files:
            session = session_yaml(self._tab).encode()
            link = download("Save the session", f"explore{ENDING}", session, "text/yaml")
            self._session.object = (
                f"{link} <p>It names the log and holds the model, the switches and the snapshots.</p>"
            )

    def _begin_table(self) -> None:
        used = self._tab.used
        if used is not None:
            text = "writing the measurements"
            self._jobs.run(text, lambda: used.frame.to_csv(index=False).encode(), self._written, self._problem.show)

    def _written(self, table: bytes) -> None:
        self._used.object = download("Save the measurements", USED, table, "text/csv")

    def _begin_report(self) -> None:
        tab = self._tab
        text = "diagnosing and reporting"
        self._jobs.run(text, lambda: tab.report(tab.folder / "report.html"), self._made, self._report_problem.show)

    def _made(self, page: bytes) -> None:
        self._report_problem.show("")
        self._report.object = download("Save the report", "report.html", page, "text/html")


_COPY = (
    "<button type='button' class='bns-copy-it' onclick='navigator.clipboard.writeText(this.nextElementSibling.innerText)"
    '.then(() => { this.textContent = "Copied" })\'>Copy</button>'
)


def _to_copy(text: str, identifier: str) -> str:
    return f"{_COPY}<pre class='bns-copy' id='{identifier}' tabindex='0'>{escape(text)}</pre>"
