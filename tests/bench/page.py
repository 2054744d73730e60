"""`bns explore` in Chromium on a log of 60 trials of 10 s: first picture, slider, switch, and answers while it diagnoses."""

from __future__ import annotations

import os
import tempfile
import time
from collections.abc import Callable
from pathlib import Path
from statistics import median
from typing import Any
from unittest.mock import patch

import bns
from bns.api.model import Model
from tests.bench.line import Line, at_most, without_target

TRIALS, COMMANDS, OPENINGS = 60, 8, 5
SWITCHES = ("motor-lag", "turn-slip", "wheelbase", "understeer", "camera-scale")
_EVERY_S = 0.002
_LONGEST_S = 300.0


def measure(quick: bool) -> list[Line]:
    """Wall seconds as a person waits for them; nothing where there is no browser."""
    try:
        from playwright.sync_api import sync_playwright  # an extra of the tests

        from tests.app.visits import CHROMIUM, Command
    except ImportError:
        return _nothing("playwright is not installed")
    if CHROMIUM is None:
        return _nothing("there is no Chromium on this machine")
    with tempfile.TemporaryDirectory() as folder, sync_playwright() as playwright, patch.dict(os.environ, BNS_CACHE="off"):
        log, model = _written(Path(folder), 20 if quick else TRIALS)
        browser = playwright.chromium.launch(executable_path=CHROMIUM, args=["--no-sandbox"])
        began = time.perf_counter()
        visit = Command(browser, log, "--model", model)
        started = time.perf_counter() - began
        try:
            return [without_target("bns explore LOG: until it prints its address", started, "s"), *_visited(visit, log, model)]
        finally:
            visit.end()
            browser.close()


def _nothing(why: str) -> list[Line]:
    return [at_most("bns explore in a browser", None, 2.0, "s", note=why)]


def _written(folder: Path, trials: int) -> tuple[Path, Path]:
    """A log whose robot's motors lag, and the model that does not know it."""
    from tests.diagnose.worlds import NOMINAL, hidden, measured  # loads the kernels

    log = folder / "log.csv"
    measured(hidden(motor_lag={"tau_s": 0.12}), trials=trials, commands=COMMANDS).to_csv(log, index=False)
    return log, Model(NOMINAL).save(folder / "model.yaml")


def _visited(visit: Any, log: Path, model: Path) -> list[Line]:
    opened = []
    for _ in range(OPENINGS):
        began = time.perf_counter()
        page = visit.open()
        page.locator(".bk-Figure").first.wait_for()
        page.locator("#bns-errors").wait_for()
        page.evaluate(_PAINTED)
        opened.append(time.perf_counter() - began)
        page.get_by_role("checkbox", name=f"{SWITCHES[0]}:").wait_for()
        if len(opened) < OPENINGS:
            page.close()
    switched, moved = _switched(page), _moved(page)
    drawn = "the address opened until errors and paths are drawn"
    return [
        at_most("page: open to first picture", median(opened), 2.0, "s", note=f"{drawn}; {_least(opened)}"),
        at_most("page: a switch fitted, cross-validated and drawn", median(switched), 1.0, "s", note=_least(switched)),
        at_most("page: a number moved, path and error drawn", median(moved), 0.1, "s", note=_least(moved)),
        *_diagnosed(page, log, model),
    ]


_SAID = """(name) => {
  const found = (root) => {
    const here = root.querySelector("#bns-errors")
    if (here !== null) return here
    for (const one of root.querySelectorAll("*")) {
      const inside = one.shadowRoot === null ? null : found(one.shadowRoot)
      if (inside !== null) return inside
    }
    return null
  }
  if (!window.bnsErrors?.isConnected) window.bnsErrors = found(document)
  const rows = [...(window.bnsErrors?.querySelectorAll("tbody tr") ?? [])]
  return rows.filter(row => row.querySelector("th").textContent === name).map(row => row.innerText).join(" ")
}"""
"""What stands in a model's row of the list of errors; "" where it has none."""
_CHANGED = f"([name, before, gone]) => {{ const said = ({_SAID})(name); return said !== before && (said === '') === gone }}"
_PAINTED = "() => new Promise(done => requestAnimationFrame(() => requestAnimationFrame(done)))"


def _least(taken: list[float]) -> str:
    return f"median of {len(taken)}; {min(taken):.2g} s at least"


def _seen(page: Any, name: str, before: str = "", gone: bool = False) -> None:
    """Until the page has drawn a row anew: looked at once a frame, from within, so that looking costs nothing."""
    page.wait_for_function(_CHANGED, arg=[name, before, gone], polling="raf", timeout=1e3 * _LONGEST_S)
    page.evaluate(_PAINTED)


def _until(done: Callable[[], bool]) -> float:
    """Wall seconds until it is so."""
    began = time.perf_counter()
    while not done():
        if time.perf_counter() - began > _LONGEST_S:
            raise TimeoutError("the page did not answer")
        time.sleep(_EVERY_S)
    return time.perf_counter() - began


def _switched(page: Any) -> list[float]:
    """An effect on, then off again, so that each is fitted alone."""
    taken = []
    for name in SWITCHES:
        box = page.get_by_role("checkbox", name=f"{name}:")
        box.wait_for()
        began = time.perf_counter()
        box.check()
        _seen(page, f"+ {name}")
        taken.append(time.perf_counter() - began)
        box.uncheck()
        _seen(page, f"+ {name}", "-", gone=True)
    return taken


def _moved(page: Any, presses: int = 15) -> list[float]:
    page.get_by_role("checkbox", name=f"{SWITCHES[0]}:").check()
    _seen(page, f"+ {SWITCHES[0]}")
    page.get_by_text(", by hand").first.wait_for()  # its sliders come after the errors; before, the first is that of the time
    page.get_by_role("slider").first.focus()
    taken = []
    for _ in range(presses):
        before = page.evaluate(_SAID, "by hand")
        began = time.perf_counter()
        page.keyboard.press("ArrowRight")
        _seen(page, "by hand", before)
        taken.append(time.perf_counter() - began)
    page.get_by_role("button", name="Fit all numbers").click()
    _seen(page, "by hand", "-", gone=True)
    return taken


def _diagnosed(page: Any, log: Path, model: Path) -> list[Line]:
    """A horizon is chosen again and again while the diagnosis works; then the same diagnosis without a page."""
    menu = page.get_by_label("Error how far ahead")
    caption = page.locator("#bns-errors caption")
    page.get_by_role("button", name="Diagnose in the background").click()
    began, taken = time.perf_counter(), []
    while not page.locator("#bns-verdict").count() and time.perf_counter() - began < _LONGEST_S:
        for said in ("the whole trial", "1 second"):
            asked = time.perf_counter()
            menu.select_option(said)
            _until(lambda said=said: said in caption.inner_text())
            taken.append(time.perf_counter() - asked)
    whole = time.perf_counter() - began
    began = time.perf_counter()
    bns.diagnose(log, bns.Model(model), fresh=True)
    alone = time.perf_counter() - began
    note = f"median of {len(taken)} answers; the slowest took {max(taken):.2g} s"
    return [
        at_most("page: an answer while it diagnoses", median(taken), 0.2, "s", note=note),
        without_target("page: a diagnosis in the background, over bns.diagnose", whole / alone, "x", f"that: {alone:.1f} s"),
    ]
