"""What is odd about a log, a box for each: what is checked is left out, with all around it."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import Any

import panel as pn

from bns.app.log.part import Part
from bns.app.parts import WIDE, html, on_change
from bns.app.tab import Tab
from bns.diagnose.data.checks import Finding

MOST = 200
"""More lines nobody reads; the first so many are listed."""
_WRAPPED = "label { white-space: normal; overflow-wrap: anywhere; } :host { max-height: 26em; overflow-y: auto; }"


class FindingsPart:
    """``changed``: called with what takes part then."""

    def __init__(self, tab: Tab, changed: Callable[[Part], None]) -> None:
        self._tab, self._changed, self._quiet = tab, changed, False
        self._said = html()
        self._boxes = pn.widgets.CheckBoxGroup(options={}, stylesheets=[_WRAPPED], **WIDE)
        on_change(self._boxes, lambda: None if self._quiet else self._checked(self._boxes.value))
        self.view = pn.Column(self._said, self._boxes, visible=False, **WIDE)

    def enter(self) -> None:
        """Those of the tab's log."""
        log = self._tab.log
        self.view.visible = log is not None
        if log is None:
            return
        found = log.measured.findings
        self._said.object = _about(found)
        self._quiet = True
        self._boxes.options = {in_words(f): i for i, f in enumerate(found[:MOST])}
        self._boxes.value = [i for i, f in enumerate(found[:MOST]) if f.row in self._tab.part.findings]
        self._quiet = False

    def _checked(self, chosen: Sequence[Any]) -> None:
        log = self._tab.log
        assert log is not None
        listed, before = log.measured.findings[:MOST], set(self._tab.part.findings)
        rows = {listed[i].row for i in chosen}
        gone = {f.row for i, f in enumerate(listed) if i not in chosen and f.row in before and f.row in rows}
        self._changed(replace(self._tab.part, findings=tuple(sorted(rows - gone))))


def in_words(finding: Finding) -> str:
    """A finding as it is listed."""
    return f"trial {finding.trial}, row {finding.row}: {finding.text}"


def _about(found: Sequence[Finding]) -> str:
    """What the list is."""
    if not found:
        return "<p>No irregularities in the data.</p>"
    more = f" (the first {MOST} of {len(found)})" if len(found) > MOST else ""
    return (
        f"<p id='bns-findings'>Irregularities{more}. Check a line to exclude the poses around it; no prediction "
        "window then spans them.</p>"
    )
