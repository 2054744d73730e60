"""Goals that are narrower in evolution than on the robot: ``approach: bns+margin=...``."""

import numpy as np
import pytest

from bns.approaches.bns import BootstrappedNeuroSimulation
from bns.approaches.parts.base import Setting
from bns.bootstrap.loop import run
from bns.engine.evolution import Population
from bns.engine.philox import Key
from bns.errors import SpecError
from bns.options import parsed_options
from bns.robots import load_robot
from bns.spec import RunSpec
from bns.tasks import load_task

SMALL = {"evaluations": 3, "population_size": 20, "generations_per_evaluation": 3, "training_iterations_per_evaluation": 5}


@pytest.mark.parametrize(("margin_m", "reached"), [(0.0, 1), (0.005, 1), (0.015, 0)])
def test_a_goal_passed_at_six_centimetres_is_reached_unless_it_is_narrower(margin_m, reached):
    khepera = load_robot("khepera")
    task = load_task("khepera", "circle").narrower(margin_m, khepera.radii_m[0])
    first = task.goals_m[0]
    ahead, right = first[1], first[0] + 0.06  # it begins at the origin and faces north
    one = Population(np.zeros((1, 1, 3), np.float32), np.ones(1, np.int32))
    assert khepera.walk(one, np.array([[right, ahead, 0.0]]), task).goals_reached[0] == reached


def test_regions_of_the_snake_are_narrower_on_both_sides():
    task = load_task("snake", "two-regions")
    assert task.narrower(0.03, 0.0).region_m == pytest.approx(task.region_m - 0.06)


@pytest.mark.parametrize(
    ("approach", "said"),
    [
        ("bns+margin=0.07", r"a margin of 0\.07 m leaves nothing of goals that reach 0\.07 m; take less than 0\.07"),
        ("bns+margin=-1", r"margin is '-1'; it must be a number from 0 to 1"),
        ("bns+margins=0.01", "unknown option of approach bns 'margins'. Did you mean 'margin'"),
    ],
)
def test_a_margin_that_cannot_be_is_refused(approach, said):
    with pytest.raises(SpecError, match=said):
        run(RunSpec(approach=approach, **SMALL))


def test_no_margin_gives_the_numbers_of_the_dissertation_s_way_and_a_margin_others():
    fittest = {
        name: list(run(RunSpec(approach=name, **SMALL)).tables["evals"]["best_fitness"])
        for name in ("bns", "bns+margin=0", "bns+margin=0.04")
    }
    assert fittest["bns"] == fittest["bns+margin=0"]
    assert fittest["bns"] != fittest["bns+margin=0.04"]


def test_goals_narrow_by_a_tenth_when_all_are_reached_and_widen_when_they_are_not():
    task = load_task("khepera", "circle")
    spec = RunSpec(approach="bns+margin=0.03", **SMALL)
    options = parsed_options(spec.approach, BootstrappedNeuroSimulation.options)
    setting = Setting(load_robot("khepera"), task, Key(0, 0), spec, options)
    approach, radii_cm = BootstrappedNeuroSimulation.start(setting), []
    approach.learn(np.full((2, 3), 10_000.0, np.float32), np.zeros((2, 3)), 1)
    for reached in [True] * 12 + [False] * 3:
        count = len(task.goals_m) * reached
        approach.evolve = lambda count=count: approach.evolver.scores.goals_reached.fill(count)
        approach.advance()
        radii_cm.append(100 * (approach.goals().radius_m or 0.07))
    np.testing.assert_allclose(radii_cm, [6.7, 6.4, 6.1, 5.8, 5.5, 5.2, 4.9, 4.6, 4.3, 4.0, 4.0, 4.0, 4.3, 4.6, 4.9])
    assert approach.simulator.task.radius_m == pytest.approx(0.046)  # of the last round, before it was judged


def test_success_is_still_judged_at_seven_centimetres():
    task = load_task("khepera", "circle")
    khepera = load_robot("khepera")
    path = np.column_stack([task.goals_m + np.array([0.06, 0.0]), np.zeros(len(task.goals_m))])
    assert khepera.succeeded(path, task)
    assert khepera.succeeded(path, task.narrower(0.04, 0.07))
