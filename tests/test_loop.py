"""The loop and whoever drives for it: rounds that went on during a drive, an early end, the same luck for all options."""

from dataclasses import replace

import numpy as np
import pytest

from bns.bootstrap.driver import Drive
from bns.bootstrap.loop import run
from bns.engine.philox import Key, Purpose
from bns.robots import load_robot
from bns.spec import RunSpec
from bns.worlds import build_world

SMALL = {
    "population_size": 12,
    "generations_per_evaluation": 2,
    "training_iterations_per_evaluation": 5,
    "world": "physics",
}
KEY = Key.of_run(0, 0, "khepera", "circle")
TIMES = {"training_cpu_s", "evolution_cpu_s"}


class CountingDriver:
    """Asks a world, does `rounds` rounds meanwhile, and has finished after `last` evaluations."""

    def __init__(self, spec, rounds, last=99):
        self.world = build_world(spec.world, load_robot(spec.robot))
        self.rounds, self.last, self.picked, self.rows = rounds, last, [], []

    @property
    def finished(self):
        return len(self.rows) >= self.last

    def drive(self, evaluation, controller, advance):
        self.picked.append(controller)
        for _ in range(self.rounds):
            advance()
        return Drive(controller, self.world.drive(controller, KEY, Purpose.WORLD_EVALUATED, evaluation), self.rounds)

    def evaluated(self, evaluation, drive, row):
        assert drive.rounds == self.rounds
        self.rows.append(row)


def evals(spec, **how):
    return run(spec, **how).tables["evals"]


def test_the_next_round_is_due_only_if_none_went_on_during_the_drive():
    spec = RunSpec(evaluations=3, **SMALL)
    usual = evals(spec)
    same, busy = CountingDriver(spec, 0), CountingDriver(spec, 3)
    at_once, meanwhile = evals(spec, driver=same), evals(spec, driver=busy)
    for name in usual.keys() - TIMES:
        np.testing.assert_array_equal(at_once[name], usual[name], err_msg=name)
    assert usual["generations"].tolist() == [2, 4, 6]
    assert meanwhile["generations"].tolist() == [6, 12, 18]
    assert meanwhile["training_patterns"][0] > 0  # the drive is learned from, in the rounds of the next


class BusyLater(CountingDriver):
    """Does its rounds during the second drive alone."""

    def drive(self, evaluation, controller, advance):
        self.rounds = 2 * (evaluation == 2)
        return super().drive(evaluation, controller, advance)


def test_a_drive_is_foretold_by_the_simulator_that_picked_it_whatever_is_learned_meanwhile():
    spec = RunSpec(evaluations=2, **SMALL)
    usual, busy = evals(spec), evals(spec, driver=BusyLater(spec, 0))
    assert (usual["generations"][1], busy["generations"][1]) == (4, 6)
    for name in ("evaluated_fitness_world", "evaluated_fitness_simulation", "evaluated_fitness_error"):
        np.testing.assert_array_equal(busy[name], usual[name])


class Passed(CountingDriver):
    """Somebody passes over the second evaluation."""

    def drive(self, evaluation, controller, advance):
        return replace(super().drive(evaluation, controller, advance), skipped=evaluation == 2)


def test_an_evaluation_that_was_passed_over_teaches_nothing_and_has_no_row():
    spec = RunSpec(evaluations=3, **SMALL)
    driver = Passed(spec, 0)
    rows, whole = evals(spec, driver=driver), evals(spec)
    assert rows["evaluation"].tolist() == [1, 3]
    assert len(driver.picked) == 3
    learned = rows["training_patterns"] + rows["validation_patterns"]
    assert learned.tolist() == np.cumsum(rows["commands"]).tolist()
    assert whole["generations"][1] == rows["generations"][1]


def test_a_driver_that_has_finished_ends_the_run():
    spec = RunSpec(evaluations=5, **SMALL)
    driver, shown = CountingDriver(spec, 0, last=2), []
    assert evals(spec, driver=driver, progress=shown.append)["evaluation"].tolist() == [1, 2]
    assert [row["evaluation"] for row in shown] == [1, 2]


@pytest.mark.parametrize("options", ["snake+changes", "snake+rigid"])
def test_options_of_a_robot_are_compared_on_the_same_luck(options):
    """One controller in the population: which it is depends on the draws alone."""
    small = SMALL | {"population_size": 1, "min_commands": 1, "max_commands": 1, "task": "two-regions"}
    picked = {}
    for robot in ("snake", options):
        driver = CountingDriver(RunSpec(robot=robot, evaluations=1, **small), 0)
        run(RunSpec(robot=robot, evaluations=1, **small), driver=driver)
        picked[robot] = driver.picked[0]
    np.testing.assert_array_equal(picked["snake"], picked[options])
