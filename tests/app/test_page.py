"""The page in a browser, from a log with a hidden effect to the saved model. Skipped where there is no Chromium to drive."""

import re

import pytest

import bns
from bns.app.switches import Switches
from bns.app.workbench import Workbench
from bns.examples import FOLDER
from tests.app.visits import Command, drag, error_of, figures, go, save, settled, shown, widest

pytestmark = pytest.mark.slow

LOG = FOLDER / "khepera-log.csv"
LAG = Switches().switched("motor-lag", True)


@pytest.fixture(scope="module")
def bench():
    return Workbench(LOG, "khepera")


def test_a_sample_is_opened_the_error_falls_and_the_model_is_saved(browser, bench, tmp_path):
    visit = Command(browser)
    page = visit.open()
    page.get_by_role("button", name="Open the sample").click()
    page.locator("#bns-findings").wait_for()
    shown(page, "data")
    assert "14 trials" in page.locator("#bns-log").inner_text()
    assert page.get_by_role("checkbox", name="trial ").count() == len(bns.Measurements(LOG).findings)
    go(page, "Effects", "#bns-errors")
    assert page.get_by_label("Trial", exact=True).filter(visible=True).input_value() != ""  # the one whose paths are drawn
    before = error_of(page, "as given")
    page.get_by_role("checkbox", name="motor-lag:").check()
    after = error_of(page, "+ motor-lag")
    models = bench.shown(LAG).errors.horizons["1s"].models
    assert [before, after] == [round(1e3 * m.rms_m, 2) for m in models]
    assert after < before / 3
    shown(page, "effects")
    go(page, "Next", "#bns-commands")
    saved = save(page, "Save the model", tmp_path)
    assert bns.Model(saved).sha256 == bench.shown(LAG).model.sha256
    assert "motor-lag --model khepera -o extended.yaml" in page.locator("#bns-commands").inner_text()
    shown(page, "next")
    assert not page.locator("link[href*='bootstrap.min.css']").count() > 1  # a copy in every component made the page slow
    page.close()
    code, said = visit.end()
    assert code == 0
    assert said == ""  # nor of a tab that was closed while it was spoken to
    assert (visit.outside, visit.odd) == ([], [])


def test_a_number_is_moved_and_fitted_again_and_every_change_has_a_way_back(visit):
    page = visit(LOG).open()
    page.get_by_role("checkbox", name="motor-lag:").check()
    fitted = error_of(page, "+ motor-lag")
    page.get_by_text("tau_s (s), by hand").wait_for()
    page.get_by_role("slider").first.focus()
    page.keyboard.press("ArrowRight")
    assert error_of(page, "by hand") > 0
    assert error_of(page, "+ motor-lag") == fitted
    page.get_by_role("button", name="Fit all numbers").click()
    page.get_by_role("rowheader", name="by hand").wait_for(state="detached")
    page.get_by_role("checkbox", name="turn-slip:").check()
    error_of(page, "+ turn-slip")
    page.get_by_text("has no visible effect in these data", exact=True).first.wait_for()
    page.get_by_role("button", name="Undo").click()
    page.get_by_role("rowheader", name="+ turn-slip").wait_for(state="detached")
    assert not page.get_by_role("checkbox", name="turn-slip:").is_checked()
    page.get_by_role("button", name="Redo").click()
    error_of(page, "+ turn-slip")
    box = page.get_by_label("Formula")
    box.press_sequentially("k * v *")
    page.get_by_role("alert").filter(has_text="is no formula").wait_for()
    box.press_sequentially(" abs(w)")
    page.get_by_role("alert").filter(has_text="is no formula").wait_for(state="detached")


def test_brushing_one_picture_counts_the_windows_in_it(visit):
    page = visit(LOG).open()
    go(page, "Where it fails", "#bns-compared")
    page.get_by_text("All 200 windows").wait_for()
    shown(page, "where")
    brushed = page.get_by_text(re.compile(r"\d+ windows brushed, of \d+ trials"))
    drag(page, figures(page).first, (0.3, 0.2), (0.8, 0.5), brushed.count)


