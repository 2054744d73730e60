"""What is written on widgets and how buttons look, under the names that this Panel has: those of 1.5 are on their way out."""

from __future__ import annotations

from typing import Any

import panel as pn

_LABEL = "label" if "label" in pn.widgets.Widget.param else "name"
_COLOUR, _STYLE = ("color", "variant") if "color" in pn.widgets.Button.param else ("button_type", "button_style")


def called(text: str) -> dict[str, str]:
    """The argument of a widget that has this text written on it."""
    return {_LABEL: text}


def call(widget: Any, text: str) -> None:
    """Write something else on it."""
    setattr(widget, _LABEL, text)


def text_on(widget: Any) -> str:
    """What is written on it."""
    return str(getattr(widget, _LABEL))


def looking(colour: str, style: str = "solid") -> dict[str, str]:
    """The arguments of a button's looks: default or primary; solid or outline."""
    return {_COLOUR: colour, _STYLE: style}
