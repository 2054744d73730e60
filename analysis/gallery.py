"""The page: every figure with its caption, from the captions that stand beside the figures."""

from __future__ import annotations

import html
from collections import Counter
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

from analysis.labels import source_position
from analysis.publish import captions
from bns.plotting.style import COLUMN_IN, PAGE_IN
from bns.store.disk.files import publish

STYLE_SHEET = Path(__file__).with_name("page.css")
FIRST = "findings"
"""Figures whose names begin so stand on top of the page, and on one of their own."""
PIXELS_IN = 96
"""CSS pixels in an inch: figures stand on the page in the size they are made for."""


def write_page(out: Path, refresh_s: int | None = None) -> Path:
    """Write ``out``/index.html, and findings.html with the findings alone; with ``refresh_s`` both reload. Path of the first."""
    found = captions(out)
    findings = [one for one in found if one["name"].startswith(FIRST)]
    for name, shown in (("findings", findings), ("index", found)):
        publish(page(shown, out, refresh_s).encode(), out / f".{name}.html.part", out / f"{name}.html")
    return out / "index.html"


def page(found: list[dict[str, Any]], out: Path, refresh_s: int | None = None) -> str:
    """The whole page as HTML, with its one style sheet inside: it works from the file system and can be mailed."""
    drawn = _told_apart(sorted((one for one in found if "skipped" not in one), key=_place))
    skipped = [one for one in found if "skipped" in one]
    reload = f'<meta http-equiv="refresh" content="{refresh_s}">' if refresh_s else ""
    sections = "\n".join(_section(one, out) for one in drawn)
    return f"""<!doctype html>
<html lang="en">
<head>
<meta charset="utf-8">
<meta name="viewport" content="width=device-width, initial-scale=1">
{reload}
<title>Bootstrapped Neuro-Simulation: figures</title>
<style>
{STYLE_SHEET.read_text()}</style>
</head>
<body>
<h1>Bootstrapped Neuro-Simulation: what the results say</h1>
{_summary(drawn, refresh_s)}
{_contents(drawn)}
{sections}
{_not_drawn(skipped)}
</body>
</html>
"""


def _place(caption: dict[str, Any]) -> tuple[Any, ...]:
    return (not caption["name"].startswith(FIRST), source_position(caption["paper"]), caption["name"])


def _told_apart(drawn: list[dict[str, Any]]) -> list[dict[str, Any]]:
    """The captions with different titles: figures of several robots are told apart by the ends of their names."""
    several = Counter(one["title"] for one in drawn)
    return [
        one | {"title": f"{one['title']}, {one['name'].rpartition('-')[2]}"} if several[one["title"]] > 1 else one
        for one in drawn
    ]


def _summary(drawn: list[dict[str, Any]], refresh_s: int | None) -> str:
    sweeps = sorted({sweep for one in drawn for sweep in one["sweeps"]})
    again = f" This page reloads every {refresh_s} seconds." if refresh_s else ""
    what = f"Figures and tables: {len(drawn)}, of the sweeps {', '.join(sweeps)}." if drawn else "Nothing could be drawn yet."
    when = datetime.now(UTC).strftime("%Y-%m-%d %H:%M:%S UTC")
    return f'<p>{_text(what)}{again}</p>\n<p class="small">Drawn {when}.</p>'


def _contents(drawn: list[dict[str, Any]]) -> str:
    items = "\n".join(
        f'<li><a href="#{one["name"]}">{_text(one["title"])}</a> <span class="paper">{_text(one["paper"])}</span></li>'
        for one in drawn
    )
    return f"<nav><ol>\n{items}\n</ol></nav>" if drawn else ""


def _section(one: dict[str, Any], out: Path) -> str:
    parts = [
        f'<section id="{one["name"]}">',
        f'<h2>{_text(one["title"])} <span class="paper">{_text(one["paper"])}</span></h2>',
        f'<p class="see">{_text(one["see"])}</p>' if one["see"] else "",
        _picture(one, out),
        _table(one["table"]),
        f"<p>{_text(one['shows'])}</p>",
        f'<p class="missing">{_text("; ".join(one["missing"]))}.</p>' if one["missing"] else "",
        f'<p class="small">{_origin(one)}</p>',
        "</section>",
    ]
    return "\n".join(part for part in parts if part)


def _picture(one: dict[str, Any], out: Path) -> str:
    name = next((file for file in one["files"] if file.endswith(".svg")), None)
    if name is None:
        return ""
    width_in = PAGE_IN if _is_wide(out / name) else COLUMN_IN
    # A little larger than in print: a screen is read from further away.
    width = round(1.25 * width_in * PIXELS_IN)
    return f'<div class="picture"><img src="{name}" width="{width}" alt="{_text(one["title"])}: {_text(one["shows"])}"></div>'


def _is_wide(svg: Path) -> bool:
    try:
        head = svg.read_text()[:1000]
    except OSError:
        return True
    width = head.partition('width="')[2].partition("pt")[0]
    return float(width or PAGE_IN * 72) > (COLUMN_IN + PAGE_IN) / 2 * 72


def _table(table: dict[str, list[Any]] | None) -> str:
    if table is None:
        return ""
    verdicts = {"agrees", "differs", "undecided"}
    head = "".join(f"<th>{_text(name)}</th>" for name in table["columns"])
    body = "\n".join(
        "<tr>"
        + "".join(
            f'<td class="verdict {value}">{value}</td>' if value in verdicts else f"<td>{_text(value)}</td>" for value in row
        )
        + "</tr>"
        for row in table["rows"]
    )
    return f'<div class="table"><table>\n<thead><tr>{head}</tr></thead>\n<tbody>\n{body}\n</tbody>\n</table></div>'


def _origin(one: dict[str, Any]) -> str:
    links = ", ".join(f'<a href="{file}">{file.rpartition(".")[2].upper()}</a>' for file in one["files"])
    commits = ", ".join(_commit(git) for git in one["git"])
    said = [
        f"n = {one['n']:,} runs",
        f"sweeps: {', '.join(one['sweeps'])}",
        f"specs: {', '.join(one['spec_hashes']) or 'none (runs by hand)'}",
        f"commits: {commits or 'unknown'}",
        f"bns {', '.join(one['bns_versions'])}",
    ]
    return f"{_text(' · '.join(said))} · {links}"


def _commit(git: dict[str, Any]) -> str:
    state = {True: "", False: " (changed)", None: " (unknown state)"}[git["clean"]]
    return f"{git['sha'][:12] or 'no checkout'}{state}"


def _not_drawn(skipped: list[dict[str, Any]]) -> str:
    if not skipped:
        return ""
    items = "\n".join(
        f"<li>{_text(one['name'])} <span class=\"paper\">{_text(one['paper'])}</span>: {_text(one['skipped'])}</li>"
        for one in sorted(skipped, key=_place)
    )
    return f'<section id="not-drawn"><h2>Not drawn yet</h2>\n<ul>\n{items}\n</ul></section>'


def _text(value: Any) -> str:
    return html.escape(str(value))
