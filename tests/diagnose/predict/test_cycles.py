"""Networks of the snake held against its table of measurements: numbers planted come back, bad tables are refused."""

import json
import re

import numpy as np
import pandas as pd
import pytest

from bns.cli.main import main
from bns.diagnose.comparison import compare
from bns.diagnose.data.bodies.cycles import checked_cycles, cycle_tracks
from bns.diagnose.predict.cycle_networks import CyclePredictor
from bns.diagnose.predict.horizons import errors_of
from bns.engine.philox import Key
from bns.engine.snn import predict
from bns.errors import DataError
from bns.measurements import write_measurements
from bns.physics.model import Model
from bns.robots import load_robot
from bns.robots.simulator import load_static_simulator
from bns.robots.snake import path
from bns.robots.snake.table import COLUMNS, GAIT

ROBOT, SAVED, BARE = load_robot("snake"), load_static_simulator("snake"), Model(wheelbase_m=1.0, name="snake")
TRIALS, CYCLES = 8, 4
QUICK = ("--training-iterations-per-evaluation", "20")


def told():
    """Cycles that the networks call stable, (trials, cycles, 5)."""
    many = ROBOT.random_controllers(Key(5, 6), 1, 200).controller(0)
    stable = predict(SAVED.weights, ROBOT.inputs(many), ROBOT.sigmoid_output)[4] >= 0.5
    return many[stable][: TRIALS * CYCLES].reshape(TRIALS, CYCLES, 5)


def as_predicted(commands):
    return ROBOT.displacements(predict(SAVED.weights, ROBOT.inputs(commands), ROBOT.sigmoid_output))


def table(off_m=(0.0, 0.0, 0.0, 0.0), slide_m=0.0, scatter_m=1e-4, seed=0, rigid=False):
    """Cycles as the networks say, and ``off_m`` more; between cycles the robot slides east."""
    rng, parts = np.random.default_rng(seed), []
    for trial, commands in enumerate(told()):
        moved = as_predicted(commands)
        moved[:, :4] += off_m
        seen = path.walk(moved, rigid=rigid)
        seen[:, :8] += np.repeat(np.arange(CYCLES), 8).reshape(CYCLES, 8) * slide_m * np.tile([1, 0], 4)
        seen[:, :8] += scatter_m * rng.normal(size=(CYCLES, 8))
        parts.append(ROBOT.measurements(trial, commands, seen))
    return pd.concat(parts, ignore_index=True)


def predictor(measured):
    return CyclePredictor(cycle_tracks(checked_cycles(measured)[0]), SAVED, ROBOT)


def errors(measured, horizon):
    held = predictor(measured)
    return errors_of(held, held.steps(BARE), horizon)


def test_a_table_has_the_columns_it_says_and_two_rows_a_cycle():
    measured = table()
    assert tuple(measured.columns) == COLUMNS
    assert len(measured) == TRIALS * CYCLES * 2
    begins, ends = measured.iloc[::2], measured.iloc[1::2]
    assert begins[list(GAIT)].notna().all(axis=None)
    assert ends[list(GAIT)].isna().all(axis=None)
    assert begins.stable.isna().all()
    assert (ends.stable == 1).all()
    assert (measured.groupby("trial").t_s.diff().dropna() > 0).all()


def test_what_the_networks_say_is_no_error_at_any_horizon():
    for horizon, windows in (("cycle", 32), ("change", 24), ("3 cycles", 8), ("trial", 8)):
        found = errors(table(), horizon)
        assert len(found.start) == windows
        assert found.position_m.max() < 2e-3 * (1 + (horizon in {"trial", "3 cycles"}) * 4)


def test_a_planted_displacement_comes_back_with_its_direction_and_size():
    along = errors(table(off_m=(0, 0.03, 0, 0.03)), "cycle")
    np.testing.assert_allclose(along.position_m, 0.03, atol=2e-3)
    assert np.median(along.forward_m) == pytest.approx(0.03, abs=2e-3)  # as the robot lies at the end: most hardly turn
    right = errors(table(off_m=(0.03, 0, 0.03, 0)), "cycle")
    np.testing.assert_allclose(right.position_m, 0.03, atol=2e-3)
    assert np.median(right.left_m) == pytest.approx(-0.03, abs=2e-3)
    turned = errors(table(off_m=(-0.02, 0, 0.02, 0)), "cycle")
    assert (turned.heading_rad < 0).all()
    held = predictor(table(off_m=(0, 0.03, 0, 0)))
    assert held.scores()["dy_yellow"]["bias"] == pytest.approx(-0.03, abs=1e-3)
    assert held.scores()["dy_green"]["bias"] == pytest.approx(0.0, abs=1e-3)
    assert held.scores()["stable"]["stable_called_right"] == 1.0


def test_a_slide_between_cycles_shows_at_changes_alone():
    measured = table(slide_m=0.05)
    assert np.median(errors(measured, "cycle").position_m) < 2e-3
    np.testing.assert_allclose(errors(measured, "change").position_m, 0.05, atol=2e-3)
    assert np.median(errors(measured, "trial").position_m) > 0.1


def test_an_unstable_cycle_and_a_gap_end_what_counts_as_one_way():
    measured = table()
    unstable = (measured.trial == 0) & (measured.cycle == 2) & measured.stable.notna()
    measured.loc[unstable, "stable"] = 0.0
    measured = measured[~((measured.trial == 1) & (measured.cycle == 3))]
    starts, ends = predictor(measured).windows("cycle")
    assert len(starts) == TRIALS * CYCLES - 2
    assert len(predictor(measured).windows("change")[0]) == TRIALS * (CYCLES - 1) - 2 - 2
    starts, ends = predictor(measured).windows("trial")
    assert (ends - starts)[:2].tolist() == [1, 3]
    assert 0 <= predictor(measured).scores()["stable"]["unstable_called_right"] <= 1


