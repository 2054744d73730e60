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

TRIALS, COMMANDS = 60, 8
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
    began = time.perf_counter()
    page = visit.open()
    page.locator(".bk-Figure").first.wait_for()
    page.locator("#bns-errors").wait_for()
    first = time.perf_counter() - began
    return [
        at_most("page: open to first picture", first, 2.0, "s", note="the address opened until errors and paths are drawn"),
        at_most("page: a switch fitted, cross-validated and drawn", _switched(page), 1.0, "s", note="median of effects in turn"),
        at_most("page: a number moved, path and error drawn", _moved(page), 0.1, "s", note="median of key presses"),
        *_diagnosed(page, log, model),
    ]


def _until(done: Callable[[], bool]) -> float:
    """Wall seconds until it is so."""
    began = time.perf_counter()
    while not done():
        if time.perf_counter() - began > _LONGEST_S:
            raise TimeoutError("the page did not answer")
        time.sleep(_EVERY_S)
    return time.perf_counter() - began


def _rows(page: Any, name: str) -> str:
    """Of the list of errors, what stands in a model's row; "" where it has none."""
    row = page.locator("#bns-errors tbody tr").filter(has=page.get_by_role("rowheader", name=name, exact=True))
    return " ".join(row.all_inner_texts())


def _switched(page: Any) -> float:
    """An effect on, then off again, so that each is fitted alone."""
    taken = []
    for name in SWITCHES:
        box = page.get_by_role("checkbox", name=f"{name}:")
        began = time.perf_counter()
        box.check()
        _until(lambda name=name: bool(_rows(page, f"+ {name}")))
        taken.append(time.perf_counter() - began)
        box.uncheck()
        _until(lambda name=name: not _rows(page, f"+ {name}"))
    return median(taken)


def _moved(page: Any, presses: int = 9) -> float:
    page.get_by_role("checkbox", name=f"{SWITCHES[0]}:").check()
    _until(lambda: bool(_rows(page, f"+ {SWITCHES[0]}")))
    page.get_by_text(", by hand:").first.wait_for()  # its sliders come after the errors; before, the first is that of the time
    page.get_by_role("slider").first.focus()
    taken = []
    for _ in range(presses):
        before = _rows(page, "by hand")
        began = time.perf_counter()
        page.keyboard.press("ArrowRight")
        _until(lambda before=before: _rows(page, "by hand") not in {"", before})
        taken.append(time.perf_counter() - began)
    page.get_by_role("button", name="Fit all numbers").click()
    _until(lambda: not _rows(page, "by hand"))
    return median(taken)


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
