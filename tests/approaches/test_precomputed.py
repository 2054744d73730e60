"""Pre-computed networks: which drives are random, which of them teach, and how long evolution goes on before the first."""

import numpy as np
import pytest

from bns.approaches import start_approach
from bns.approaches.precomputed import MOST_ROUNDS
from bns.engine.philox import Key, Purpose
from bns.robots import load_robot
from bns.robots.base import Scores
from bns.spec import RunSpec
from bns.tasks import load_task
from bns.worlds import build_world

ROBOT, TASK, KEY = load_robot("khepera"), load_task("khepera", "circle"), Key(3, 4)
SPEC = RunSpec(
    approach="precomputed+data=0.5+commands=7+iterations=5", evaluations=6, population_size=8, generations_per_evaluation=1,
    min_commands=8, max_commands=12, world="physics",
)  # fmt: skip


def test_the_first_drives_are_random_and_teach_and_those_of_the_fittest_teach_nothing():
    approach, world, seen = start_approach(ROBOT, TASK, KEY, SPEC), build_world("physics", ROBOT), []
    for evaluation in range(1, 7):
        fittest, commands = approach.fittest(), approach.pick(evaluation)
        approach.learn(commands, world.drive(commands, KEY, Purpose.WORLD_EVALUATED, evaluation), evaluation)
        weights, before = approach.weights, approach.evolver.generations
        approach.advance()
        measures = approach.measures()
        seen.append(measures["training_patterns"] + measures["validation_patterns"])
        assert (len(commands) == 7) is (evaluation <= 3)  # of an evolving population nobody has as few
        assert np.array_equal(commands, fittest) is (evaluation > 3)
        assert np.array_equal(weights, approach.weights) is (evaluation != 3)
        assert (approach.evolver.generations > before) is (evaluation >= 3)
    assert seen == [7, 14, 21, 21, 21, 21]


@pytest.mark.parametrize(("done_after", "rounds"), [(1, 1), (3, 3), (MOST_ROUNDS + 1, MOST_ROUNDS)])
def test_evolution_goes_on_until_the_fittest_reaches_all_goals_or_long_enough(monkeypatch, done_after, rounds):
    approach = start_approach(ROBOT, TASK, KEY, SPEC)
    evolver, begun = approach.evolver, []

    def evolve():
        """The last of the population reaches all goals from the first round on, and becomes the fittest."""
        begun.append(True)
        reached = np.zeros(8, np.int32)
        reached[7] = len(TASK.goals_m)
        evolver.scores, fittest = Scores(np.zeros(8), reached, 0), 7 if len(begun) >= done_after else 0
        evolver.order = np.roll(np.arange(8), -fittest)

    monkeypatch.setattr(approach, "evolve", evolve)
    approach.evolve_until_done()
    assert len(begun) == rounds
