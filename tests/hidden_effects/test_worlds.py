"""The same seed makes the same world, another seed another; nuisances have the size that is stated."""

from dataclasses import replace

import numpy as np
import pandas as pd
import pytest

from tests.hidden_effects.acceptable import acceptable
from tests.hidden_effects.camera import Camera, Layout, stamps
from tests.hidden_effects.listed import LISTED
from tests.hidden_effects.luck import luck
from tests.hidden_effects.plan import LEVELS, STRENGTHS, UNLISTED, worlds
from tests.hidden_effects.plan_further import ALIKE, BESIDE, LONGER
from tests.hidden_effects.world import World, motor_jitter

SMALL = World("small", "single", {"speed-gain": {"gain": 1.05}}, trials=3)
STILL = Camera(0.0, 0.0, 1e-9, 1e-9, lost=0.0)


def test_same_seed_same_world_other_seed_another():
    pd.testing.assert_frame_equal(SMALL.table(), SMALL.table())
    other = replace(SMALL, seed=1).table()
    assert len(other) != len(SMALL.table()) or not np.allclose(other["x_m"], SMALL.table()["x_m"])


def test_camera_noise_is_as_stated():
    noisy = replace(SMALL, camera=replace(STILL, position_m=0.002, heading_rad=0.01)).table()
    clean = replace(SMALL, camera=STILL).table()
    away = (noisy - clean)[["x_m", "y_m", "heading_rad"]].std()
    np.testing.assert_allclose(away, [0.002, 0.002, 0.01], rtol=0.1)


def test_quantisation_outliers_and_losses():
    table = replace(SMALL, camera=Camera(0.001, 0.005, 0.001, 0.01, lost=0.1, outliers=0.05)).table()
    clean = replace(SMALL, camera=STILL).table()
    seen = table["x_m"].notna()
    ticks = table["x_m"][seen] / 0.001
    np.testing.assert_allclose(ticks, ticks.round(), atol=1e-6)
    assert 0.03 < 1 - seen.mean() < 0.2
    assert 0.01 < (np.abs(table["x_m"] - clean["x_m"])[seen] > 0.02).mean() < 0.09


def test_lost_rows_can_be_missing():
    camera = Camera(0.001, 0.005, lost=0.1)
    with_nan = replace(SMALL, camera=camera).table()
    without = replace(SMALL, camera=camera, layout=Layout(missing=True)).table()
    assert not without["x_m"].isna().any()
    assert len(without) == with_nan["x_m"].notna().sum()


def test_motor_jitter_is_as_stated():
    jitter = motor_jitter(luck(0, "j"), (2000, 10, 2), 0.004)
    assert jitter.std() == pytest.approx(0.004 * np.sqrt(1.25), rel=0.03)
    assert jitter.mean(axis=1).std() == pytest.approx(0.004 * np.sqrt(0.1 + 0.25), rel=0.05)


def test_rows_of_each_layout():
    edges = np.array([0.0, 0.2, 0.41])
    assert stamps(edges, Layout("ends"))[0].tolist() == [0.0, 0.2, 0.41]
    t, extra = stamps(edges, Layout("frames+changes"))
    assert t[extra].tolist() == [0.41]
    assert len(t) == 12


def test_commands_hold_from_their_row_on_and_end_with_nan():
    told = SMALL.driving()
    table = replace(SMALL, camera=STILL).table()
    first = table[table["trial"] == 0]
    change = first[np.isclose(first["t_s"], told.edges_s[0, 1])]
    assert change["left_m_s"].item() == pytest.approx(told.wheels_m_s[0, 1, 0])
    assert np.isnan(first["left_m_s"].iloc[-1])
    assert first["left_m_s"].iloc[:-1].notna().all()


def test_an_early_clock_sees_the_future():
    clean = replace(SMALL, camera=STILL).table()
    ahead = replace(SMALL, camera=STILL, hidden=SMALL.hidden | {"clock-offset": {"offset_s": -0.04}}).table()
    one, two = clean[clean["trial"] == 0], ahead[ahead["trial"] == 0]
    np.testing.assert_allclose(two["x_m"].to_numpy()[:-1], one["x_m"].to_numpy()[1:], atol=2e-6)


def test_the_plan_covers_every_effect_and_names_each_world_once():
    made = worlds(0)
    assert len({world.name for world in made}) == len(made)
    assert {name for world in made if world.family == "single" for name in world.hidden} == set(STRENGTHS)
    assert {name for world in made if not world.barred for name in world.unlisted} == set(UNLISTED)
    beside = {name for others in BESIDE.values() for name in others}
    assert {name for world in made if world.family == "new" for name in world.hidden} == set(LONGER) | beside
    assert {name for world in made for name in world.barred} == set(LONGER) | {n for others in ALIKE.values() for n in others}
    assert set(STRENGTHS) | set(LONGER) | {"command-delay"} == set(LISTED)
    assert sum(world.family == "single" for world in made) >= len(LEVELS) * len(STRENGTHS)


@pytest.mark.parametrize("world", [world for world in worlds(0) if world.family == "single-hard"][::9])
def test_worlds_of_every_kind_can_be_made(world):
    table = replace(world, trials=2).table()
    assert table["trial"].nunique() == 2
    assert table.groupby("trial")["t_s"].is_monotonic_increasing.all()


def named(hidden):
    return [answer["required"] for answer in acceptable(World("w", "single", hidden))]


def test_acceptable_answers():
    assert acceptable(World("w", "none"))[0]["verdict"] == "none"
    assert named({"speed-gain": {"gain": 1.1}}) == [[("speed-gain",)]]
    both = {"speed-gain": {"gain": 1.1}, "wheelbase": {"factor": 0.9}}
    assert named(both) == [[("camera-scale", "speed-gain"), ("camera-scale", "wheelbase"), ("speed-gain", "wheelbase")]]
    assert named({"clock-offset": {"offset_s": -0.1}}) == [[("clock-offset",)]]
    assert named({"clock-offset": {"offset_s": 0.1}}) == [[("clock-offset",), ("command-delay",)]]
    slope = acceptable(World("w", "single", {"floor-slope": {"x_m_s": 0.01, "y_m_s": 0.0}}))
    assert [answer["verdict"] for answer in slope] == ["effects", "tie"]
    assert slope[1]["allowed"] == [("tether-pull",)]


def test_causes_act_in_the_order_of_the_machine_however_a_world_names_them():
    named = {"backlash": {"gap_m": 0.004}, "motor-lag": {"tau_s": 0.1}}
    for hidden in (named, dict(reversed(named.items()))):
        assert [type(one).__name__ for one in World("one", "triple", hidden=hidden).causes()] == ["MotorLag", "Backlash"]
