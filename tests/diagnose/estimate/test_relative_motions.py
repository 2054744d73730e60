"""Single relative motions: a table of two poses a trial, no place, no start from rest, and a calibration of all numbers."""

import json
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pandas as pd
import pytest

from bns.cli.main import main
from bns.diagnose.data.apply_mapping import applied
from bns.diagnose.data.load import load_measured
from bns.diagnose.data.relative_motions import relative_motions
from bns.diagnose.data.sources.read import read_table
from bns.diagnose.estimate.calibration import calibrated, wheel_sizes
from bns.diagnose.estimate.starts import listed
from bns.diagnose.predict.wheels import predictor_for_search
from bns.diagnose.values import numbers_of
from bns.errors import DataError
from bns.physics.model import Model
from bns.physics.wheels.differential_drive import observe, simulate

LASER = Path(__file__).parents[4] / "shared" / "data" / "khepera3_laser"
RADIUS_M, WHEELBASE_M = 0.02075, 0.09
MAPPING = {
    "relative": True,
    "columns": {
        "duration_s": {"from": "T"},
        "left_m_s": {"from": "phi_l", "scale": RADIUS_M},
        "right_m_s": {"from": "phi_r", "scale": RADIUS_M},
        "x_m": {"from": "sm_0"},
        "y_m": {"from": "sm_1"},
        "heading_rad": {"from": "sm_2"},
    },
}


def motions(count=300, seed=0):
    """What a scan matcher says of a robot whose sensor is turned by -1.2 rad and sits 6 mm behind the axle."""
    rng = np.random.default_rng(seed)
    true = (
        Model(wheelbase_m=WHEELBASE_M).with_effect("wheel-mismatch", ratio=1.02).with_effect("wheelbase", factor=0.96)
    )
    true = true.with_effect("marker-offset", forward_m=-0.006, left_m=0.004).with_effect(
        "sensor-rotation", angle_rad=-1.2
    )
    left, right = rng.uniform(-0.02, 0.02, (2, count, 1))
    after = simulate(true, left, right, np.full((count, 1), 0.8))
    began, ended = (observe(p, None, true) for p in (np.zeros((count, 3)), after[:, 0]))
    moved, cos, sin = ended[:, :2] - began[:, :2], np.cos(began[:, 2]), np.sin(began[:, 2])
    sm = np.column_stack(
        [cos * moved[:, 0] + sin * moved[:, 1], cos * moved[:, 1] - sin * moved[:, 0], ended[:, 2] - began[:, 2]]
    )
    sm += rng.normal(size=sm.shape) * [5e-4, 5e-4, 3e-3]
    columns = {f"sm_{i}": sm[:, i] for i in range(3)}
    return pd.DataFrame({"T": 0.8, "phi_l": left[:, 0] / RADIUS_M, "phi_r": right[:, 0] / RADIUS_M, **columns})


@pytest.fixture
def log(tmp_path):
    path = tmp_path / "laser.csv"
    applied(motions(), MAPPING).to_csv(path, index=False)
    return path


def test_a_sensor_that_hangs_upside_down_is_not_taken_for_another_robot(tmp_path):
    """Its motions are mirrored: they turn the other way than the wheels. Trials are shorter than the windows of this check."""
    path = tmp_path / "laser.csv"
    applied(motions().assign(sm_1=lambda log: -log.sm_1, sm_2=lambda log: -log.sm_2), MAPPING).to_csv(path, index=False)
    with pytest.raises(DataError, match="turns opposite to the wheels"):
        load_measured(path)
    upright = MAPPING["columns"] | {"y_m": {"from": "sm_1", "scale": -1}, "heading_rad": {"from": "sm_2", "clockwise": True}}
    mirrored = motions().assign(sm_1=lambda log: -log.sm_1, sm_2=lambda log: -log.sm_2)
    applied(mirrored, MAPPING | {"columns": upright}).to_csv(path, index=False)
    assert load_measured(path).tracks.trial[-1] == 299


def test_each_row_becomes_a_trial_of_two_poses():
    table = applied(motions(3), MAPPING)
    assert table.groupby("trial").size().tolist() == [2, 2, 2]
    assert (table.loc[table["t_s"] == 0, ["x_m", "y_m", "heading_rad"]] == 0).all(axis=None)
    ways = {side: {"from": f"phi_{side[0]}", "scale": RADIUS_M} for side in ("left_m", "right_m")}
    kept = {name: entry for name, entry in MAPPING["columns"].items() if "m_s" not in name}
    by_way = applied(motions(3), {"relative": True, "columns": kept | ways})
    np.testing.assert_allclose(by_way["left_m_s"], table["left_m_s"] / 0.8)
    without = {name: entry for name, entry in MAPPING["columns"].items() if name != "duration_s"}
    with pytest.raises(DataError, match="the mapping lacks duration_s"):
        applied(motions(3), {"relative": True, "columns": without})


def test_files_of_one_object_a_line(tmp_path):
    path = tmp_path / "a.tuple"
    path.write_text('{"T": 0.8, "sm": [1, 2, 3]}\n\n{"T": 0.7, "sm": [4, 5, 6]}\n')
    assert read_table(path)["sm_2"].tolist() == [3, 6]
    path.write_text('{"T": 0.8}\n[1, 2]\n')
    with pytest.raises(DataError, match=r"line 2, is no JSON object"):
        read_table(path)


