"""A visit to the page: Chromium on it, and everything odd that happened."""

import os
import shutil
import signal
import subprocess
import sys
from pathlib import Path

CHROMIUM = next(
    (path for name in ("chromium", "chromium-browser", "google-chrome") if (path := shutil.which(name))), None
)
SLOW_MS = 600_000
"""Only what hangs takes as long, on however busy a machine."""


class Visit:
    """Pages on a server; everything odd that a page did is kept."""

    def __init__(self, browser, address):
        self.browser, self.address, self.outside, self.odd = browser, address, [], []

    def empty(self, **more):
        """A page without an address yet."""
        page = self.browser.new_page(**more)
        page.set_default_timeout(SLOW_MS)
        return page

    def open(self, width=1280, address=None):
        page = self.empty(viewport={"width": width, "height": 1400})
        page.on("request", self._requested)
        page.on("console", lambda said: self.odd.append(said.text) if said.type in {"error", "warning"} else None)
        page.on("pageerror", lambda error: self.odd.append(str(error)))
        page.goto(address or self.address)
        return page

    def _requested(self, request):
        if not request.url.startswith((self.address, "data:", "blob:", self.address.replace("http", "ws", 1))):
            self.outside.append(request.url)


class Command(Visit):
    """On a process of `bns explore`."""

    def __init__(self, browser, *arguments):
        command = [sys.executable, "-m", "bns", "explore", "--no-browser", *map(str, arguments)]
        self.server = subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
        super().__init__(browser, self.server.stdout.readline().strip())

    def end(self):
        """Exit code, and what stands on its standard error."""
        self.server.send_signal(signal.SIGTERM)
        said = self.server.communicate(timeout=SLOW_MS / 1000)
        return self.server.returncode, said[1]


def go(page, screen, sign):
    page.get_by_role("button", name=screen, exact=True).click()
    page.locator(sign).wait_for()


def figures(page):
    """The pictures of the screen that is shown; those of the others are hidden."""
    return page.locator(".bk-Figure").filter(visible=True)


def settled(page):
    """Until nothing is at work and what was shown is drawn."""
    page.get_by_role("status").filter(has_text="…").wait_for(state="detached")
    page.evaluate("() => new Promise(done => requestAnimationFrame(() => requestAnimationFrame(done)))")


def error_of(page, model):
    row = page.locator("#bns-errors tbody tr").filter(has=page.get_by_role("rowheader", name=model, exact=True))
    row.wait_for()
    return float(row.locator("td").first.inner_text())


def drag(page, picture, start, end, done):
    """Between two places of a picture (shares of its width and height), until ``done()``: a picture that moves is missed."""
    for _ in range(20):
        settled(page)
        picture.evaluate("element => element.scrollIntoView({block: 'center'})")
        settled(page)
        box = picture.bounding_box()
        page.mouse.move(box["x"] + start[0] * box["width"], box["y"] + start[1] * box["height"])
        page.mouse.down()
        page.mouse.move(box["x"] + end[0] * box["width"], box["y"] + end[1] * box["height"], steps=6)
        page.mouse.up()
        for _ in range(30):
            if done():
                return
            page.wait_for_timeout(100)
    raise AssertionError("the picture did not hear the mouse")


def save(page, link, folder):
    """The file behind a link."""
    with page.expect_download() as got:
        page.get_by_role("link", name=link).click()
    path = folder / got.value.suggested_filename
    got.value.save_as(path)
    return path


def widest(page):
    """How far to the right anything reaches, pixels."""
    parts = page.locator(".bk-Figure, .bns-scroll, pre, select, input, button")
    return parts.evaluate_all("all => Math.max(...all.map(e => e.getBoundingClientRect().right))")


def shown(page, name):
    """A screenshot, kept where the environment says so: pictures are looked at, not compared."""
    folder = os.environ.get("BNS_SCREENSHOTS")
    if folder:
        settled(page)
        page.wait_for_timeout(800)
        Path(folder).mkdir(parents=True, exist_ok=True)
        page.screenshot(path=str(Path(folder) / f"{name}.png"))
