"""The page in a browser, from a log with a hidden effect to the saved model. Skipped where there is no Chromium to drive."""

import re

import pytest

import bns
from bns.app.switches import Switches
from bns.app.workbench import Workbench
from bns.examples import FOLDER
from tests.app.visits import Visit, error_of, go, shown

pytestmark = pytest.mark.slow

LOG = FOLDER / "khepera-log.csv"


@pytest.fixture(scope="module")
def visit(browser):
    made = Visit(browser)
    yield made
    if made.server.poll() is None:
        made.end()


@pytest.fixture(scope="module")
def page(visit):
    made = visit.open()
    made.get_by_role("button", name="Open the sample").click()
    made.locator("#bns-log").wait_for()
    return made


@pytest.fixture(scope="module")
def bench():
    return Workbench(LOG, "khepera")


def test_what_is_odd_is_listed_beside_the_paths(page):
    shown(page, "data")
    assert "14 trials" in page.locator("#bns-log").inner_text()
    page.locator("#bns-findings").wait_for()
    assert page.get_by_role("checkbox", name="trial ").count() == len(bns.Measurements(LOG).findings)


def test_the_error_falls_when_the_hidden_effect_is_switched_on(page, bench):
    go(page, "Effects", "#bns-errors")
    before = error_of(page, "as given")
    page.get_by_role("checkbox", name="motor-lag:").check()
    after = error_of(page, "+ motor-lag")
    state = Switches().switched("motor-lag", True)
    models = bench.shown(state).errors.horizons["1s"].models
    assert [before, after] == [round(1e3 * m.rms_m, 2) for m in models]
    assert after < before / 3
    shown(page, "effects")


def test_a_number_is_moved_with_the_keyboard_and_fitted_again(page):
    page.get_by_role("slider").first.focus()
    fitted = error_of(page, "+ motor-lag")
    page.keyboard.press("ArrowRight")
    assert error_of(page, "by hand") > 0
    assert error_of(page, "+ motor-lag") == fitted
    page.get_by_role("button", name="Fit all numbers").click()
    page.get_by_role("rowheader", name="by hand").wait_for(state="detached")


def test_undo_and_redo_walk_through_the_switches(page):
    page.get_by_role("checkbox", name="turn-slip:").check()
    error_of(page, "+ turn-slip")
    page.get_by_text("does nothing that these data show", exact=True).first.wait_for()
    page.get_by_role("button", name="Undo").click()
    page.get_by_role("rowheader", name="+ turn-slip").wait_for(state="detached")
    assert not page.get_by_role("checkbox", name="turn-slip:").is_checked()
    page.get_by_role("button", name="Redo").click()
    error_of(page, "+ turn-slip")
    page.get_by_role("checkbox", name="turn-slip:").uncheck()
    page.get_by_role("rowheader", name="+ turn-slip").wait_for(state="detached")


def test_a_formula_with_a_mistake_is_answered_beside_its_field(page):
    box = page.get_by_label("Formula")
    box.press_sequentially("k * v *")
    page.get_by_role("alert").filter(has_text="is no formula").wait_for()
    box.press_sequentially(" abs(w)")
    page.get_by_role("alert").filter(has_text="is no formula").wait_for(state="detached")


def test_brushing_one_picture_counts_the_windows_in_it(page):
    go(page, "Where it fails", "#bns-compared")
    page.get_by_text("All 200 windows").wait_for()
    shown(page, "where")
    picture = page.locator(".bk-Figure").first
    picture.scroll_into_view_if_needed()
    box = picture.bounding_box()
    page.mouse.move(box["x"] + 0.3 * box["width"], box["y"] + 60)
    page.mouse.down()
    page.mouse.move(box["x"] + 0.8 * box["width"], box["y"] + 150, steps=6)
    page.mouse.up()
    page.get_by_text(re.compile(r"\d+ windows brushed, of \d+ trials")).wait_for()


def test_a_reload_in_mid_diagnosis_loses_nothing_and_another_tab_is_another(page, visit):
    go(page, "Effects", "#bns-errors")
    page.get_by_role("button", name="Diagnose in the background").click()
    page.reload()
    page.locator("#bns-errors").wait_for()
    assert page.get_by_role("checkbox", name="motor-lag:").is_checked()
    error_of(page, "+ motor-lag")
    other = visit.open(400)
    other.get_by_text("Nothing is open yet").wait_for()
    other.close()
    page.locator("#bns-verdict").wait_for()
    assert "the motors follow their commands with a lag" in page.locator("#bns-verdict").inner_text()


