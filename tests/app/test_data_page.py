"""The screen Data in a browser: columns and units by menus."""

import json

import pytest

import bns
from bns.cli.main import main
from bns.examples import FOLDER
from tests.app.visits import SLOW_MS, Visit, go, shown

pytestmark = pytest.mark.slow

sync_api = pytest.importorskip("playwright.sync_api", reason="playwright is not installed")

LOG = FOLDER / "khepera-log.csv"


@pytest.fixture(scope="module")
def visit(browser, tmp_path_factory):
    """Of a log that lies alone: no mapping beside it."""
    log = tmp_path_factory.mktemp("mine") / "mine.csv"
    log.write_bytes(LOG.read_bytes())
    made = Visit(browser, log)
    yield made
    if made.server.poll() is None:
        made.end()


@pytest.fixture(scope="module")
def page(visit):
    return visit.open()


def test_a_log_of_ones_own_opens_with_the_guess_in_menus(page):
    page.get_by_label("Time", exact=True).wait_for()
    assert page.get_by_label("Time", exact=True).input_value() == "time_ms"
    assert page.get_by_role("textbox", name="The mapping").count() == 0  # behind Advanced
    page.get_by_role("alert").filter(has_text="runs backwards").first.wait_for()


def test_every_choice_is_previewed_and_the_right_ones_are_read(page, visit, tmp_path):
    page.get_by_label("Trials", exact=True).select_option("by a column")
    page.get_by_label("Trial", exact=True).select_option("drive")
    page.get_by_label("The heading runs").select_option("clockwise from y (a compass)")
    page.locator("#bns-preview").filter(has_text="14 trials").wait_for()
    shown(page, "columns")
    unit = page.get_by_label("Position x: unit")
    unit.select_option("m")
    page.get_by_role("alert").filter(has_text="millimetres").first.wait_for()
    unit.select_option("mm")
    page.locator("#bns-preview").filter(has_text="14 trials").wait_for()
    with page.expect_download() as got:
        page.get_by_role("link", name="Save mine.csv.import.yaml").click()
    page.get_by_role("button", name="Read it with this").click()
    page.locator("#bns-log").filter(has_text="14 trials").wait_for()
    (tmp_path / "mine.csv").write_bytes(LOG.read_bytes())
    got.value.save_as(tmp_path / got.value.suggested_filename)
    assert bns.Measurements(tmp_path / "mine.csv").sha256 == bns.Measurements(LOG).sha256


def test_the_mapping_is_reachable_as_yaml_and_the_menus_follow_it(page):
    page.get_by_role("button", name="Columns and units").click()
    page.get_by_role("button", name="Advanced: the mapping as YAML").click()
    text = page.get_by_role("textbox", name="The mapping")
    assert "from: drive" in text.input_value()
    text.fill(text.input_value().replace("unit: ms", "unit: s"))
    text.blur()
    page.get_by_role("alert").filter(has_text="apart").first.wait_for()
    assert page.get_by_label("Time: unit").input_value() == "s"


def poses_that_take_part(page):
    return page.locator("#bns-part").inner_text()


def used_of(page, tmp_path):
    """The measurements that the page saves."""
    go(page, "Next", "#bns-commands")
    page.get_by_role("button", name="Prepare the measurements that took part").click()
    with page.expect_download() as got:
        page.get_by_role("link", name="Save the measurements").click()
    got.value.save_as(tmp_path / "used.csv")
    return tmp_path / "used.csv"


@pytest.fixture(scope="module")
def sample(visit):
    page = visit.open(address=visit.address + "?tab=another")
    page.get_by_label("Or a file of this machine").fill(str(LOG))
    page.get_by_role("button", name="Open the file").click()
    page.locator("#bns-log").filter(has_text="khepera-log").wait_for()
    return page


