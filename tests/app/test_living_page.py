"""What happens between clicks: a connection that is lost, a diagnosis that goes on and is stopped, a person without a mouse."""

import re
import threading
import time

import pytest

import bns

pytest.importorskip("panel", reason="the extra app (Panel) is not installed")

from bns.app import jobs
from bns.app.page import Screens
from bns.examples import FOLDER
from tests.app.visits import error_of, go, settled

pytestmark = pytest.mark.slow

LOG = FOLDER / "khepera-log.csv"


def test_a_lost_connection_is_said_and_the_page_comes_back_as_it_was(visit):
    visited = visit(LOG)
    page = visited.empty()
    sockets, looked = [], []
    page.route_web_socket(re.compile("/ws"), lambda socket: (sockets.append(socket), socket.connect_to_server()))
    page.route("**/bokeh.min.js", lambda route: looked.append(route) if route.request.method == "HEAD" else route.continue_())
    page.goto(visited.address)
    page.get_by_role("checkbox", name="motor-lag:").check()
    error_of(page, "+ motor-lag")
    go(page, "Next", "#bns-saved")
    sockets[-1].close()
    page.get_by_role("alert").filter(has_text="connection to bns explore is lost").wait_for()
    while not looked:
        page.wait_for_timeout(100)
    with page.expect_navigation():
        looked[-1].continue_()
    page.locator("#bns-saved").filter(has_text="motor-lag").wait_for()  # the screen that was shown, the switches that were on
    assert len(sockets) == 2
    go(page, "Effects", "#bns-errors")
    page.get_by_role("checkbox", name="motor-lag:").uncheck()
    page.get_by_role("rowheader", name="+ motor-lag").wait_for(state="detached")


@pytest.fixture
def paced(monkeypatch):
    """The diagnosis, which waits before each effect it tries until the test lets it go on."""
    steps = threading.Semaphore(0)
    whole = bns.diagnose

    def diagnose(*arguments, alone, **more):
        def told(entry):
            steps.acquire(timeout=600)
            alone(entry)

        return whole(*arguments, alone=told, **more)

    monkeypatch.setattr("bns.app.screens.diagnosis.diagnose", diagnose)
    yield steps
    steps.release(1000)


def test_what_effects_earn_comes_one_by_one_and_stays_when_the_diagnosis_is_stopped(visit, paced):
    page = visit(LOG).open()
    page.locator("#bns-errors").wait_for()
    page.get_by_role("button", name="Diagnose in the background").click()
    known = page.get_by_text(re.compile("alone, so far:"))
    for n in range(3):
        assert known.count() == n
        paced.release()
        known.nth(n).wait_for()
    page.get_by_text(re.compile(r"diagnosing for \d+ s: .+%")).wait_for()
    go(page, "Model", "#bns-model")  # the page answers meanwhile
    go(page, "Effects", "#bns-errors")
    page.get_by_role("button", name="Stop", exact=True).click()
    paced.release(100)
    page.get_by_role("alert").filter(has_text="stopped").wait_for()
    assert known.count() >= 3
    assert page.locator("#bns-verdict").count() == 0
    page.get_by_role("button", name="Diagnose in the background").click()  # and it begins again
    paced.release(1000)
    page.locator("#bns-verdict").wait_for()
    known.first.wait_for(state="detached")


def focused(page):
    return page.evaluate(
        """() => {
            let at = document.activeElement
            while (at.shadowRoot && at.shadowRoot.activeElement) at = at.shadowRoot.activeElement
            const text = at.labels?.length ? at.labels[0].textContent : (at.getAttribute('aria-label') || at.textContent)
            const box = at.getBoundingClientRect(), look = getComputedStyle(at)
            const seen = look.outlineStyle != 'none' || look.boxShadow != 'none'
            return {what: at.tagName.toLowerCase(), role: at.getAttribute('role'), text: text.trim(), seen, y: box.y}
        }"""
    )


def tab_to(page, text, most=200):
    """Press Tab until what has this text is reached."""
    for _ in range(most):
        page.keyboard.press("Tab")
        at = focused(page)
        if at["text"].startswith(text):
            assert at["seen"], f"nobody sees that {text} has the focus"
            return
    raise AssertionError(f"Tab does not lead to {text}")


