"""Back to reality: simulators are judged by the fitness of the latest drives, and not by the fittest controller alone."""

import numpy as np
import pytest

from bns.approaches import start_approach
from bns.bootstrap.simulators import PhysicsSimulator
from bns.engine.philox import Key
from bns.physics.model import load_model
from bns.robots import load_robot
from bns.spec import RunSpec
from bns.tasks import load_task

ROBOT, TASK, KEY = load_robot("khepera"), load_task("khepera", "circle"), Key(3, 4)
DRAWING = load_model("khepera")
SMALL = {"population_size": 12, "max_commands": 12, "world": "physics"}


@pytest.mark.parametrize(("memory", "counting"), [(2, 2), (3, 3), (9, 4)])
def test_a_simulator_is_judged_by_the_mean_difference_of_fitness_over_the_latest_drives(memory, counting):
    approach = start_approach(ROBOT, TASK, KEY, RunSpec(approach=f"back-to-reality+models=2+memory={memory}", **SMALL))
    world, model = (PhysicsSimulator(ROBOT, TASK, DRAWING.with_effect("speed-gain", gain=gain)) for gain in (0.8, 1.1))
    apart = []
    for i in range(4):
        commands = ROBOT.random_controllers(KEY, 4, 5 + i).controller(i)
        approach.learn(commands, world.poses(commands), i + 1)
        real, foretold = (ROBOT.evaluate_path(one.poses(commands), TASK)[0] for one in (world, model))
        apart.append(abs(real - foretold))
    assert approach._difference(model.model) == pytest.approx(np.mean(apart[-counting:]), rel=1e-4)
    assert len({round(np.mean(apart[-n:]), 4) for n in (2, 3, 4)}) == 3


def test_not_only_the_fittest_is_driven():
    approach = start_approach(ROBOT, TASK, KEY, RunSpec(approach="back-to-reality+models=2", **SMALL))
    population = [approach.evolver.population.controller(i).tolist() for i in range(12)]
    picked = [approach.pick(evaluation).tolist() for evaluation in range(1, 41)]
    assert all(one in population for one in picked)
    assert len({population.index(one) for one in picked}) > 1
