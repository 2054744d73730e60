"""Who gets in: nobody but a browser on this machine that was given the address."""

import asyncio
import subprocess
import sys
import urllib.error
import urllib.request
from concurrent.futures import ThreadPoolExecutor

import pytest

pytest.importorskip("panel", reason="the extra app (Panel) is not installed")

from bns.app.explore import Explorer, explore, tabs_of
from bns.errors import BnsError


@pytest.fixture(scope="module")
def page():
    with pytest.MonkeyPatch.context() as patched:
        patched.setattr("webbrowser.open", lambda _address: pytest.fail("a browser was opened"))
        served = explore(browser=False)
        yield served
        served.stop()


def answer(address, **headers):
    try:
        with urllib.request.urlopen(urllib.request.Request(address, headers=headers), timeout=600) as got:
            return got.status
    except urllib.error.HTTPError as refused:
        return refused.code


def test_the_page_is_served_on_loopback_under_a_token(page):
    assert page.address.startswith("http://127.0.0.1:")
    assert len(page.address.rstrip("/").rpartition("/")[2]) >= 20
    assert answer(page.address) == 200


def test_a_phone_is_told_to_use_its_own_width(page):
    with urllib.request.urlopen(page.address, timeout=600) as got:
        head = got.read().decode().partition("<body")[0]
    assert '<meta name="viewport" content="width=device-width' in head


def run_as_notebook(cell):
    """What `cell` returns where a loop runs; in a thread of its own, for a browser of other tests leaves its loop in this one."""
    with ThreadPoolExecutor(1) as thread:
        return thread.submit(lambda: asyncio.run(cell())).result()


def test_a_notebook_whose_own_loop_runs_gets_a_page_of_its_own():
    async def cell():
        served = explore(browser=False)
        try:
            return await asyncio.to_thread(answer, served.address)
        finally:
            served.stop()

    assert run_as_notebook(cell) == 200


def test_a_notebook_that_is_busy_does_not_hold_up_the_page():
    async def cell():
        served = explore(browser=False)
        try:
            return answer(served.address)  # the notebook's loop waits for this line
        finally:
            served.stop()

    assert run_as_notebook(cell) == 200


@pytest.mark.parametrize(
    "headers",
    [
        {"Host": "evil.example"},
        {"Host": "127.0.0.1:1"},
        {"Origin": "http://evil.example"},
        {"Origin": "null"},
        {"Origin": "https://127.0.0.1:1"},
    ],
)
def test_another_host_or_origin_is_refused(page, headers):
    assert answer(page.address, **headers) == 403
    assert answer(page.address + "static/js/bokeh.min.js", **headers) == 403
    assert answer(page.address + "ws", **headers) == 403


def test_its_own_host_and_origin_are_let_in(page):
    host = page.address.split("/")[2]
    assert answer(page.address, Host=host, Origin=f"http://{host}") == 200


def test_without_the_token_nobody_gets_in(page):
    root = page.address.rstrip("/").rpartition("/")[0]
    for path in ("", "/", "/wrong/", "/wrong/ws", "//", page.address.split("/")[3][:-1] + "/"):
        assert answer(root + "/" + path.lstrip("/")) == 403, path


def test_every_page_has_an_address_of_its_own(page):
    other = Explorer(tabs_of(None, "khepera"))
    assert other.address.split("/")[3] != page.address.split("/")[3]


def test_a_port_that_is_taken_is_named(page):
    with pytest.raises(BnsError, match=r"Port \d+ of this machine is not available .*--port N"):
        Explorer(tabs_of(None, "khepera"), int(page.address.split(":")[2].split("/")[0]))


@pytest.mark.parametrize("port", ["70000", "-1", "x"])
def test_what_is_no_port_is_refused(port):
    done = subprocess.run(
        [sys.executable, "-m", "bns", "explore", "--port", port], capture_output=True, text=True, check=False
    )
    assert done.returncode == 2
    assert "no port" in done.stderr or "expected one argument" in done.stderr
