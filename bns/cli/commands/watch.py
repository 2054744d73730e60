"""Redraw the page of figures whenever the results change, while a sweep goes on.

The figures' scripts stand beside the package in a checkout (``analysis/``) and run in a process of their own: the package
does not depend on them, and a figure that fails does not end the watch.
"""

from __future__ import annotations

import time
from collections.abc import Callable
from pathlib import Path

from bns.plotting.scripts import draw, scripts

CHANGING = ("runs", "journal", "specs")
"""Folders of the results that every finished run and every fold leaves a trace in."""


def watch(
    results: Path,
    every_s: float = 10.0,
    say: Callable[[str], None] = print,
    wait: Callable[[float], object] = time.sleep,
) -> None:
    """Draw, wait, draw again if a run has finished since, until Ctrl-C; then let the page no longer reload itself.

    Raises:
        BnsError: there are no figures' scripts beside this package.
        KeyboardInterrupt: passed on when the page is at rest.
    """
    root, page = scripts(), (results / "figures" / "index.html").absolute()
    seen: object = None
    last = ""
    try:
        while True:
            now = trace(results)
            taken = 0.0
            if now != seen:
                began = time.perf_counter()
                said = draw(root, results, "--refresh", str(max(2, round(every_s)))) or f"{page.as_uri()} is up to date"
                taken, seen = time.perf_counter() - began, now
                if said != last:
                    say(said)
                last = said
            # A page that takes long to draw is drawn less often: at most half of a core's time goes into it.
            wait(max(every_s, taken))
    finally:
        if page.exists():
            draw(root, results, "--page")


def trace(results: Path) -> frozenset[tuple[str, int, int]]:
    """Name, size and time of change of the files that tell of finished runs."""
    found = set()
    for folder in CHANGING:
        for path in (results / folder).rglob("*"):
            try:
                state = path.stat()
            except FileNotFoundError:  # a fold has just replaced it
                continue
            if not path.name.endswith(".lock"):
                found.add((str(path), state.st_size, state.st_mtime_ns))
    return frozenset(found)
