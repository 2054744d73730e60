"""The diagnosis in the background: begin, watch, stop, and what it found beside every effect."""

from __future__ import annotations

from collections.abc import Callable
from html import escape

import panel as pn

from bns.api.diagnose import DiagnoseResult, diagnose
from bns.app.parts import WIDE, button, heading
from bns.app.screens.working import Working
from bns.app.switches import Term
from bns.app.tab import Tab
from bns.diagnose.report.plain_language import certainty, headline


class DiagnosisPart:
    """``found``: called when there is something new to show; ``switch_on``: with the effects that were found."""

    def __init__(
        self, tab: Tab, found: Callable[[], None], switch_on: Callable[[tuple[str, ...], tuple[Term, ...]], None]
    ) -> None:
        self._tab, self._found, self._switch_to = tab, found, switch_on
        self._work = Working("Diagnose in the background", self._start, lambda: tab.diagnosis, self._show)
        self._switch_on = button("Switch on what it found", self._take)
        self.view = pn.Column(heading("What is missing?"), self._work.buttons, self._switch_on, self._work.said, **WIDE)

    def enter(self) -> None:
        """As the tab has it: at work, done, or not begun."""
        self._switch_on.disabled = True
        self._work.enter()

    def alone(self, name: str) -> str:
        """What an effect earns when added alone, in words; "" while nobody knows."""
        result = self._tab.diagnosis.result
        if result is None or name not in result.ranking.index:
            return ""
        row = result.ranking.loc[name]
        if row["elpd_diff"] is None or row["rejected_because"]:
            return f"alone: not considered: {row['rejected_because']}" if row["rejected_because"] else ""
        return f"alone: {row['elpd_diff']:+.3f} ± {row['dse']:.3f} log-likelihood a trial, p = {row['p_value']:.2g}"

    def ties(self, name: str) -> list[str]:
        """Effects that these data cannot tell from one."""
        result = self._tab.diagnosis.result
        groups = result.diagnosis.as_json()["ties"] if result else []
        return [other for group in groups if name in group for other in group if other != name]

    def _start(self) -> None:
        bench, model = self._tab.bench, self._tab.model
        if bench is not None:
            self._switch_on.disabled = True
            self._tab.diagnosis.start("diagnosing", lambda tell: diagnose(bench.ready.log, model, progress=tell))

    def _take(self) -> None:
        result = self._tab.diagnosis.result
        if result is not None:
            terms = tuple(Term(t.name, t.term, t.on) for t in result.diagnosis.terms)
            self._switch_to(result.effects, terms)

    def _show(self, result: DiagnoseResult) -> None:
        self._switch_on.disabled = not (result.effects or result.diagnosis.terms)
        said, sure = escape(headline(result.diagnosis)), escape(certainty(result.diagnosis))
        words = "".join(f"<br>It looks like this: {escape(each)}." for each in result.diagnosis.terms_in_words)
        self._work.said.object = f"<p id='bns-verdict'><b>{said}</b> {sure}{words}</p>"
        self._found()
