"""One page: five screens, of which one is shown, and a line that says what is at work."""

from __future__ import annotations

from html import escape
from itertools import pairwise
from typing import Any

import panel as pn

from bns.app.design import template
from bns.app.jobs import Jobs
from bns.app.names import call, called, looking
from bns.app.parts import WIDE, button, html, on_change, row
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
            **called("Screen"),
            options=names,
            value=tab.screen or ("Effects" if tab.bench else names[0]),
            **looking("primary", "outline"),
            **WIDE,
        )
        on_change(self._chosen, lambda: self._enter(self._chosen.value))
        self._shown = pn.Column(**WIDE)
        self._on = button("", self._go_on)
        self._name_next()
        self.view = pn.Column(self._chosen, row(self._on, self._said, align_items="center"), self._shown, **WIDE)
        self._making = ""
        self._document = pn.state.curdoc
        pn.state.onload(lambda: self._loaded(name))
        pn.state.on_session_destroyed(lambda _context: self._jobs.end())
        self._document.add_next_tick_callback(self._make_first)

    def _loaded(self, name: str) -> None:
        pn.state.location.update_query(tab=name)
        self._jobs.begin()

    async def _make_first(self) -> None:
        """The screen that is shown first is made beside the page, while the browser still reads its files."""
        self._making = name = self._chosen.value

        def add(screen: Any) -> None:
            self._making = ""
            self._add(name, screen)

        await self._jobs.first(lambda: self._made(name), add)

    def _name_next(self) -> None:
        """What comes next, for somebody who sees the page for the first time."""
        following = [name for before, name in pairwise(SCREENS) if before == self._chosen.value]
        self._on.visible = bool(following)
        call(self._on, f"Continue: {following[0]}" if following else "")

    def _go_on(self) -> None:
        self._chosen.value = next(name for before, name in pairwise(SCREENS) if before == self._chosen.value)

    def _enter(self, name: str) -> None:
        self._tab.screen = name
        self._name_next()
        if name == self._making:
            return
        if name not in self._screens:
            self._add(name, self._made(name))
            return
        self._screens[name].enter()
        self._show()

    def _made(self, name: str) -> Any:
        """Drawn before the browser gets it: what changes afterwards could overtake it."""
        screen = SCREENS[name](self._tab, self._jobs)
        screen.enter()
        return screen

    def _add(self, name: str, screen: Any) -> None:
        self._screens[name] = screen
        self._shown.append(screen.view)
        self._show()

    def _show(self) -> None:
        """Hidden, not taken out: what is on its way to a screen must still find it there."""
        for name, screen in self._screens.items():
            screen.view.visible = name == self._chosen.value

    def _changed(self, by: object) -> None:
        screen = self._screens.get(self._chosen.value)
        if screen is not None and screen is not by:
            screen.enter()

    def _say(self, text: str) -> None:
        self._said.object = f'<p class="bns-say" role="status">{escape(text)}{" …" if text else ""}</p>'
