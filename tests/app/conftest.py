"""Chromium for tests of the page, skipped where there is none. Every test has its own, so that none leaves a loop behind."""

import warnings

import pytest

from tests.app.visits import CHROMIUM, Visit


@pytest.fixture
def browser():
    pytest.importorskip("panel", reason="the extra app (Panel) is not installed")
    sync_api = pytest.importorskip("playwright.sync_api", reason="playwright is not installed")
    if CHROMIUM is None:
        pytest.skip("there is no Chromium on this machine")
    with sync_api.sync_playwright() as playwright:
        started = playwright.chromium.launch(executable_path=CHROMIUM, args=["--no-sandbox", "--disable-gpu"])
        yield started
        started.close()


@pytest.fixture
def visit(browser):
    """visit(log, model) -> a page of `bns.explore`, being served; it asks nobody else and nothing goes wrong."""
    import bns

    served, visits = [], []

    def begin(*arguments):
        served.append(bns.explore(*arguments, browser=False))
        visits.append(Visit(browser, served[-1].address))
        return visits[-1]

    with warnings.catch_warnings():
        warnings.simplefilter("ignore", PendingDeprecationWarning)  # of Panel's own
        yield begin
        for page in served:
            page.stop()
    assert [each.outside for each in visits] == [[]] * len(visits)
    assert [each.odd for each in visits] == [[]] * len(visits)