def test_a_finding_and_the_ends_of_a_trial_are_left_out_and_numbers_are_those_of_the_saved_file(sample, tmp_path, capsys):
    page, log = sample, bns.Measurements(LOG)
    finding = log.findings.iloc[0]
    page.get_by_role("checkbox", name=f"trial {finding['trial']}, row {finding['row']}:").first.check()
    page.locator("#bns-part").wait_for()
    name = str(log.trials["trial"].iloc[1])
    page.get_by_label("Trial to cut").select_option(name)
    picture = page.locator(".bk-Figure").nth(1)
    start = page.get_by_label("keep from (s)")
    for _ in range(20):  # a drag while the page still grows misses the picture
        picture.evaluate("element => element.scrollIntoView({block: 'center'})")
        page.wait_for_timeout(300)
        box = picture.bounding_box()
        page.mouse.move(box["x"] + 0.3 * box["width"], box["y"] + 0.4 * box["height"])
        page.mouse.down()
        page.mouse.move(box["x"] + 0.7 * box["width"], box["y"] + 0.5 * box["height"], steps=6)
        page.mouse.up()
        page.wait_for_timeout(700)
        if float(start.input_value()) > 0:
            break
    assert float(start.input_value()) > 0
    start.fill("2")
    start.press("Enter")
    page.get_by_label("to (s)", exact=True).fill("6.5")
    page.get_by_label("to (s)", exact=True).press("Enter")
    page.get_by_role("button", name="Keep only this stretch").click()
    less = log.without_rows(log.rows_around(int(finding["row"]))).cut({name: (2.0, 6.5)})
    page.locator("#bns-part").filter(has_text=f"{int(less.trials['poses'].sum())} poses").wait_for()
    shown(page, "left-out")
    saved = used_of(page, tmp_path)
    assert bns.Measurements(saved).sha256 == less.sha256
    python = page.locator("#bns-python").inner_text()
    names = {}
    exec(python.split("model =")[0], names)
    assert names["log"].sha256 == less.sha256
    assert "used.csv" in page.locator("#bns-commands").inner_text()
    go(page, "Where it fails", "#bns-compared")
    said = page.locator("#bns-compared tbody tr td").first.inner_text()
    assert main(["compare", str(saved), "--model", "khepera", "--json"]) == 0
    error = next(iter(json.loads(capsys.readouterr().out)["error"].values()))
    assert float(said) == round(1e3 * error["position_m"], 2)


def test_what_was_left_out_survives_a_reload_and_a_session_and_comes_back(sample, tmp_path):
    page = sample
    page.reload()
    go(page, "Data", "#bns-part")
    before = poses_that_take_part(page)
    assert page.get_by_role("checkbox", name="trial ").first.is_checked()
    go(page, "Next", "#bns-commands")
    with page.expect_download() as got:
        page.get_by_role("link", name="Save the session").click()
    got.value.save_as(tmp_path / "explore.session.yaml")
    go(page, "Data", "#bns-part")
    page.get_by_role("checkbox", name="trial ").first.uncheck()
    page.locator("#bns-part").filter(has_not_text=before).wait_for()
    page.get_by_role("button", name="Keep the whole trial").click()
    page.get_by_label("Trial to cut").select_option(index=1)
    sync_api.expect(page.get_by_label("keep from (s)")).to_have_value("2", timeout=SLOW_MS)  # its cut is shown
    page.get_by_role("button", name="Keep the whole trial").click()
    page.locator("#bns-part").wait_for(state="detached")
    page.get_by_label("Or a file of this machine").fill(str(tmp_path / "explore.session.yaml"))
    page.get_by_role("button", name="Open the file").click()
    page.locator("#bns-part").filter(has_text=before).wait_for()


def test_menus_can_be_read_on_a_narrow_screen_and_nothing_went_wrong(page, visit):
    narrow = visit.open(400, page.url)
    go(narrow, "Data", "#bns-log")
    narrow.get_by_role("button", name="Columns and units").click()
    narrow.get_by_label("Time", exact=True).wait_for()
    shown(narrow, "narrow-columns")
    wide = narrow.locator("select, input, button").evaluate_all(
        "all => Math.max(...all.map(e => e.getBoundingClientRect().right))"
    )
    assert wide <= 400
    assert visit.outside == []
    assert visit.odd == []
