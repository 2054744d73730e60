"""Trajectory trials: every drive is counted, and what became of it is what happened."""

from types import SimpleNamespace

import numpy as np
import pandas as pd
import pytest

from analysis import simulator_options
from analysis.results import NoDataError
from bns.robots import load_robot
from bns.robots.snake import path
from bns.static_simulator import transfer_trials as validation
from bns.tasks import load_task
from bns.worlds import build_world

ROBOT, TASK = load_robot("snake"), load_task("snake", "two-regions")


@pytest.fixture
def quick(monkeypatch):
    for name, value in (("TRIALS", 2), ("ROUND", 2), ("MOST_ROUNDS", 2)):
        monkeypatch.setattr(validation, name, value)


def path_to(*points, stable=1.0):
    poses = np.repeat(ROBOT.start_pose(), len(points), axis=0)
    for row, point in zip(poses, points, strict=True):
        row[4:8] += np.tile(np.subtract(point, [0.3, 0.0]), 2)
    poses[:, path.STABLE] = stable
    return poses


@pytest.mark.parametrize(
    ("poses", "planned", "became"),
    [
        (path_to([0.3, 0.3], [0.3, -0.3]), 2, "all goals"),
        (path_to([0.3, 0.3], [0.3, 0.3]), 2, "missed a goal"),
        (path_to([0.3, 0.3], [0.3, -0.3], stable=0.0), 2, "unstable cycle"),
        (path_to([0.3, 0.3], [0.3, -0.3]), 5, "rolled over"),
        (path_to([0.3, 0.95], [0.3, 0.3], stable=0.0), 5, "left the surface"),
    ],
)
def test_outcome_is_the_first_that_applies(poses, planned, became):
    assert validation.outcome(ROBOT, TASK, poses, planned) == became


def test_every_trial_is_driven_three_times_and_kept(quick, tmp_path):
    world = build_world("substitute", ROBOT)
    table = validation.validate(ROBOT, TASK, world)
    drives = table.drop_duplicates(["trial", "repeat"])
    assert [(one.trial, one.repeat) for one in drives.itertuples()] == [(t, r) for t in (1, 2) for r in (-1, 1, 2, 3)]
    assert (drives[drives.repeat == -1].final_error_m == 0).all()
    assert (drives[drives.repeat > 0].final_error_m > 0).all()
    assert set(table.outcome) <= set(validation.OUTCOMES)
    assert (drives.generations <= 4).all()
    pd.testing.assert_frame_equal(validation.validate(ROBOT, TASK, world), table)
    place = validation.table_path(tmp_path, "snake", TASK.name)
    validation.write_table(table, place)
    pd.testing.assert_frame_equal(pd.read_parquet(place), table)
    assert [one.name for one in place.parent.iterdir()] == [place.name]
    assert validation.describe(table, len(TASK.goals_m)).count("trial") == 2


def test_a_second_set_is_of_other_controllers_and_leaves_the_first_as_it_was(quick):
    world = build_world("substitute", ROBOT)
    one, two = validation.validate(ROBOT, TASK, world), validation.validate(ROBOT, TASK, world, sets=2)
    pd.testing.assert_frame_equal(two[two.trial <= 2].reset_index(drop=True), one)
    assert sorted(two.trial.unique()) == [1, 2, 3, 4]
    ends = two[two.repeat == -1].groupby("trial").last()[["x_m", "y_m"]]
    assert not np.allclose(ends.loc[1], ends.loc[3])


def test_each_set_says_how_many_drives_were_complete_and_how_many_controllers_good(quick):
    goals = 3
    reached = {1: (3, 3, 3), 2: (3, 2, 2), 3: (2, 2, 2), 4: (0, 0, 0)}  # 9, 7, 6 and 0 of 9
    rows = [
        {"trial": trial, "repeat": repeat, "goals_reached": n, "outcome": "all goals" if n == goals else "missed a goal"}
        for trial, met in reached.items()
        for repeat, n in zip((-1, 1, 2, 3), (goals, *met), strict=True)
        for _ in range(2)  # as many rows as poses
    ]
    by_set = validation.of_each_set(pd.DataFrame(rows), goals)
    assert by_set.index.tolist() == [1, 2]  # `quick`: two trials a set
    assert by_set.complete.tolist() == [4, 0]
    assert by_set.good.tolist() == [2, 0]
    assert by_set.goals.tolist() == pytest.approx([16 / 18, 6 / 18])


def test_the_mean_error_at_the_end_is_that_of_the_same_step(quick):
    table = validation.validate(ROBOT, TASK, build_world("substitute", ROBOT))
    one = table[(table.trial == 1) & (table.repeat == 2)].iloc[-1]
    same = table[(table.trial == 1) & (table.repeat == -1) & (table.step == one.step)].iloc[0]
    assert one.final_error_m == pytest.approx(np.hypot(one.x_m - same.x_m, one.y_m - same.y_m))


def test_random_drives_are_measurements_of_controllers_that_nobody_chose(monkeypatch, tmp_path):
    monkeypatch.setattr(validation, "RANDOM", 6)
    table = validation.random_drives(ROBOT, build_world("substitute", ROBOT))
    assert tuple(table.columns) == ROBOT.measured_columns
    assert table.trial.unique().tolist() == [1, 2, 3, 4, 5, 6]
    assert (table.groupby("trial").cycle.max() == validation.COMMANDS).all()
    pd.testing.assert_frame_equal(validation.random_drives(ROBOT, build_world("substitute", ROBOT)), table)
    place = validation.measurements_path(tmp_path, "snake")
    validation.write_table(table, place)

    drawn = simulator_options.draw(SimpleNamespace(results=tmp_path))[0]
    assert list(dict.fromkeys(drawn.data.simulator)) == ["snake", "snake+changes", "snake+rigid", "snake+changes+rigid"]
    gaps = drawn.data[drawn.data.horizon == "cycle"].set_index("simulator").gap_m
    assert gaps["snake+rigid"] != gaps["snake"]
    cycles = drawn.data[drawn.data.horizon == "cycle"].position_m
    np.testing.assert_allclose(cycles, cycles.iloc[0])  # both options leave the middle of a single cycle where it is
    with pytest.raises(NoDataError, match="run bns validate --robot snake"):
        simulator_options.draw(SimpleNamespace(results=tmp_path / "nothing"))
