"""The second generator does what its causes say: closed forms of single commands."""

import numpy as np
import pytest

import bns
from tests.hidden_effects import second_generator
from tests.hidden_effects.second_generator import BASE_M, _driven, _State, _wheel, world


def driven(cause, monkeypatch):
    for name in ("COMMAND_JITTER", "TRIAL_JITTER"):
        monkeypatch.setattr(second_generator, name, 0.0)
    return _driven(cause, np.random.default_rng(3), 0.0)


@pytest.mark.parametrize(("cause", "base"), [("none", BASE_M), ("base", 1.04 * BASE_M)])
def test_the_heading_turns_by_the_difference_of_the_wheels_ways(cause, base, monkeypatch):
    told, ends, path = driven(cause, monkeypatch)
    way = told * np.diff(ends, prepend=0.0)[:, None]
    assert path[-1, 2] - path[0, 2] == pytest.approx((way[:, 1] - way[:, 0]).sum() / base, abs=1e-9)


def test_a_delay_lacks_the_way_of_the_last_of_each_change(monkeypatch):
    told, ends, path = driven("delay", monkeypatch)
    way = told * np.diff(ends, prepend=0.0)[:, None]
    lost = 0.12 * (told[-1, 1] - told[-1, 0])
    turned = ((way[:, 1] - way[:, 0]).sum() - lost) / BASE_M
    assert path[-1, 2] - path[0, 2] == pytest.approx(turned, abs=0.01)


@pytest.mark.parametrize(
    ("cause", "speed", "driven"),
    [("dead-zone", -0.1, -0.092), ("limit", 0.2, 0.14), ("steps", 0.11, 0.1), ("backwards", -0.1, -0.09)],
)
def test_a_wheel_drives_what_its_cause_says(cause, speed, driven):
    assert _wheel(cause, 1, speed, 0.0, 0.0, _State()) == pytest.approx(driven)


@pytest.mark.slow
def test_a_log_has_the_columns_the_trials_and_the_losses_that_are_stated():
    table = world("none", seed=2)
    assert set(table) == {"trial", "t_s", "left_m_s", "right_m_s", "x_m", "y_m", "heading_rad"}
    assert table.trial.nunique() == 50
    assert 0.01 < table.x_m.isna().mean() < 0.05


@pytest.mark.slow
def test_how_uneven_a_wheel_is_is_not_overstated():
    """The generator's wheel swings by 8 %; a wave made too small by the uncertainty of its phase had 8.8 to 9.0 %."""
    added = bns.add(world("eccentric", seed=1), ["wheel-eccentricity"], bns.Model("differential-drive", wheelbase_m=BASE_M))
    share = added.to_json()["parameters"]["wheel-eccentricity"]["left_share"]["value"]
    assert share == pytest.approx(0.08, abs=0.005)
