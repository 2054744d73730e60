"""The screen Data in a browser: columns and units by menus, and what of a log is left out."""

import json

import pytest

import bns
from bns.cli.main import main
from bns.examples import FOLDER
from tests.app.visits import SLOW_MS, drag, figures, go, save, settled, shown, widest

pytestmark = pytest.mark.slow

sync_api = pytest.importorskip("playwright.sync_api", reason="playwright is not installed")

LOG = FOLDER / "khepera-log.csv"


def test_a_log_of_ones_own_is_read_by_menus_with_a_preview_of_every_choice(visit, tmp_path):
    alone = tmp_path / "mine.csv"  # no mapping beside it
    alone.write_bytes(LOG.read_bytes())
    visited = visit(alone)
    page = visited.open()
    page.get_by_label("Time", exact=True).wait_for()
    assert page.get_by_label("Time", exact=True).input_value() == "time_ms"
    assert page.get_by_role("textbox", name="The mapping").count() == 0  # behind Advanced
    page.get_by_role("alert").filter(has_text="runs backwards").first.wait_for()
    page.get_by_label("Trials", exact=True).select_option("by a column")
    page.get_by_label("Trial", exact=True).select_option("drive")
    page.get_by_label("The heading runs").select_option("clockwise from y (a compass)")
    page.locator("#bns-preview").filter(has_text="14 trials").wait_for()
    shown(page, "columns")
    unit = page.get_by_label("Position x: unit")
    unit.select_option("m")
    page.get_by_role("alert").filter(has_text="in different units").first.wait_for()
    unit.select_option("mm")
    page.locator("#bns-preview").filter(has_text="14 trials").wait_for()
    save(page, "Save mine.csv.import.yaml", tmp_path)
    page.get_by_role("button", name="Read it with this").click()
    page.locator("#bns-log").filter(has_text="14 trials").wait_for()
    assert bns.Measurements(alone).sha256 == bns.Measurements(LOG).sha256  # read by the mapping that was saved beside it
    page.get_by_role("button", name="Columns and units").click()
    page.get_by_role("button", name="Advanced: the mapping as YAML").click()
    text = page.get_by_role("textbox", name="The mapping")
    assert "from: drive" in text.input_value()
    text.fill(text.input_value().replace("unit: ms", "unit: s"))
    text.blur()
    page.get_by_role("alert").filter(has_text="apart").first.wait_for()
    assert page.get_by_label("Time: unit").input_value() == "s"
    narrow = visited.open(400, page.url)
    go(narrow, "Data", "#bns-log")
    narrow.get_by_role("button", name="Columns and units").click()
    narrow.get_by_label("Time", exact=True).wait_for()
    settled(narrow)
    shown(narrow, "narrow-columns")
    assert widest(narrow) <= 400


def test_what_is_left_out_takes_no_part_in_any_number_and_comes_back(visit, tmp_path, capsys):
    page, log = visit(LOG).open(), bns.Measurements(LOG)
    go(page, "Data", "#bns-log")
    finding = log.findings.iloc[0]
    page.get_by_role("checkbox", name=f"trial {finding['trial']}, row {finding['row']}:").first.check()
    page.locator("#bns-part").wait_for()
    name = str(log.trials["trial"].iloc[1])
    page.get_by_label("Trial to cut").select_option(name)
    start = page.get_by_label("keep from (s)")
    drag(page, figures(page).nth(1), (0.3, 0.4), (0.7, 0.5), lambda: float(start.input_value()) > 0)
    start.fill("2")
    start.press("Enter")
    page.get_by_label("to (s)", exact=True).fill("6.5")
    keep = page.get_by_role("button", name="Keep only this stretch")
    keep.evaluate("(button) => (document.activeElement.blur(), button.click())")  # no time between the number and the click
    less = log.without_rows(log.rows_around(int(finding["row"]))).cut({name: (2.0, 6.5)})
    page.locator("#bns-part").filter(has_text=f"{int(less.trials['poses'].sum())} poses").wait_for()
    shown(page, "left-out")
    go(page, "Next", "#bns-commands")
    page.get_by_role("button", name="Prepare the measurements that were used").click()
    saved = save(page, "Save the measurements", tmp_path)
    assert bns.Measurements(saved).sha256 == less.sha256
    names = {}
    exec(page.locator("#bns-python").inner_text().split("model =")[0], names)
    assert names["log"].sha256 == less.sha256
    assert "used.csv" in page.locator("#bns-commands").inner_text()
    go(page, "Where it fails", "#bns-compared")
    said = page.locator("#bns-compared tbody tr td").first.inner_text()
    assert main(["compare", str(saved), "--model", "khepera", "--json"]) == 0
    error = next(iter(json.loads(capsys.readouterr().out)["error"].values()))
    assert float(said) == round(1e3 * error["position_m"], 2)
    page.reload()
    go(page, "Data", "#bns-part")
    before = page.locator("#bns-part").inner_text()
    assert page.get_by_role("checkbox", name="trial ").first.is_checked()
    go(page, "Next", "#bns-commands")
    session = save(page, "Save the session", tmp_path)
    go(page, "Data", "#bns-part")
    page.get_by_role("checkbox", name="trial ").first.uncheck()
    page.locator("#bns-part").filter(has_not_text=before).wait_for()
    page.get_by_role("button", name="Keep the whole trial").click()
    page.get_by_label("Trial to cut").select_option(index=1)
    sync_api.expect(page.get_by_label("keep from (s)")).to_have_value("2", timeout=SLOW_MS)  # its cut is shown
    page.get_by_role("button", name="Keep the whole trial").click()
    page.locator("#bns-part").wait_for(state="detached")
    page.get_by_label("Or a file of this machine").fill(str(session))
    page.get_by_role("button", name="Open the file").click()
    page.locator("#bns-part").filter(has_text=before).wait_for()
