"""A person who has not read the manual, a log, and the page alone: what is missing, how large it is, and the saved model."""

import re

import pytest
import yaml

import bns
from tests.app.visits import error_of, go, save, settled, shown
from tests.diagnose.worlds import NOMINAL, hidden, measured

pytestmark = pytest.mark.slow

PATCH = {"x_m": 0.1, "y_m": -0.05, "radius_m": 0.25, "loss": 0.5}
DROP = """([name, text]) => {
  const files = new DataTransfer()
  files.items.add(new File([text], name, {type: "text/csv"}))
  for (const what of ["dragover", "drop"])
    document.body.dispatchEvent(new DragEvent(what, {dataTransfer: files, bubbles: true, cancelable: true}))
}"""


def dropped(visit, table):
    """The page with a log that was dropped on it, diagnosed."""
    page = visit().open()
    page.get_by_role("button", name="Open the sample").wait_for()
    settled(page)
    page.evaluate(DROP, ["dropped.csv", table.to_csv(index=False)])
    page.locator("#bns-log").filter(has_text="dropped.csv").wait_for()
    for screen, sign in (("Model", "#bns-model"), ("Where it fails", "#bns-compared"), ("Effects", "#bns-errors")):
        page.get_by_role("button", name=f"Continue: {screen}").click()
        page.locator(sign).wait_for()
    page.get_by_role("button", name="Diagnose in the background").click()
    page.locator("#bns-verdict").wait_for()
    settled(page)
    return page


def saved(page, folder):
    """The model that the Next screen saves."""
    page.get_by_role("button", name="Continue: Next").click()
    page.locator("#bns-saved").wait_for()
    settled(page)
    return save(page, "Save the model", folder)


def interval(page, parameter):
    """What the verdict says of a parameter: value, low, high."""
    line = re.search(rf"{parameter} = (.+)", page.locator("#bns-verdict").inner_text()).group(1)
    return [float(n) for n in re.findall(r"-?\d+\.\d+", line)]


def test_one_effect_is_named_with_its_size_and_the_model_is_saved(visit, tmp_path):
    page = dropped(visit, measured(hidden(turn_slip={"slip_s": 0.12})))
    assert "turning costs forward speed" in page.locator("#bns-verdict").inner_text()
    value, low, high = interval(page, "slip_s")
    assert low < 0.12 < high
    before = error_of(page, "as given")
    page.get_by_role("button", name="Switch on what it found").click()
    assert error_of(page, "+ turn-slip") < before
    model = bns.Model(saved(page, tmp_path))
    assert model.values_of("turn-slip")["slip_s"] == pytest.approx(value, abs=high - low)
    assert "95 %" in page.locator("#bns-sizes").inner_text()


def test_a_patch_of_floor_is_found_with_its_place(visit, tmp_path):
    page = dropped(visit, measured(hidden(floor_patch=PATCH), trials=40, commands=8))
    assert re.search(r"the robot is \d+ % slower on one patch of the floor", page.locator("#bns-verdict").inner_text())
    assert "times the usual error" not in page.locator("body").inner_text()  # the path over the rim has settled
    _value, low, high = interval(page, "x_m")
    assert low < 100 < high
    page.get_by_role("button", name="Switch on what it found").click()
    error_of(page, "+ floor-patch")
    shown(page, "patch")
    assert bns.Model(saved(page, tmp_path)).values_of("floor-patch")["radius_m"] == pytest.approx(0.25, abs=0.01)


def test_of_a_tie_both_explanations_have_numbers_and_either_is_switched_on(visit, tmp_path):
    table = measured(hidden(command_delay={"delay_s": 0.08}))
    page = dropped(visit, table)
    page.get_by_role("button", name="Switch on clock-offset").wait_for()
    assert "cannot decide which" in page.locator("#bns-verdict").inner_text()
    assert "time-stamp an event that both clocks see" in page.locator("#bns-notes").inner_text()
    for parameter in ("delay_s", "offset_s"):
        _value, low, high = interval(page, parameter)
        assert low < 80 < high
    shown(page, "tie")
    page.get_by_role("button", name="Switch on command-delay").click()
    delay = error_of(page, "+ command-delay")
    page.get_by_role("button", name="Switch on clock-offset").click()
    assert error_of(page, "+ clock-offset") == pytest.approx(delay, abs=0.05)
    assert not page.get_by_role("checkbox", name="command-delay:").is_checked()  # one explanation at a time
    assert [e["name"] for e in yaml.safe_load(saved(page, tmp_path).read_text())["effects"]] == ["clock-offset"]
    page.get_by_role("button", name="Propose the next experiment").click()
    page.get_by_role("cell", name="no commands tell them apart").first.wait_for()
    page.reload()
    page.locator("#bns-saved").wait_for()
    go(page, "Effects", "#bns-verdict")
    page.get_by_role("button", name="Switch on clock-offset").wait_for()


def test_where_nothing_is_hidden_that_is_said_and_the_model_stays_as_it_is(visit, tmp_path):
    page = dropped(visit, measured(NOMINAL))
    said = page.locator("#bns-verdict").inner_text()
    assert "Nothing is missing from the model" in said
    assert "Nothing needs to be switched on" in said
    assert f"1 second ahead is {error_of(page, 'as given'):.2f} mm" in said
    assert f"causes {error_of(page, 'noise of the tracking'):.2f} mm" in said
    assert page.get_by_role("button", name="Switch on").count() == 0
    shown(page, "nothing")
    assert bns.Model(saved(page, tmp_path)).canonical_json() == bns.Model("khepera").canonical_json()
    page.get_by_role("button", name="Copy").first.click()
    page.get_by_role("button", name="Copied").wait_for()
