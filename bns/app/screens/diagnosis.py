"""The diagnosis in the background: begin, watch, stop, and what it found beside every effect."""

from __future__ import annotations

from collections.abc import Callable
from html import escape
from typing import Any

import panel as pn

from bns.app.html import message
from bns.app.parts import WIDE, button, heading, html, row
from bns.app.tab import Tab
from bns.diagnose.report.plain_language import certainty, headline

_EVERY_MS = 500


class DiagnosisPart:
    """``found``: called when there is something new to show; ``switch_on``: with the effects that were found."""

    def __init__(self, tab: Tab, found: Callable[[], None], switch_on: Callable[[tuple[str, ...]], None]) -> None:
        self._tab, self._found, self._switch_to = tab, found, switch_on
        self._said = html()
        self._begin = button("Diagnose in the background", self._start, "primary")
        self._stop = button("Stop", self._end)
        self._switch_on = button("Switch on what it found", self._take)
        self._clock: Any = None
        buttons = row(self._begin, self._stop, self._switch_on)
        self.view = pn.Column(heading("What is missing?"), buttons, self._said, **WIDE)

    def enter(self) -> None:
        """As the tab has it: at work, done, or not begun."""
        if self._tab.diagnosis.at_work and self._clock is None:
            self._clock = pn.state.add_periodic_callback(self._look, period=_EVERY_MS)
        self._look()

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
        if self._tab.bench is not None:
            self._tab.diagnosis.start(self._tab.bench.ready.log, self._tab.model)
            self.enter()

    def _end(self) -> None:
        self._tab.diagnosis.stop()
        self._look()

    def _take(self) -> None:
        result = self._tab.diagnosis.result
        if result is not None:
            self._switch_to(result.effects)

    def _look(self) -> None:
        work = self._tab.diagnosis
        self._begin.disabled, self._stop.disabled = work.at_work, not work.at_work
        result = work.result
        self._switch_on.disabled = result is None or not result.effects
        if work.at_work:
            self._said.object = f"<p>{escape(work.progress)}</p>"
            return
        if self._clock is not None:
            self._clock.stop()
            self._clock = None
        if result is not None:
            said, sure = escape(headline(result.diagnosis)), escape(certainty(result.diagnosis))
            self._said.object = f"<p id='bns-verdict'><b>{said}</b> {sure}</p>"
        else:
            self._said.object = message(work.why)
        self._found()
