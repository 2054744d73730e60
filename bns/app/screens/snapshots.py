"""Named states of the switches, side by side on the same windows, and the way back to each."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import panel as pn

from bns.app.html import change_text, mm, table
from bns.app.jobs import Jobs
from bns.app.names import called
from bns.app.parts import WIDE, Problem, button, heading, html, offer, row
from bns.app.switches import Switches
from bns.app.tab import Tab
from bns.app.workbench import Shown
from bns.diagnose.report.tables import ahead

MOST = 12
"""More rows nobody compares at a glance."""


class SnapshotsPart:
    """``go_to``: called with the state that the user wants back; ``horizon``: tells which one is shown."""

    def __init__(self, tab: Tab, jobs: Jobs, go_to: Callable[[Switches], None], horizon: Callable[[], str]) -> None:
        self._tab, self._jobs, self._go_to, self._horizon = tab, jobs, go_to, horizon
        self._name = pn.widgets.TextInput(**called("Name of the snapshot"), placeholder="with lag", width=180)
        self._chosen = pn.widgets.Select(**called("Snapshot"), options=[], width=180)
        self._table, self._problem = html(), Problem()
        self._there = row(
            self._chosen, button("Go back to it", self._back), button("Forget it", self._forget), align_items="end"
        )
        keep = row(self._name, button("Keep a snapshot", self._keep), align_items="end")
        self.view = pn.Column(heading("Snapshots"), keep, self._problem.view, self._there, self._table, **WIDE)

    def enter(self) -> None:
        """As the tab has them; what was not fitted yet is fitted beside the page."""
        bench, kept = self._tab.bench, dict(self._tab.snapshots)
        offer(self._chosen, list(kept))
        self._there.visible = self._table.visible = bool(kept)
        if bench is None or not kept:
            return
        self._jobs.run(
            "fitting the snapshots",
            lambda: {name: bench.shown(state) for name, state in kept.items()},
            self._show,
            self._problem.show,
        )

    def _show(self, shown: dict[str, Shown]) -> None:
        horizon = self._horizon()
        rows = [_row(name, each, horizon) for name, each in shown.items()]
        columns = ["snapshot", "effects", "error, mm", "95 %", "change from the model as given, mm (95 %)"]
        caption = f"Position error {ahead(horizon)} ahead; all snapshots on the same windows of held-out trials"
        self._table.object = table(columns, rows, caption, "bns-snapshots")

    def _keep(self) -> None:
        name = (self._name.value_input or self._name.value).strip()
        state = self._tab.now
        if not name:
            name = ", ".join(state.on) or "as given"
        if name not in self._tab.snapshots and len(self._tab.snapshots) >= MOST:
            self._problem.show(f"There are {MOST} snapshots; forget one first.")
            return
        self._problem.show("")
        self._tab.snapshots[name] = state
        self.enter()
        self._chosen.value = name

    def _back(self) -> None:
        if self._chosen.value in self._tab.snapshots:
            self._go_to(self._tab.snapshots[self._chosen.value])

    def _forget(self) -> None:
        self._tab.snapshots.pop(self._chosen.value, None)
        self.enter()


def _row(name: str, shown: Shown, horizon: str) -> list[Any]:
    errors = shown.errors.horizons[horizon]
    last = errors.models[-1]
    added = ", ".join(shown.switches.on) or "none"
    by_hand = " (parameters set by hand)" if shown.switches.by_hand else ""
    interval = f"{mm(last.low_m)} to {mm(last.high_m)}"
    return [name, added + by_hand, mm(last.rms_m), interval, change_text(errors.total) if errors.total else ""]
