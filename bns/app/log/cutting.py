"""Trials cut shorter: brush the stretch that is kept along the time of a trial, or type its ends."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import panel as pn

from bns.app.figures.time_axis import Stretch, TimeAxisFigure
from bns.app.log.part import Part
from bns.app.names import called
from bns.app.parts import WIDE, button, drawn, heading, offer, on_change, row
from bns.app.tab import Tab


class CutPart:
    """``changed``: called with what takes part then."""

    def __init__(self, tab: Tab, changed: Callable[[Part], None]) -> None:
        self._tab, self._changed = tab, changed
        self._picture = TimeAxisFigure(self._brushed)
        self._trial = pn.widgets.Select(**called("Trial to cut"), options=[], width=160)
        self._from = pn.widgets.FloatInput(**called("keep from (s)"), value=0.0, step=0.1, width=110)
        self._to = pn.widgets.FloatInput(**called("to (s)"), value=0.0, step=0.1, width=110)
        self._keep = button("Keep only this stretch", self._cut)
        self._whole = button("Keep the whole trial", lambda: self._to_part(None))
        self._place = pn.Column(**WIDE)
        self._log: object = None
        on_change(self._trial, self._show)
        for end in (self._from, self._to):
            on_change(end, lambda: self._picture.keep(self._typed()))
        ends = row(self._trial, self._from, self._to, self._keep, self._whole, align_items="end")
        self.view = pn.Column(heading("Cut a trial: brush the part to keep"), ends, self._place, visible=False, **WIDE)

    def refresh(self) -> None:
        """The trials of the tab's log."""
        log = self._tab.log
        self.view.visible = log is not None
        if log is None:
            return
        if log is not self._log:
            self._log = log
            offer(self._trial, list(log.measured.tracks.names))
        self._show()
        if not self._place.objects:  # once there is something on it: a picture that is hidden has no size to begin with
            self._place.objects = [drawn(self._picture.figure)]

    def _show(self) -> None:
        log, name = self._tab.log, self._trial.value
        if log is None or name not in log.measured.tracks.names:
            return
        tracks = log.measured.tracks
        number = tracks.names.index(name)
        frames = slice(tracks.first[number], tracks.first[number + 1])
        rows, time_s = log.times_of(name)
        mine = [f for f in log.measured.findings if f.trial == name]
        odd = [(float(time_s[np.searchsorted(rows, f.row)]), f.text) for f in mine if rows[0] <= f.row <= rows[-1]]
        self._picture.fill(f"Trial {name}", tracks.own_s[frames], tracks.pose[frames], odd)
        kept = next(((a, b) for trial, a, b in self._tab.part.cuts if trial == name), None)
        self._from.value, self._to.value = kept or (0.0, round(float(time_s[-1]), 3))
        self._picture.keep(kept)

    def _brushed(self, stretch: Stretch) -> None:
        self._from.value, self._to.value = round(max(stretch[0], 0.0), 3), round(stretch[1], 3)

    def _typed(self) -> Stretch:
        return float(self._from.value or 0.0), float(self._to.value or 0.0)

    def _cut(self) -> None:
        self._to_part(self._typed())

    def _to_part(self, kept: Stretch | None) -> None:
        name = str(self._trial.value)
        others = tuple(cut for cut in self._tab.part.cuts if cut[0] != name)
        cuts = others if kept is None else (*others, (name, *kept))
        self._changed(replace(self._tab.part, cuts=cuts))
