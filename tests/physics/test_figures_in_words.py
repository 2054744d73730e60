"""Numbers in sentences: no exponent at sizes that robots have, and ends of intervals that differ."""

import pytest

import bns
from bns.diagnose.report.text import _number
from bns.diagnose.residuals.floor_lines import FloorLines
from bns.physics.effects import effect_named
from bns.physics.figures import decimals, figures, figures_apart, figures_of_interval, mm

WORDS = {
    "backlash-start": (
        {"gap_m": 0.4, "crossed_share": 0.0},
        "for 400 mm of its way whenever it changes direction, and for 400 mm when",
    ),
    "backlash-mismatch": (
        {"gap_m": 0.3, "left_share": 0.5, "crossed_share": 1.0},
        "the right wheel for 450 mm of its way whenever it changes direction, and the left one for 150 mm",
    ),
    "floor-joints": ({"loss_m": 0.4, "spacing_m": 0.3}, "a wheel loses 400 mm of its way at each"),
}


@pytest.mark.parametrize(
    ("value", "count", "said"),
    [(400.0, 2, "400"), (4.56, 2, "4.6"), (0.0312, 2, "0.031"), (12345.0, 3, "12300"), (4.0, 2, "4"), (-450.0, 2, "-450")],
)
def test_figures_have_no_exponent(value, count, said):
    assert figures(value, count) == said
    assert mm(value / 1e3, count) == f"{said} mm"


@pytest.mark.parametrize(("low", "high", "count"), [(3.98, 4.03, 3), (3.0, 4.0, 2), (3.99999, 4.00001, 6), (4.0, 4.0, 2)])
def test_as_many_figures_as_set_two_ends_apart(low, high, count):
    assert figures_apart(low, high) == count


@pytest.mark.parametrize("name", WORDS)
def test_sentences_of_effects_have_no_exponent(name):
    values, said = WORDS[name]
    assert said in effect_named(name).sized_by(values)


def test_lines_on_a_floor_have_no_exponent():
    assert "loses about 400 mm of its way" in FloorLines(0.0, (0.1,), None, 0.4, 5.0).in_words


def test_an_interval_that_is_narrow_beside_its_number_has_two_ends():
    number = {"value": 0.100002, "low": 0.100001, "high": 0.100004, "unit": "m"}
    assert _number("width_m", number) == "width_m = 0.100002 m (95 %: 0.100001 to 0.100004)"


def test_a_bare_number_has_no_unit_in_the_summary_of_a_model():
    said = bns.Model("khepera").with_effect("wheelbase", factor=1.1772).with_effect("motor-lag", tau_s=0.1).summary()
    assert "wheelbase: factor = 1.1772 (guess)" in said
    assert "motor-lag: tau_s = 0.1 s (guess)" in said


@pytest.mark.parametrize(
    ("value", "low", "high", "count"),
    [
        (0.20011, 0.19929, 0.20094, 5),
        (455_001.592, 455_001.587, 455_001.597, 9),  # to millimetres, 455 km away
        (-900.0, -900.001, -899.999, 7),
        (0.0, 0.0, 0.0, 5),
        (1.0, 0.0, float("inf"), 5),
    ],
)
def test_figures_show_how_far_the_ends_of_an_interval_are_apart(value, low, high, count):
    assert figures_of_interval(value, low, high) == count


@pytest.mark.parametrize(("size", "count"), [(0.0, 0), (250.0, 0), (17.0, 0), (1.7, 1), (0.017, 3), (1e-30, 8)])
def test_decimals_show_two_figures_of_a_size(size, count):
    assert decimals(size) == count