def test_everything_is_reached_and_done_with_the_keyboard(visit):
    page = visit(LOG).open()
    page.locator("#bns-errors").wait_for()
    settled(page)
    tab_to(page, "motor-lag:")
    page.keyboard.press("Space")
    error_of(page, "+ motor-lag")
    page.get_by_text("tau_s (s), by hand").wait_for()
    for _ in range(10):
        page.keyboard.press("Tab")
        if focused(page)["role"] == "slider":
            break
    page.keyboard.press("ArrowRight")
    error_of(page, "by hand")
    page.reload()
    page.locator("#bns-errors").wait_for()
    settled(page)
    for screen, sign, something in (
        ("Data", "#bns-log", "Open the sample"),
        ("Model", "#bns-model", "Take this robot"),
        ("Where it fails", "#bns-compared", "Worst moments"),
        ("Next", "#bns-saved", "Save the model"),
        ("Effects", "#bns-errors", "Undo"),
    ):
        page.evaluate("() => { const at = document.activeElement; at && at.blur() }")
        tab_to(page, screen)
        page.keyboard.press("Enter")
        page.locator(sign).wait_for()
        settled(page)
        tab_to(page, something)
    page.keyboard.press("Enter")  # Undo
    page.get_by_role("rowheader", name="by hand").wait_for(state="detached")


UNNAMED = re.compile(r"- (slider|checkbox|button|combobox|listbox|textbox|spinbutton|radio|link)(?! \")[^\n]*")


def test_a_screen_reader_can_name_everything(visit):
    page = visit(LOG).open()
    page.get_by_role("checkbox", name="motor-lag:").check()
    error_of(page, "+ motor-lag")
    slider = page.get_by_role("slider", name="tau_s, s", exact=True)
    slider.wait_for()
    page.get_by_label("tau_s (s), by hand").wait_for()
    slider.focus()
    before = slider.get_attribute("aria-valuetext")
    page.keyboard.press("ArrowRight")
    error_of(page, "by hand")
    assert slider.get_attribute("aria-valuetext") != before
    for screen, sign in (
        ("Data", "#bns-log"),
        ("Model", "#bns-model"),
        ("Where it fails", "#bns-compared"),
        ("Effects", "#bns-errors"),
        ("Next", "#bns-saved"),
    ):
        go(page, screen, sign)
        settled(page)
        if screen in {"Where it fails", "Effects"}:
            assert page.get_by_role("slider", name="Time in the trial (s)").filter(visible=True).count() == 1
        unnamed = [found.group() for found in UNNAMED.finditer(page.locator("body").aria_snapshot())]
        assert unnamed == [], screen


def test_what_one_change_brings_comes_in_one_message(visit):
    """In several, a picture could get data that name a part which the browser does not have yet."""
    visited = visit(LOG)
    page, came = visited.empty(), []

    def keep(frame):
        came.append(frame)

    page.on("websocket", lambda socket: socket.on("framereceived", keep))
    page.goto(visited.address)
    page.get_by_role("checkbox", name="motor-lag:").check()
    error_of(page, "+ motor-lag")
    slider = page.get_by_role("slider", name="tau_s, s", exact=True)
    slider.wait_for()
    settled(page)
    slider.focus()
    came.clear()
    page.keyboard.press("ArrowRight")
    error_of(page, "by hand")
    settled(page)
    changes = [frame for frame in came if isinstance(frame, str) and '"events"' in frame]
    assert len(changes) == 1
    assert "by hand" in changes[0]
    assert not page.locator("script[src*='mathjax']").count()  # 2 MB that nobody would use


@pytest.mark.parametrize("longest_s", [0.0, 60.0])
def test_the_first_picture_comes_with_the_page_or_after_it(visit, monkeypatch, longest_s):
    """However long it takes: what is there before the browser has the page waits, and comes in its order."""
    monkeypatch.setattr(jobs, "LONGEST_S", longest_s)
    begin, after = jobs.Jobs.begin, 2 if longest_s == 0 else 1  # the screen and the list of effects; of a whole page the list

    def once_all_wait(self):
        if len(self._early) < after:
            self._document.add_timeout_callback(lambda: once_all_wait(self), 50)
        else:
            begin(self)

    def once_it_is_asked_for(self, name, made=Screens._made):
        screen = made(self, name)
        while longest_s > 0 and self._document.session_context.session.connection_count == 0:
            time.sleep(0.05)
        time.sleep(0.5)  # what asks for the page stands in the line by now; without it the test only asks less
        return screen

    monkeypatch.setattr(jobs.Jobs, "begin", once_all_wait)
    monkeypatch.setattr(Screens, "_made", once_it_is_asked_for)
    visited = visit(LOG)
    page, came, said = visited.empty(), [], []

    def keep(frame):
        came.append(frame)

    page.on("console", lambda message: said.append(message.text) if message.type in {"error", "warning"} else None)
    page.on("pageerror", lambda error: said.append(str(error)))
    page.on("websocket", lambda socket: socket.on("framereceived", keep))
    page.goto(visited.address)
    page.get_by_role("checkbox", name="motor-lag:").check()
    error_of(page, "+ motor-lag")
    settled(page)
    [whole] = [frame for frame in came if isinstance(frame, str) and frame.startswith('{"doc"')]
    assert ("bns-errors" in whole) == (longest_s > 0)
    assert said == []
