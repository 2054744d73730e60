"""The diagnosis in the background: begin, watch, stop, and what it found beside every effect."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from functools import partial
from typing import Any

import pandas as pd
import panel as pn

from bns.api.diagnose import DiagnoseResult, diagnose
from bns.app.jobs import Jobs
from bns.app.names import call
from bns.app.parts import WIDE, button, heading, row
from bns.app.screens.verdict import verdict_html
from bns.app.screens.working import Working
from bns.app.switches import Term
from bns.app.tab import Tab
from bns.diagnose.design.competing_models import MOST_TIED, Rival

SwitchTo = Callable[[tuple[str, ...], tuple[Term, ...], tuple[str, ...]], None]
"""Called with the effects and terms to switch on, and with those to switch off."""
Offer = tuple[str, tuple[str, ...], tuple[Term, ...], tuple[str, ...]]
"""What a button says, and what `SwitchTo` is called with."""


class DiagnosisPart:
    """``found``: called when there is something new to show; ``switch_to``: with what the user takes of what was found."""

    def __init__(self, tab: Tab, jobs: Jobs, found: Callable[[], None], switch_to: SwitchTo) -> None:
        self._tab, self._jobs, self._found, self._switch_to = tab, jobs, found, switch_to
        self._work = Working("Diagnose in the background", self._start, lambda: tab.diagnosis, self._show, self._meanwhile)
        self._told = 0
        self._of: DiagnoseResult | None = None
        self._others: Sequence[Rival] = ()
        self._offers: list[Offer] = []
        self._buttons = [button("", partial(self._take, n), visible=False) for n in range(MOST_TIED)]
        self.view = pn.Column(heading("What is missing?"), self._work.buttons, self._work.said, row(*self._buttons), **WIDE)

    def enter(self) -> None:
        """As the tab has it: at work, done, or not begun."""
        self._offer([])
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
            self._offer([])
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

    def _show(self, result: DiagnoseResult) -> None:
        known = self._others if self._of is result else ()
        self._say(result, known)
        if result.verdict == "tie" and not known:
            self._jobs.run("fitting the alternatives", lambda: result.rivals, partial(self._say, result), self._work.fail)
        self._found()

    def _say(self, result: DiagnoseResult, others: Sequence[Rival]) -> None:
        if result is not self._tab.diagnosis.result:
            return
        self._of, self._others = result, others
        self._work.said.object = verdict_html(result, others)
        sets = [result.effects, *(other.names for other in others)]
        if others:
            self._offer([(f"Switch on {' and '.join(names)}", names, (), _others(names, sets)) for names in sets])
        elif result.verdict != "tie" and (result.effects or result.diagnosis.terms):
            self._offer([("Switch on what it found", result.effects, self.terms, ())])

    def _offer(self, offers: list[Offer]) -> None:
        """The buttons were made before: one that the browser got late tells the server that it is new, which Bokeh warns of."""
        self._offers = offers
        for n, each in enumerate(self._buttons):
            each.visible = n < len(offers)
            call(each, offers[n][0] if n < len(offers) else "")

    def _take(self, number: int) -> None:
        if number < len(self._offers):
            self._switch_to(*self._offers[number][1:])


def _others(names: tuple[str, ...], sets: Sequence[tuple[str, ...]]) -> tuple[str, ...]:
    """What stands against an explanation: of a tie one is on at a time."""
    return tuple(dict.fromkeys(each for one in sets for each in one if each not in names))


def in_words(entry: Any, when: str) -> str:
    """What an effect earns by itself, of an entry of the ranking."""
    if entry["rejected_because"]:
        return f"{when}: not considered: {entry['rejected_because']}"
    if pd.isna(entry["elpd_diff"]):
        return ""
    return f"{when}: {entry['elpd_diff']:+.3f} ± {entry['dse']:.3f} log-likelihood per trial, p = {entry['p_value']:.2g}"
