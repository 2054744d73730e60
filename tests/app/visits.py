"""A visit to the page: a server of its own, Chromium on it, and everything odd that happened."""

import os
import shutil
import signal
import subprocess
import sys
from pathlib import Path

CHROMIUM = next(
    (path for name in ("chromium", "chromium-browser", "google-chrome") if (path := shutil.which(name))), None
)
SLOW_MS = 120_000


class Visit:
    """A server of its own, and pages on it; everything odd that a page did is kept."""

    def __init__(self, browser, *arguments):
        command = [sys.executable, "-m", "bns", "explore", "--no-browser", *map(str, arguments)]
        self.server = subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
        self.address = self.server.stdout.readline().strip()
        self.browser, self.outside, self.odd = browser, [], []

    def open(self, width=1280, address=None):
        page = self.browser.new_page(viewport={"width": width, "height": 1400})
        page.set_default_timeout(SLOW_MS)
        page.on("request", self._requested)
        page.on("console", lambda said: self.odd.append(said.text) if said.type in {"error", "warning"} else None)
        page.on("pageerror", lambda error: self.odd.append(str(error)))
        page.goto(address or self.address)
        return page

    def _requested(self, request):
        if not request.url.startswith((self.address, "data:", "blob:", self.address.replace("http", "ws", 1))):
            self.outside.append(request.url)

    def end(self):
        self.server.send_signal(signal.SIGTERM)
        said = self.server.communicate(timeout=SLOW_MS / 1000)
        return self.server.returncode, said[1]


def go(page, screen, sign):
    page.get_by_role("button", name=screen, exact=True).click()
    page.locator(sign).wait_for()


def error_of(page, model):
    row = page.locator("#bns-errors tbody tr").filter(has=page.get_by_role("rowheader", name=model, exact=True))
    row.wait_for()
    return float(row.locator("td").first.inner_text())


def shown(page, name):
    """A screenshot, kept where the environment says so: pictures are looked at, not compared."""
    folder = os.environ.get("BNS_SCREENSHOTS")
    if folder:
        page.wait_for_timeout(800)
        Path(folder).mkdir(parents=True, exist_ok=True)
        page.screenshot(path=str(Path(folder) / f"{name}.png"))
