"""Work that goes on in the background while a robot drives: how many rounds, what becomes of faults, what is repeated."""

import threading
from types import SimpleNamespace

import numpy as np
import pytest

from bns.bootstrap.loop import run
from bns.errors import HardwareError
from bns.robots import load_robot
from bns.spec import RunSpec
from bns.trial.background import BackgroundDriver, Rounds, Waiting
from bns.trial.evaluation import Evaluation
from bns.worlds.robot import RobotWorld

SPEC = RunSpec(
    evaluations=4,
    population_size=12,
    generations_per_evaluation=2,
    training_iterations_per_evaluation=5,
    world="robot",
)


class StraightRobot:
    """Drives 10 cm ahead a command, somewhere on the floor, and keeps a list of its evaluations."""

    def __init__(self):
        self.driven, self.rounds = [], []

    def evaluate(self, number, controller):
        ahead = 0.1 * np.arange(len(controller) + 1)
        poses = np.column_stack([0.3 + ahead, np.full(len(ahead), -0.2), np.zeros(len(ahead))])
        self.driven.append(Evaluation(controller, controller, poses))
        return self.driven[-1]

    def evaluated(self, number, rounds, row):
        self.rounds.append(rounds)


def driven(past=(), most_rounds=2, until_success=None):
    """Rows of a trial, the robot, its driver."""
    robot = StraightRobot()
    with BackgroundDriver(load_robot("khepera"), robot, past, most_rounds, until_success) as driver:
        return run(SPEC, world=RobotWorld("straight"), driver=driver).tables["evals"], robot, driver


def test_rounds_go_on_until_the_drive_is_over_or_they_are_enough():
    third, count = threading.Event(), [0]

    def work():
        count[0] += 1
        if count[0] == 3:
            third.set()

    rounds = Rounds(3)
    assert rounds.while_driving(lambda: third.wait(60), work) == (True, 3)
    held = threading.Event()
    assert rounds.while_driving(lambda: "at once", lambda: held.wait(0.1)) == ("at once", 1)
    assert rounds.waited_s > 0.05
    assert rounds.worked_s >= 0.1
    rounds.close()


def test_shares_of_the_time_are_of_that_since_the_first_drive(monkeypatch):
    """Driven for 8 s, with work for 6 s of these; then 2 s pass until the next drive, which takes 10 s."""
    clock = iter([100.0, 108.0, 110.0, 120.0])
    monkeypatch.setattr("bns.trial.background.time.perf_counter", lambda: next(clock))
    waiting = Waiting()
    assert waiting.share(1.0) == 0.0
    for _ in range(2):
        waiting.ends()
        waiting.begins(0.0)
    assert waiting.share(waiting.waited_s) == pytest.approx(0.1)
    assert waiting.share(6.0) == pytest.approx(0.3)


def test_a_fault_of_the_work_is_raised_after_the_drive():
    over = []

    def fails():
        raise ArithmeticError("no weights")

    rounds = Rounds(3)
    with pytest.raises(ArithmeticError, match="no weights"):
        rounds.while_driving(lambda: over.append(True), fails)
    assert over == [True]
    rounds.close()


def test_a_trial_repeats_its_past_with_as_many_rounds_and_goes_on_to_the_same_numbers():
    whole, robot, driver = driven()
    assert driver.rounds == sum(robot.rounds) == whole["generations"][-1] / 2
    past = [
        Evaluation(each.picked, each.commands, each.poses, rounds)
        for each, rounds in zip(robot.driven, robot.rounds, strict=True)
    ]
    again, asleep, repeated = driven(past)
    assert asleep.driven == []
    assert repeated.waited_share == 0.0
    for name in whole.keys() - {"training_cpu_s", "evolution_cpu_s"}:
        np.testing.assert_array_equal(again[name], whole[name], err_msg=name)
    _, half, _ = driven(past[:2])
    assert len(half.driven) == 2
    np.testing.assert_array_equal(half.driven[0].picked, robot.driven[2].picked)


def test_a_trial_has_finished_when_so_many_have_succeeded_in_a_row():
    with BackgroundDriver(load_robot("khepera"), StraightRobot(), (), 1, until_success=2) as driver:
        found = []
        for success in (True, False, True, True):
            driver.evaluated(1, SimpleNamespace(rounds=1), {"evaluated_success": success})
            found.append(driver.finished)
    assert found == [False, False, False, True]


def test_a_past_that_drove_something_else_is_refused():
    _, robot, _ = driven()
    other = robot.driven[0]
    with pytest.raises(HardwareError, match="evaluation 1 of the journal drove another controller than this bns picks"):
        driven([Evaluation(other.picked + 40.0, other.commands, other.poses, 1)])