def test_motions_have_no_place_and_nothing_that_needs_one_is_tried(log):
    tracks = load_measured(log).tracks
    assert tracks.relative
    predictor = predictor_for_search(tracks)
    assert not {"x_m", "heading_rad", "time_in_trial_s", "just_started"} & set(predictor.variables())
    model = Model(wheelbase_m=WHEELBASE_M)
    offered = set(listed(model, None, tracks))
    assert {"sensor-rotation", "marker-offset", "wheelbase", "speed-gain"} <= offered
    assert not {"floor-slope", "tether-pull", "camera-rotation", "clock-offset", "motor-lag", "floor-patch"} & offered
    moved = replace(tracks, pose=tracks.pose + 0.1)
    assert "sensor-rotation" not in listed(model, None, moved)
    assert "floor-slope" in listed(model, None, moved)


@pytest.mark.slow
def test_a_turned_sensor_is_named_and_everything_calibrated_together(log, capsys):
    assert main(["diagnose", str(log), "--model", "differential-drive", "--wheelbase", "0.09", "--json"]) == 0
    said = json.loads(capsys.readouterr().out)
    assert {"sensor-rotation", "marker-offset"} <= set(said["effects"])
    assert not any("north" in p["velocity"] for p in said["residual_dependence"])
    numbers = {(e, name): n for e, values in said["calibration"].items() for name, n in values.items()}
    true = {
        ("speed-gain", "gain"): 1.0,
        ("wheel-mismatch", "ratio"): 1.02,
        ("wheelbase", "factor"): 0.96,
        ("marker-offset", "forward_m"): -0.006,
        ("marker-offset", "left_m"): 0.004,
        ("sensor-rotation", "angle_rad"): -1.2,
    }
    for which, value in true.items():
        assert abs(numbers[which]["value"] - value) < 3.5 * numbers[which]["se"], which
        assert numbers[which]["se"] < 0.05


@pytest.mark.slow
def test_an_effect_can_be_taken_out(log, capsys):
    arguments = ["diagnose", str(log), "--model", "differential-drive", "--wheelbase", "0.09", "--json"]
    assert main([*arguments, "--without-effect", "sensor-rotation"]) == 0
    said = json.loads(capsys.readouterr().out)
    assert "sensor-rotation" not in {entry["name"] for entry in said["ranking"]}
    assert main([*arguments, "--without-effect", "sensor-rotatoin"]) == 2
    assert "Did you mean 'sensor-rotation'" in capsys.readouterr().err


@pytest.mark.skipif(not LASER.is_dir(), reason="the laser Khepera's logs are not beside this checkout")
@pytest.mark.parametrize("subset", ["lstraight_0", "lstraight_1", "l90_0"])
@pytest.mark.slow
def test_the_laser_khepera_is_calibrated_as_its_authors_did(subset, tmp_path):
    path = tmp_path / "log.csv"
    applied(read_table(LASER / f"{subset}.tuple"), MAPPING).to_csv(path, index=False)
    fit = calibrated(predictor_for_search(load_measured(path).tracks), Model(wheelbase_m=WHEELBASE_M))
    numbers = {name: n for values in numbers_of(fit).values() for name, n in values.items()}
    theirs = json.loads((LASER / f"{subset}_results.json").read_text())
    left, right = theirs["l_diam"], theirs["r_diam"]
    wanted = {
        "gain": (left + right) / (4 * RADIUS_M),
        "ratio": right / left,
        "factor": theirs["axle"] / WHEELBASE_M,
        "forward_m": theirs["l_x"],
        "left_m": theirs["l_y"],
        "angle_rad": theirs["l_theta"],
    }
    for name, value in wanted.items():
        assert numbers[name]["low"] <= value <= numbers[name]["high"], name


def test_motions_that_lasted_no_time_or_lack_a_number_are_left_out():
    motion = {"left_m_s": 0.1, "right_m_s": 0.2, "x_m": 0.03, "y_m": 0.0, "heading_rad": 0.1, "weight": [1.0, 2.0, 3.0, 4.0]}
    table = pd.DataFrame({"duration_s": [0.5, 0.0, -1.0, 0.25], **motion})
    out = relative_motions(table)
    assert out["weight"].tolist() == [1.0, 1.0, 4.0, 4.0]
    assert out["trial"].tolist() == [0, 0, 1, 1]
    assert out["t_s"].tolist() == [0.0, 0.5, 0.0, 0.25]
    assert relative_motions(table.assign(x_m=[0.1, 0.1, 0.1, np.nan]))["weight"].tolist() == [1.0, 1.0]
    with pytest.raises(DataError, match="No row has a duration_s above 0"):
        relative_motions(table.assign(duration_s=0.0))


def test_sizes_of_wheels_and_their_intervals_follow_from_mean_and_ratio():
    """Against drawn numbers: the mean size and the ratio vary together."""
    covariance = np.array([[4e-6, 3e-6], [3e-6, 9e-6]])
    names = (("speed-gain", "gain"), ("wheel-mismatch", "ratio"))
    fit = SimpleNamespace(
        free=[SimpleNamespace(effect=effect, parameter=SimpleNamespace(name=name)) for effect, name in names],
        values=np.array([1.1, 1.2]), covariance=covariance, se=lambda i: covariance[i, i] ** 0.5,
        interval=lambda i: (1.1 - 2.1 * 2e-3, 1.1 + 2.1 * 2e-3),
    )  # fmt: skip
    drawn = np.random.default_rng(0).multivariate_normal(fit.values, covariance, 200_000)
    left = 2 * drawn[:, 0] / (1 + drawn[:, 1])
    sizes = wheel_sizes(fit)
    for side, values in (("left", left), ("right", left * drawn[:, 1])):
        value, low, high = sizes[side]
        assert value == pytest.approx(values.mean(), rel=1e-4)
        assert ((high - value) / 2.1, (value - low) / 2.1) == pytest.approx((values.std(), values.std()), rel=0.02)
    fit.free = fit.free[:1]
    assert wheel_sizes(fit) == {}
