"""The table of errors stays visible while the list of effects scrolls; dimensionless parameters are shown without a unit."""

import pytest

from bns.examples import FOLDER
from bns.physics.effect import Effect, Parameter

pytest.importorskip("panel", reason="the extra app (Panel) is not installed")

from bns.app.html import effect_text
from bns.app.names import text_on
from bns.app.screens.one_effect import OneEffect
from tests.app.visits import error_of, settled, shown

NUMBER = {"value": 1.0302, "low": 1.029, "high": 1.032, "unit": "1"}


def effect(unit):
    p = Parameter("ratio", unit, 0.1, 10.0, (0.5, 2.0), 1.0, "how large")
    return Effect("size", "wheel", (p,), "v' = ratio v", "larger", (), lambda wheels, ratio: wheels)


@pytest.mark.parametrize(("unit", "box", "slider"), [("1", "ratio, by hand", "ratio"), ("s", "ratio (s), by hand", "ratio, s")])
def test_a_bare_number_has_no_unit(unit, box, slider):
    one = effect(unit)
    made = OneEffect(one, lambda *_: None, lambda *_: None)._slider(one.parameters[0], 1.0)
    assert (text_on(made._box), text_on(made._slider)) == (box, slider)
    text = effect_text(one, (), {"ratio": {**NUMBER, "unit": unit}}, "")
    assert f"<b>ratio</b> = 1.0302{'' if unit == '1' else ' s'} (" in text


@pytest.mark.slow
def test_the_errors_stay_in_view_beside_the_last_switch(visit):
    page = visit(FOLDER / "khepera-log.csv").open()
    page.set_viewport_size({"width": 1280, "height": 800})
    page.get_by_role("checkbox", name="motor-lag:").check()
    error_of(page, "+ motor-lag")
    last = page.get_by_label("Formula")
    last.wait_for()
    settled(page)
    last.scroll_into_view_if_needed()
    settled(page)
    place = last.bounding_box()
    assert 0 <= place["y"] < 800
    shown(page, "in-view")
    place = page.locator("#bns-errors").bounding_box()
    assert 0 <= place["y"] < 800 - place["height"]
    page.set_viewport_size({"width": 400, "height": 800})
    settled(page)
    last.scroll_into_view_if_needed()
    assert page.locator("#bns-errors").bounding_box()["y"] < -800  # below each other, nothing covers the switches