def test_the_model_is_saved_as_it_is_shown(page, tmp_path, bench):
    go(page, "Next", "#bns-commands")
    with page.expect_download() as got:
        page.get_by_role("link", name="Save the model").click()
    got.value.save_as(tmp_path / got.value.suggested_filename)
    saved = bns.Model(tmp_path / "extended.yaml")
    assert saved.sha256 == bench.shown(Switches().switched("motor-lag", True)).model.sha256
    assert "motor-lag --model khepera -o extended.yaml" in page.locator("#bns-commands").inner_text()
    shown(page, "next")


def test_snapshots_stand_side_by_side_and_lead_back(page, bench):
    go(page, "Effects", "#bns-errors")
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
    kept = page.locator("#bns-snapshots tbody tr").filter(
        has=page.get_by_role("rowheader", name="with lag", exact=True)
    )
    models = bench.shown(Switches().switched("motor-lag", True)).errors.horizons["1s"].models
    assert [float(kept.locator("td").nth(1).inner_text()), after] == [round(1e3 * models[-1].rms_m, 2)] * 2
    shown(page, "snapshots")


def test_a_saved_session_opens_as_it_was(page, visit, tmp_path):
    go(page, "Next", "#bns-commands")
    with page.expect_download() as got:
        page.get_by_role("link", name="Save the session").click()
    saved = tmp_path / got.value.suggested_filename
    got.value.save_as(saved)
    other = visit.open()
    other.get_by_label("Or a file of this machine").fill(str(saved))
    other.get_by_role("button", name="Open the file").click()
    other.locator("#bns-log").wait_for()
    go(other, "Effects", "#bns-errors")
    assert error_of(other, "+ motor-lag") == error_of_session(page)
    other.locator("#bns-snapshots").wait_for()
    other.close()


def error_of_session(page):
    go(page, "Effects", "#bns-errors")
    return error_of(page, "+ motor-lag")


def test_the_next_experiment_is_drawn_in_an_arena(page):
    go(page, "Next", "#bns-commands")
    page.get_by_role("link", name="Save the session").wait_for()  # what follows stands still from here on
    picture = page.locator(".bk-Figure").first
    before = page.get_by_label("x from (m)").input_value()
    for _ in range(20):  # a drag while the page still grows misses the picture
        picture.evaluate("element => element.scrollIntoView({block: 'center'})")
        page.wait_for_timeout(300)
        box = picture.bounding_box()
        page.mouse.move(box["x"] + 0.2 * box["width"], box["y"] + 0.25 * box["height"])
        page.mouse.down()
        page.mouse.move(box["x"] + 0.9 * box["width"], box["y"] + 0.85 * box["height"], steps=6)
        page.mouse.up()
        page.wait_for_timeout(1000)
        if page.get_by_label("x from (m)").input_value() != before:
            break
    assert page.get_by_label("x from (m)").input_value() != before
    page.get_by_label("Minutes of driving").fill("2")
    page.get_by_role("button", name="Propose the next experiment").click()
    page.locator("#bns-pairs, .bns-error").first.wait_for()
    shown(page, "experiment")
    assert page.locator("#bns-pairs").count() == 1


def test_controllers_are_evolved_in_the_model(page):
    page.get_by_label("Evaluations").fill("3")
    page.get_by_label("Evaluations").press("Enter")
    page.get_by_role("button", name="Evolve in this model").click()
    page.locator("#bns-evolved").wait_for()
    assert "goals reached" in page.locator("#bns-evolved").inner_text()
    shown(page, "evolved")


def test_everything_can_be_read_on_a_narrow_screen(page, visit):
    page = visit.open(400, page.url)
    page.locator("#bns-errors").wait_for()
    for screen, sign in (
        ("Data", "#bns-log"),
        ("Model", "#bns-model"),
        ("Where it fails", "#bns-compared"),
        ("Effects", "#bns-errors"),
    ):
        go(page, screen, sign)
        page.wait_for_timeout(500)
        shown(page, f"narrow-{screen.split()[0].lower()}")
        wide = page.locator(".bk-Figure, .bns-scroll, input, button").evaluate_all(
            "all => Math.max(...all.map(e => e.getBoundingClientRect().right))"
        )
        assert wide <= 400, screen
    page.close()


def test_nothing_was_asked_of_anybody_else_and_nothing_went_wrong(page, visit):
    assert visit.outside == []
    assert visit.odd == []
    page.close()
    code, said = visit.end()
    assert code == 0
    assert "bns/app" not in said, (
        said
    )  # no traceback of ours; Tornado may complain of a tab that closed while it was spoken to
