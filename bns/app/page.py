"""One page: five screens, of which one is shown, and a line that says what is at work."""

from __future__ import annotations

from html import escape
from typing import Any

import panel as pn

from bns.app.design import template
from bns.app.jobs import Jobs
from bns.app.parts import WIDE, html, on_change
from bns.app.screens.data import DataScreen
from bns.app.screens.effects import EffectsScreen
from bns.app.screens.model import ModelScreen
from bns.app.screens.next import NextScreen
from bns.app.screens.where import WhereScreen
from bns.app.tab import Tab, Tabs
from bns.app.web.connection import watch_connection

TITLE = "bns explore"
SCREENS: dict[str, Any] = {
    "Data": DataScreen,
    "Model": ModelScreen,
    "Where it fails": WhereScreen,
    "Effects": EffectsScreen,
    "Next": NextScreen,
}


def page(tabs: Tabs) -> Any:
    """The page of the tab that the address names; a reload shows the same tab, a new address a new one."""
    asked = pn.state.session_args.get("tab", [b""])[0].decode("ascii", "replace")
    name, tab = tabs.get(asked)
    made = template(TITLE)
    watch_connection(pn.state.curdoc)
    made.main.append(Screens(tab, name).view)
    return made


class Screens:
    """The screens of a tab; a screen is made when it is first entered, and drawn again whenever it is."""

    def __init__(self, tab: Tab, name: str) -> None:
        self._said = html('<p class="bns-say" role="status"></p>')
        self._jobs = Jobs(pn.state.curdoc, self._say, self._changed)
        self._tab, self._screens = tab, dict[str, Any]()
        names = list(SCREENS)
        self._chosen = pn.widgets.RadioButtonGroup(
            name="Screen",
            options=names,
            value=tab.screen or ("Effects" if tab.bench else names[0]),
            button_type="primary",
            button_style="outline",
            **WIDE,
        )
        on_change(self._chosen, lambda: self._enter(self._chosen.value))
        self._shown = pn.Column(**WIDE)
        self.view = pn.Column(self._chosen, self._said, self._shown, **WIDE)
        pn.state.onload(lambda: self._loaded(name))
        pn.state.on_session_destroyed(lambda _context: self._jobs.end())

    def _loaded(self, name: str) -> None:
        pn.state.location.update_query(tab=name)
        self._enter(self._chosen.value)

    def _enter(self, name: str) -> None:
        first = name not in self._screens
        if first:
            self._screens[name] = SCREENS[name](self._tab, self._jobs)
        self._tab.screen = name
        screen = self._screens[name]
        # drawn before the browser gets it: what changes afterwards could overtake it
        screen.enter()
        if first:
            self._shown.append(screen.view)
        # hidden, not taken out: what is on its way to a screen must still find it there
        for other, one in self._screens.items():
            one.view.visible = other == name

    def _changed(self, by: object) -> None:
        screen = self._screens[self._chosen.value]
        if screen is not by:
            screen.enter()

    def _say(self, text: str) -> None:
        self._said.object = f'<p class="bns-say" role="status">{escape(text)}{" …" if text else ""}</p>'