def test_a_diagnosis_outlives_a_reload_and_leads_to_the_next_experiment(visit):
    visited = visit(LOG)
    page = visited.open()
    page.get_by_role("checkbox", name="motor-lag:").check()
    error_of(page, "+ motor-lag")
    page.get_by_role("button", name="Diagnose in the background").click()
    page.reload()
    page.locator("#bns-errors").wait_for()
    assert page.get_by_role("checkbox", name="motor-lag:").is_checked()
    error_of(page, "+ motor-lag")
    other = visited.open(400)
    other.locator("#bns-errors").wait_for()
    assert not other.get_by_role("checkbox", name="motor-lag:").is_checked()  # another tab is another
    other.close()
    page.locator("#bns-verdict").wait_for()
    assert "the motors follow their commands with a lag" in page.locator("#bns-verdict").inner_text()
    assert "tau_s = 200.1 ms; 95 %: 199.3 to 200.9 ms" in page.locator("#bns-verdict").inner_text()
    assert "save the extended model on the Next screen" in page.locator("#bns-verdict").inner_text()
    go(page, "Next", "#bns-commands")
    page.get_by_role("link", name="Save the session").wait_for()  # what follows stands still from here on
    side = page.get_by_label("x from (m)")
    before = side.input_value()
    drag(page, figures(page).first, (0.2, 0.25), (0.9, 0.85), lambda: side.input_value() != before)
    page.get_by_label("Minutes of driving").fill("2")
    page.get_by_role("button", name="Propose the next experiment").click()
    page.locator("#bns-pairs, .bns-error").first.wait_for()
    shown(page, "experiment")
    assert page.locator("#bns-pairs").count() == 1
    page.get_by_text(re.compile(r" against .+: decided ")).first.wait_for()  # as `bns propose` says it


def test_snapshots_lead_back_a_session_opens_as_it_was_and_controllers_evolve_in_the_model(visit, bench, tmp_path):
    visited = visit(LOG)
    page = visited.open()
    page.get_by_role("checkbox", name="motor-lag:").check()
    error_of(page, "+ motor-lag")
    page.get_by_label("Name of the snapshot").fill("with lag")
    page.get_by_role("button", name="Keep a snapshot").click()
    page.locator("#bns-snapshots").wait_for()
    page.get_by_role("checkbox", name="motor-lag:").uncheck()
    page.get_by_role("rowheader", name="+ motor-lag").wait_for(state="detached")
    page.get_by_label("Name of the snapshot").fill("")
    page.get_by_role("button", name="Keep a snapshot").click()
    page.get_by_role("rowheader", name="as given", exact=True).nth(1).wait_for()
    page.get_by_label("Snapshot", exact=True).select_option("with lag")
    page.get_by_role("button", name="Go back to it").click()
    after = error_of(page, "+ motor-lag")
    name = page.get_by_role("rowheader", name="with lag", exact=True)
    kept = page.locator("#bns-snapshots tbody tr").filter(has=name).locator("td").nth(1)
    models = bench.shown(LAG).errors.horizons["1s"].models
    assert [float(kept.inner_text()), after] == [round(1e3 * models[-1].rms_m, 2)] * 2
    shown(page, "snapshots")
    go(page, "Next", "#bns-commands")
    saved = save(page, "Save the session", tmp_path)
    page.get_by_label("Evaluations").fill("3")
    page.get_by_label("Evaluations").press("Enter")
    page.get_by_role("button", name="Evolve in this model").click()
    page.locator("#bns-evolved").wait_for()
    assert "goals reached" in page.locator("#bns-evolved").inner_text()
    shown(page, "evolved")
    other = visited.open()
    go(other, "Data", "#bns-log")
    other.get_by_label("Or a file of this machine").fill(str(saved))
    other.get_by_role("button", name="Open the file").click()
    go(other, "Effects", "#bns-snapshots")  # while it is still being read
    assert error_of(other, "+ motor-lag") == after


def test_everything_can_be_read_on_a_narrow_screen(visit):
    page = visit(LOG).open(400)
    page.locator("#bns-errors").wait_for()
    for screen, sign in (
        ("Data", "#bns-log"),
        ("Model", "#bns-model"),
        ("Where it fails", "#bns-compared"),
        ("Effects", "#bns-errors"),
        ("Next", "#bns-saved"),
    ):
        go(page, screen, sign)
        settled(page)
        shown(page, f"narrow-{screen.split()[0].lower()}")
        assert widest(page) <= 400, screen
        hidden = page.locator(".bns-scroll").evaluate_all("all => Math.max(0, ...all.map(e => e.scrollHeight - e.clientHeight))")
        assert hidden <= 1, f"{screen}: a table is cut"
