"""Pieces of the page as HTML: every text that comes from a log, a file or a user is escaped."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from html import escape
from typing import Any

import numpy as np

from bns.diagnose.predict.paired_errors import Change, HorizonErrors, PairedErrors
from bns.diagnose.report.plain_language import figures_in_words
from bns.diagnose.report.tables import ahead
from bns.physics.effect import Effect
from bns.physics.figures import with_unit

_SMALL = re.compile(r"[-+]?[\d.]+e-\d+")
"""A number with a hyphen in it."""
_MOST_ROWS = 12
"""A table with more scrolls upwards and downwards by itself; one with fewer is shown whole."""
BADGE = '<span class="bns-badge">{}</span>'


def table(columns: Sequence[str], rows: Sequence[Sequence[Any]], caption: str = "", identifier: str = "") -> str:
    """A table that scrolls sideways by itself, a long one upwards as well; the first cell of a row is its heading."""
    head = "".join(f'<th scope="col">{escape(str(c))}</th>' for c in columns)
    body = "".join(
        f'<tr><th scope="row">{escape(str(row[0]))}</th>'
        + "".join(_cell(str(v)) for v in row[1:])
        + "</tr>"
        for row in rows
    )
    title = f"<caption>{escape(caption)}</caption>" if caption else ""
    scrolls = "bns-scroll bns-long" if len(rows) > _MOST_ROWS else "bns-scroll"
    return (
        f'<div class="{scrolls}" tabindex="0"><table class="bns-table" id="{escape(identifier)}">{title}'
        f"<thead><tr>{head}</tr></thead><tbody>{body}</tbody></table></div>"
    )


def _cell(text: str) -> str:
    """A browser breaks lines at the hyphen of 5e-05; in a number it must not."""
    number = ' class="bns-number"' if _SMALL.fullmatch(text) else ""
    return f"<td{number}>{escape(text)}</td>"


def error_list(e: HorizonErrors) -> str:
    """The models one after the other at a horizon, mm, with the change from the one before."""
    rows = []
    for index, m in enumerate(e.models):
        change = e.changes[index - 1] if index else None
        rows.append(
            [
                m.name if index == 0 or m.name == "by hand" else f"+ {m.name}",
                mm(m.rms_m),
                f"{mm(m.low_m)} to {mm(m.high_m)}" if np.isfinite(m.low_m) else "too few trials",
                mm(m.median_m),
                change_text(change) if change else "",
            ]
        )
    rows.append(["noise of the tracking", mm(e.noise_floor_m), "", "", ""])
    caption = f"Position error {ahead(e.horizon)} ahead, on {e.windows} windows of held-out trials, the same for all models"
    left_out = f" ({e.left_out} excluded: the tracker jumps within them, or poses were excluded)" if e.left_out else ""
    columns = ["model", "error, mm", "95 %", "median, mm", "change, mm (95 %)"]
    return table(columns, rows, caption + left_out, "bns-errors")


def found_errors(errors: PairedErrors | None) -> str:
    """What a diagnosis says of the errors before and after, at every horizon, as its summary does."""
    if errors is None:
        return ""
    rows = []
    for horizon, e in errors.horizons.items():
        for index, m in enumerate(e.models if e.windows else ()):
            change = change_text(e.changes[index - 1]) if index else ""
            rows.append([ahead(horizon) if index == 0 else "", m.name, mm(m.rms_m), mm(m.median_m), change])
    columns = ["ahead", "model", "error, mm", "median, mm", "change, mm (95 %)"]
    found = table(columns, rows, "Position error on held-out trials, all on the same windows", "bns-found")
    return f"<details><summary>the errors before and after, at every horizon</summary>{found}</details>"


def found_numbers(numbers: Mapping[str, Mapping[str, Mapping[str, Any]]]) -> str:
    """How large the effects are that a diagnosis found, with intervals, as `bns add` has them."""
    said = [
        f"<br>{escape(effect)}: <b>{escape(name)}</b> = {_in_words(n)}"
        for effect, of_effect in numbers.items()
        for name, n in of_effect.items()
        if n["value"] is not None
    ]
    return "".join(said)


def change_text(c: Change) -> str:
    """A change with its interval, and whether it is one."""
    if not np.isfinite(c.low_m):
        return f"{1e3 * c.change_m:+.2f}"
    said = "falls" if c.fell else "rises" if c.rose else "undecided"
    return f"{1e3 * c.change_m:+.2f} ({1e3 * c.low_m:+.2f} to {1e3 * c.high_m:+.2f}) {said}"


def mm(metres: float) -> str:
    """Millimetres, two decimals; a question mark where nobody knows."""
    return f"{1e3 * metres:.2f}" if np.isfinite(metres) else "?"


def effect_text(effect: Effect, badges: Sequence[str], numbers: Mapping[str, Mapping[str, Any]], alone: str) -> str:
    """What an effect is, what it looks like, its fitted numbers, what it earns alone, and what to beware of."""
    fitted = "".join(
        f"<br><b>{escape(name)}</b> = {n['value']:.5g}{escape(with_unit(n['unit']))} ({_in_words(n)})"
        for name, n in numbers.items()
        if n["value"] is not None
    )
    like = f"<br>Looks like: {escape(', '.join(effect.lookalikes))}." if effect.lookalikes else ""
    return (
        f'<div class="bns-effect"><code>{escape(effect.equation)}</code> {"".join(BADGE.format(escape(b)) for b in badges)}'
        f"{fitted}{f'<br>{escape(alone)}' if alone else ''}"
        f"<details><summary>what it looks like</summary>{escape(effect.residuals)}{like}</details></div>"
    )


def _in_words(n: Mapping[str, Any]) -> str:
    """A number with its 95 % interval, in units for people."""
    value, interval = figures_in_words(n["value"], n["low"], n["high"], n["unit"])
    return escape(f"{value}; 95 %: {interval}" if interval else value)


def note(text: str) -> str:
    """What should be known beside a table."""
    return f"<p class='bns-note'>{escape(text)}.</p>" if text else ""


def message(text: str) -> str:
    """The library's own message, beside the field that it is about."""
    return f'<p class="bns-error" role="alert">{escape(text)}</p>' if text else ""
