"""The diagnosis in the background: begin, watch, stop, and what it found beside every effect."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from html import escape
from typing import Any

import pandas as pd
import panel as pn

from bns.api.diagnose import DiagnoseResult, diagnose
from bns.app.html import found_errors, found_numbers
from bns.app.parts import WIDE, button, heading
from bns.app.screens.working import Working
from bns.app.switches import Term
from bns.app.tab import Tab
from bns.diagnose.report.plain_language import certainty, headline

_THEN = "<br>Switch it on, see the error fall in the table, and save the mended model on the screen Next."


class DiagnosisPart:
    """``found``: called when there is something new to show; ``switch_on``: with the effects that were found."""

    def __init__(
        self, tab: Tab, found: Callable[[], None], switch_on: Callable[[tuple[str, ...], tuple[Term, ...]], None]
    ) -> None:
        self._tab, self._found, self._switch_to = tab, found, switch_on
        self._work = Working("Diagnose in the background", self._start, lambda: tab.diagnosis, self._show, self._meanwhile)
        self._told = 0
        self._switch_on = button("Switch on what it found", self._take)
        self._work.buttons.append(self._switch_on)
        self.view = pn.Column(heading("What is missing?"), self._work.buttons, self._work.said, **WIDE)

    def enter(self) -> None:
        """As the tab has it: at work, done, or not begun."""
        self._switch_on.disabled = True
        self._work.enter()

    def alone(self, name: str) -> str:
        """What an effect earns when added alone, in words; "" while nobody knows."""
        result = self._tab.diagnosis.result
        if result is None:
            return in_words(self._tab.alone[name], "alone, so far") if name in self._tab.alone else ""
        return in_words(result.ranking.loc[name], "alone") if name in result.ranking.index else ""

    @property
    def terms(self) -> tuple[Term, ...]:
        """Terms that describe what no effect explains; none while nobody knows."""
        result = self._tab.diagnosis.result
        return tuple(Term(t.name, t.term, t.on) for t in result.diagnosis.terms) if result else ()

    def term_in_words(self, name: str) -> str:
        """What a term says, as the summary says it; "" for what is none."""
        result = self._tab.diagnosis.result
        if result is None:
            return ""
        said = zip(result.diagnosis.terms, result.diagnosis.terms_in_words, strict=True)
        return next((words for term, words in said if term.name == name), "")

    def ties(self, name: str) -> list[str]:
        """Effects that these data cannot tell from one."""
        result = self._tab.diagnosis.result
        groups = result.diagnosis.as_json()["ties"] if result else []
        return [other for group in groups if name in group for other in group if other != name]

    def _start(self) -> None:
        bench, model = self._tab.bench, self._tab.model
        if bench is not None and not bench.of_networks:
            self._switch_on.disabled = True
            found: dict[str, Mapping[str, Any]] = {}
            self._tab.alone = found

            def keep(entry: Mapping[str, Any]) -> None:
                found[entry["name"]] = entry

            self._tab.diagnosis.start(
                "diagnosing", lambda tell: diagnose(bench.ready.log, model, progress=tell, alone=keep)
            )

    def _meanwhile(self) -> None:
        """Beside each effect what it earns, as soon as that is known."""
        if len(self._tab.alone) != self._told:
            self._told = len(self._tab.alone)
            self._found()

    def _take(self) -> None:
        result = self._tab.diagnosis.result
        if result is not None:
            self._switch_to(result.effects, self.terms)

    def _show(self, result: DiagnoseResult) -> None:
        self._switch_on.disabled = not (result.effects or result.diagnosis.terms)
        said, sure = escape(headline(result.diagnosis)), escape(certainty(result.diagnosis))
        words = "".join(f"<br>It behaves like this: {escape(each)}." for each in result.diagnosis.terms_in_words)
        errors = result.diagnosis.errors_with_terms or result.diagnosis.errors
        sizes = found_numbers(result.to_json()["parameters"])
        then = "" if self._switch_on.disabled else _THEN
        self._work.said.object = f"<p id='bns-verdict'><b>{said}</b> {sure}{sizes}{words}{then}</p>{found_errors(errors)}"
        self._found()


def in_words(entry: Any, when: str) -> str:
    """What an effect earns by itself, of an entry of the ranking."""
    if entry["rejected_because"]:
        return f"{when}: not considered: {entry['rejected_because']}"
    if pd.isna(entry["elpd_diff"]):
        return ""
    return f"{when}: {entry['elpd_diff']:+.3f} ± {entry['dse']:.3f} log-likelihood per trial, p = {entry['p_value']:.2g}"
