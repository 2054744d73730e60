"""Speeds in another unit are told from how far robots go, before a wheelbase or an effect is blamed; a gain is no unit."""

import re

import numpy as np
import pytest

from bns.api.common.prepared import prepared
from bns.api.model import Model
from bns.cli.main import main
from bns.diagnose.data.checks import checked
from bns.diagnose.data.speed_units import mistake_of, mistakes
from bns.errors import DataError
from bns.measurements import write_measurements
from tests.diagnose.worlds import NOMINAL, hidden, measured

KINDS = {"turning": {}, "reversing": {"speeds": (-0.2, 0.2)}, "long": {"commands": 12}, "stopping": {"pauses": True}}
TOO_FAST, TOO_SLOW = "look like km/h. ", "look like m/s that were taken for km/h. "


def scaled(table, factor):
    """Commands that are this many times too large."""
    return table.assign(left_m_s=table.left_m_s * factor, right_m_s=table.right_m_s * factor)


def notes(table):
    return [f.text for f in checked(table)[1] if "times as far as commanded" in f.text]


@pytest.fixture(scope="module", params=KINDS)
def table(request):
    return measured(NOMINAL, trials=12, **KINDS[request.param])


@pytest.mark.parametrize(("factor", "said"), [(3.6, TOO_FAST), (1 / 3.6, TOO_SLOW)])
def test_kilometres_per_hour_are_noted_and_never_taken_for_a_wheelbase(table, factor, said):
    (note,) = notes(scaled(table, factor))
    assert said in note
    assert "12 of 12 trials" in note
    assert "before any effect or wheelbase is believed; if the unit is right, the robot has this gain" in note
    with pytest.raises(DataError, match=said) as refused:
        prepared(scaled(table, factor), "khepera")
    assert "--wheelbase" not in str(refused.value)


@pytest.mark.parametrize(
    ("factor", "said"),
    [
        (9.5493, "look like turns per minute \\(rpm\\) taken for rad/s, .* or multiply `scale` .* by 0.10472"),
        (1 / 9.5493, "look like rad/s that were taken for turns per minute"),
        (1 / 100, "turns as much further: left_m_s and right_m_s look like m/s that were taken for cm/s"),
        (1 / 1000, "turns as much further: left_m_s and right_m_s look like m/s that were taken for mm/s"),
        (1 / 60, "or the same for the speeds, if they were divided by 60"),
    ],
)
def test_other_factors_between_units_of_speed_are_named(table, factor, said):
    with pytest.raises(DataError, match=said) as refused:
        prepared(scaled(table, factor), "khepera")
    assert "--wheelbase" not in str(refused.value)


@pytest.mark.parametrize("gain", [0.3, 0.5, 0.7, 0.9, 1.0, 1.1, 1.5, 2.0, 2.8])
def test_a_gain_of_the_robots_own_is_no_unit(table, gain):
    assert notes(scaled(table, 1 / gain)) == []


@pytest.mark.parametrize(
    "effects",
    [{"motor_lag": {"tau_s": 0.4}}, {"turn_slip": {"slip_s": 0.3}}, {"dead_zone": {"width_m_s": 0.02}}],
)
def test_effects_are_no_unit_and_do_not_hide_one(effects):
    world = measured(hidden(**effects), trials=12, commands=8)
    assert notes(world) == []
    assert not effects.get("motor_lag") or TOO_FAST in notes(scaled(world, 3.6))[0]


def test_some_trials_in_another_unit_are_no_unit_of_the_log():
    table = measured(NOMINAL, trials=12)
    assert notes(scaled(table, np.where(table.trial < 8, 3.6, 1.0))) == []  # more than half of the windows, not of the trials


def test_a_robot_that_hardly_moves_or_turns_on_the_spot_says_nothing():
    table = measured(NOMINAL, trials=12)
    still = table.assign(x_m=0.0, y_m=0.0)
    assert notes(still) == []
    spinning = scaled(table, 3.6)
    assert notes(spinning.assign(left_m_s=-spinning.right_m_s)) == []


@pytest.mark.parametrize("mistake", mistakes(), ids=lambda one: one.looks)
def test_every_mistake_lies_far_from_a_plausible_gain_and_is_found_within_a_narrow_band(mistake):
    assert not 0.3 / 1.05 < mistake.ratio < 2.0 * 1.05
    assert mistake_of(1.04 * mistake.ratio) == mistake_of(mistake.ratio / 1.04) == mistake
    assert mistake_of(1.12 * mistake.ratio) != mistake
    assert mistake_of(float("nan")) is None


def test_another_wheelbase_is_still_one():
    with pytest.raises(DataError, match=r"--wheelbase 0\.08"):
        prepared(measured(NOMINAL, trials=12), Model(wheelbase_m=0.35))


def test_the_note_stands_before_the_refusal(tmp_path, capsys):
    write_measurements(scaled(measured(NOMINAL, trials=12), 3.6), tmp_path / "log.csv")
    assert main(["diagnose", str(tmp_path / "log.csv"), "--model", "khepera"]) == 2
    said = capsys.readouterr().err
    assert said.index("in 12 of 12 trials the robot goes") < said.index("bns: The robot goes and turns 0.28 times as far")


@pytest.mark.parametrize(("wheel", "factor"), [("left_m_s", 10.0), ("right_m_s", 100.0), ("left_m_s", 0.01)])
def test_wheels_in_different_units_are_refused(table, wheel, factor):
    other = table.assign(**{wheel: table[wheel] / factor})
    name = wheel.removesuffix("_m_s") if factor > 1 else {"left_m_s": "right"}[wheel]
    with pytest.raises(DataError, match=rf"the {name} wheel takes the robot .* times as far .* not in the same unit"):
        prepared(other, NOMINAL)


def refused(table):
    """What is said of a table that is refused; "" of one that is not."""
    try:
        checked(table)
    except DataError as error:
        return str(error)
    return ""


@pytest.mark.parametrize("factor", [4.0, 7.0, 1 / 3.6])
def test_a_wheel_that_does_much_less_than_the_other_is_in_no_other_unit(table, factor):
    assert "not in the same unit" not in refused(table.assign(left_m_s=table.left_m_s * factor))


def test_of_wheels_that_are_always_told_alike_nobody_knows_what_each_does():
    assert refused(measured(NOMINAL, trials=12, straight=1.0)) == ""


@pytest.mark.parametrize(
    ("lengths", "speeds", "base_m", "or_else"),
    [(0.1, 1.0, r"0\.0[89]\d*", r"0\.00[89]\d*"), (1.0, 10.0, r"0\.[89]\d*", r"0\.0[89]\d*")],
)
def test_lengths_and_speeds_in_another_unit_are_told_apart_by_the_wheelbase(table, lengths, speeds, base_m, or_else):
    """The Khepera's wheels are 89 mm apart: the user knows which of two wheelbases that is, and the log does not."""
    other = scaled(table.assign(x_m=table.x_m * lengths, y_m=table.y_m * lengths), speeds)
    said = f"wheels are about {base_m} m apart, the speeds are right, and x_m and .*; if about {or_else} m, the speeds are not"
    assert re.search(said, refused(other)), refused(other)


def test_times_a_thousand_times_too_short_are_told(table):
    with pytest.raises(DataError, match="t_s looks like milliseconds that were taken for microseconds"):
        prepared(table.assign(t_s=table.t_s / 1000), NOMINAL)
