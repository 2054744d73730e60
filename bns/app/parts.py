"""Widgets that every screen has: panes with the page's style, messages beside fields, buttons."""

from __future__ import annotations

import base64
from collections.abc import Callable, Mapping, Sequence
from contextlib import AbstractContextManager, nullcontext
from html import escape
from importlib import resources
from typing import Any

import panel as pn

from bns.app.html import message
from bns.app.names import called, looking

CSS = (resources.files("bns.app") / "style.css").read_text(encoding="utf-8")
NO_WIDER = {"max-width": "calc(100vw - 28px)"}
"""What is wider than the window (a table) scrolls by itself; without this it would push everything beside it out of sight."""
WIDE: dict[str, Any] = {"sizing_mode": "stretch_width", "styles": NO_WIDER}
_ON_TOP = "@media (max-width: 720px) { :host { order: -1; } }"
_IN_VIEW = """
@media (min-width: 721px) {
  :host { position: sticky; top: 0; align-self: flex-start; max-height: calc(100vh - 80px); overflow-y: auto; }
}
"""


def html(text: str = "", **more: Any) -> Any:
    """A pane of HTML that was put together by `bns.app.html`, which escapes."""
    return pn.pane.HTML(text, stylesheets=[CSS], **{**WIDE, "margin": (4, 8), **more})


def heading(text: str) -> Any:
    """Of a part of a screen."""
    return html(f"<h2 style='font-size:17px;margin:4px 0'>{text}</h2>")


def together() -> AbstractContextManager[None]:
    """What is changed inside goes to the browser in one message, in the order in which it was changed.

    Else what Panel changes (layouts, texts) goes at once, and what is changed of a picture only at the end: one could name a part
    that the browser gets with the other, later.
    """
    if not pn.state.loaded:  # the browser gets the page as a whole; what is held back until then, Panel drops
        return nullcontext()
    held: AbstractContextManager[None] = pn.io.hold()
    return held


def on_change(widget: Any, act: Callable[[], object], what: str = "value") -> None:
    """``act`` whenever the user, or the page itself, changes something of a widget.

    Everything that changes with a widget goes through here: where a click follows at once on what was typed, Panel tells what was
    typed before Bokeh has locked the page, and a picture changed then, outside `together`, is refused.
    """

    def changed(_event: Any) -> None:
        with together():
            act()

    widget.param.watch(changed, what)


def button(name: str, clicked: Callable[[], object], kind: str = "default", **more: Any) -> Any:
    """A button that does something."""
    made = pn.widgets.Button(**called(name), **looking(kind), width=None, **more)
    on_change(made, clicked, "clicks")
    return made


def offer(menu: Any, options: Mapping[str, Any] | Sequence[Any]) -> None:
    """What a menu holds: as chosen where that is among it, else the first, which Panel takes only for a menu on the page."""
    values = list(options.values()) if isinstance(options, Mapping) else list(options)
    menu.options = options
    if menu.value not in values:
        menu.value = values[0] if values else None


def drawn(figure: Any) -> Any:
    """A Bokeh figure that takes the width there is."""
    return pn.pane.Bokeh(figure, **WIDE)


def row(*parts: Any, **more: Any) -> Any:
    """Small parts in a line, which is broken where there is no room."""
    return pn.FlexBox(*parts, **{**WIDE, **more})


def beside(*parts: Any, least: int = 300, first: Any = None, in_view: bool = False) -> Any:
    """Parts next to each other where there is room, below each other where there is none.

    ``first`` is on top then. ``in_view``: and stays in view else, however far one scrolls the parts beside it.
    """
    styles = {"flex": f"1 1 {least}px", "min-width": f"min({least}px, calc(100vw - 28px))", **NO_WIDER}
    of_first = [_ON_TOP, _IN_VIEW] if in_view else [_ON_TOP]
    cells = [pn.Column(part, stylesheets=of_first if part is first else [], **{**WIDE, "styles": styles}) for part in parts]
    return pn.Row(*cells, **{**WIDE, "styles": {"flex-wrap": "wrap", "gap": "8px", **NO_WIDER}})


def download(name: str, filename: str, content: bytes, kind: str) -> str:
    """A link, as HTML, that saves ``content``: a real one, which the keyboard reaches as well."""
    data = base64.b64encode(content).decode()
    return f'<a class="bns-download" download="{escape(filename)}" href="data:{kind};base64,{data}">{escape(name)}</a>'


class Problem:
    """Where the library's message stands, beside the field that it is about."""

    def __init__(self) -> None:
        self.view = html()

    def show(self, text: str) -> None:
        """The message; "" takes it away."""
        self.view.object = message(text)