def test_an_error_along_one_input_is_found_there():
    measured, slow = table(scatter_m=1e-3), []
    for (_, _), rows in measured.groupby(["trial", "cycle"], sort=False):
        off = rows.copy()
        off.iloc[1, off.columns.get_indexer(["yellow_x_m", "green_x_m"])] += 0.1 * off.iloc[0].a_lat_rad
        slow.append(off)
    found = compare(predictor(pd.concat(slow)), BARE)
    assert {p.variable for p in found.residual_dependence[:6]} & {"a_lat_rad", "heading_rad", "change"}
    assert found.near == "cycle"
    assert len(found.worst) == 5


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (lambda t: t.drop(columns="green_y_m"), "lack green_y_m"),
        (lambda t: t.assign(omega_rad=np.degrees(t.omega_rad)), "look like degrees"),
        (lambda t: t.assign(a_lat_rad=t.a_vert_rad, a_vert_rad=t.a_lat_rad), "Are the columns exchanged"),
        (lambda t: t.assign(**{n: 100 * t[n] for n in COLUMNS[7:11]}), "look like centimetres or millimetres"),
        (lambda t: t.assign(stable=t.stable * 0.5), r"Row 1: stable is 0\.5; it must be 1, 0 or empty"),
        (lambda t: t.assign(yellow_x_m="here"), "Row 0: yellow_x_m is 'here'"),
        (lambda t: t.assign(t_s=t.t_s.where(t.index != 3)), "Row 3: t_s is empty"),
        (lambda t: t.assign(green_x_m=np.nan), "no row with both markers"),
        (lambda t: t.iloc[::2], "no complete cycle"),
        (lambda t: t[:0], "have no rows"),
    ],
)
def test_tables_that_would_mislead_are_refused(change, message):
    with pytest.raises(DataError, match=message):
        checked_cycles(change(table()))


def test_what_is_left_out_is_named():
    measured = table(rigid=True)
    measured.loc[2, "yellow_x_m"] = np.nan  # trial 0, cycle 2
    measured.loc[[8, 9], "stable"] = np.nan  # trial 1, cycle 1
    measured.loc[13, "green_x_m"] += 0.5  # trial 1, cycle 3
    cycles, findings = checked_cycles(measured.astype({"stable": object}))
    assert len(cycles) == TRIALS * CYCLES - 2
    said = [f"{f.trial} {f.row} {f.text}" for f in findings]
    assert said[0] == "0 2 cycle 2: a marker lost at its begin or end; left out"
    assert said[1] == "1 8 cycle 1: it is not known whether it was stable; left out"
    assert re.match(r"1 12 cycle 3: the distance of the markers changes by \+\d+ cm", said[2])


@pytest.mark.slow
def test_a_run_of_the_snake_leaves_measurements_that_networks_are_held_against(tmp_path, capsys):
    rows, nets = tmp_path / "run.csv", tmp_path / "nets.safetensors"
    small = [
        "--population-size",
        "8",
        "--evaluations",
        "3",
        "--generations-per-evaluation",
        "1",
        "--max-commands",
        "4",
        *QUICK,
    ]
    run = ["run", "--robot", "snake", "--task", "two-regions", *small, "--results", str(tmp_path / "r")]
    assert main([*run, "--measurements", str(rows), "--save-snn", str(nets)]) == 0
    assert tuple(pd.read_csv(rows).columns) == COLUMNS
    capsys.readouterr()
    for model in (str(nets), "snake-networks"):
        assert main(["compare", str(rows), "--model", model, "--json", "--figures", str(tmp_path)]) == 0
        answer = json.loads(capsys.readouterr().out)
        assert set(answer["error"]) == {"cycle", "change", "3 cycles", "trial"}
        assert set(answer["networks"]) == set(ROBOT.networks)
    assert (tmp_path / "comparison.png").stat().st_size > 10_000
    assert main(["compare", str(rows), "--model", "khepera"]) == 2
    assert "holds cycles and markers, and the model khepera drives wheels" in capsys.readouterr().err
    assert main(["diagnose", str(rows), "--model", "snake-networks"]) == 2
    assert "can be compared, not diagnosed" in capsys.readouterr().err


def test_networks_of_another_robot_are_refused(tmp_path, capsys):
    write_measurements(table(), tmp_path / "snake.csv", COLUMNS)
    from bns.robots.simulator import static_path

    assert main(["compare", str(tmp_path / "snake.csv"), "--model", str(static_path("khepera"))]) == 2
    assert "are of cycles and markers, the networks of khepera.safetensors are of khepera" in capsys.readouterr().err


def test_the_camera_s_noise_is_read_off_the_markers_distance():
    for sigma in (0.002, 0.01):
        position_m, heading_rad = predictor(table(scatter_m=sigma, rigid=True)).tracking
        assert position_m == pytest.approx(sigma / np.sqrt(2), rel=0.35)
        assert heading_rad == pytest.approx(sigma * np.sqrt(2) / 0.65, rel=0.35)
    found = compare(predictor(table(off_m=(0, 0.1, 0, 0.1), scatter_m=0.002, rigid=True)), BARE)
    assert found.noise_floor_m("cycle") < 0.02 < found.errors["cycle"]["position_m"]
