"""Redraw the page of figures whenever the results change, while a sweep goes on.

The figures' scripts stand beside the package in a checkout (``analysis/``) and run in a process of their own: the package
does not depend on them, and a figure that fails does not end the watch.
"""

from __future__ import annotations

import shutil
import subprocess
import sys
import time
from collections.abc import Callable
from pathlib import Path

import bns
from bns.errors import BnsError

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


def scripts() -> Path:
    """Folder that ``python -m analysis`` is found in.

    Raises:
        BnsError: this package was installed without a checkout.
    """
    root = Path(bns.__file__).resolve().parents[1]
    if not (root / "analysis" / "__main__.py").is_file():
        raise BnsError(
            f"the figures' scripts are not beside the package ({root / 'analysis'} is missing): they come with a checkout, "
            "not with an installed package. Run bns from a checkout (make setup), or draw elsewhere with python -m analysis."
        )
    return root


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


def draw(root: Path, results: Path, *options: str, polite: bool = True) -> str:
    """Run the figures' scripts, politely after a sweep's own processes; "" if all went well, else what they complain of."""
    after_others = ["nice", "-n", "10"] if polite and shutil.which("nice") else []
    command = [*after_others, sys.executable, "-m", "analysis", "--results", str(results.absolute()), *options]
    # In a session of its own, so that Ctrl-C reaches this process alone, which then ends the other.
    with subprocess.Popen(
        command, cwd=root, stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, text=True, start_new_session=True
    ) as process:
        try:
            _, complaint = process.communicate()
        except BaseException:
            process.terminate()
            raise
    return "" if process.returncode == 0 else (complaint.strip().splitlines() or ["the figures' scripts failed"])[-1]
