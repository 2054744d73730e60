"""The one order in which approaches are drawn and listed, and how each looks, whichever of them a figure has."""

from __future__ import annotations

from collections.abc import Iterable
from itertools import groupby
from typing import Any

from bns.options import OPTION_MARK
from bns.plotting.style import OKABE_ITO

ORDER = (
    *("bns", "on-robot", "precomputed", "then-on-robot", "anytime"),
    *("estimation-exploration", "transferability", "back-to-reality"),
)
"""As in the table of docs/approaches.md; those of packages come after them, by name."""
_COLOURS = dict(zip(ORDER, (*OKABE_ITO, "#882255"), strict=True))
"""The eighth, wine, is of Paul Tol's muted scheme: there are seven in that of Okabe and Ito, without its yellow."""
_OF_PACKAGES = "#999999"
_LINES = ("-", "--", "-.", ":", (0, (5, 1, 1, 1, 1, 1)), (0, (1, 1)))
Look = dict[str, Any]


def in_order(approaches: Iterable[str]) -> list[str]:
    """Each once, in `ORDER`, without options before with options."""
    return sorted(set(approaches), key=_place)


def looks(approaches: Iterable[str]) -> dict[str, Look]:
    """Colour and line of each: the colour says which approach, the line with which options.

    ``approaches`` are all that the figures of one page may show, so that a curve looks the same in each of them.
    """
    return {
        name: {"color": _COLOURS.get(base, _OF_PACKAGES), "linestyle": _LINES[number % len(_LINES)]}
        for base, own in groupby(in_order(approaches), key=lambda name: _base(name) if _base(name) in ORDER else "")
        for number, name in enumerate(own)
    }


def _place(name: str) -> tuple[int, str, str]:
    base = _base(name)
    return (ORDER.index(base) if base in ORDER else len(ORDER), base, name)


def _base(name: str) -> str:
    return name.split(OPTION_MARK, maxsplit=1)[0]
