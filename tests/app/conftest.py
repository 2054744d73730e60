"""One Chromium for all tests of the page; they are skipped where there is none."""

import pytest

from tests.app.visits import CHROMIUM


@pytest.fixture(scope="session")
def browser():
    pytest.importorskip("panel", reason="the extra app (Panel) is not installed")
    sync_api = pytest.importorskip("playwright.sync_api", reason="playwright is not installed")
    if CHROMIUM is None:
        pytest.skip("there is no Chromium on this machine")
    with sync_api.sync_playwright() as playwright:
        started = playwright.chromium.launch(executable_path=CHROMIUM, args=["--no-sandbox"])
        yield started
        started.close()
