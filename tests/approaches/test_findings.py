"""Of each approach one finding of its paper, in a setting small enough for a test."""

import numpy as np
import pytest

from bns.approaches import start_approach
from bns.approaches.estimation_exploration import disagreement
from bns.approaches.parts.physics_models import UNITS
from bns.bootstrap.evolver import Evolver
from bns.bootstrap.loop import run
from bns.bootstrap.simulators import PhysicsSimulator
from bns.engine.philox import Key, Purpose
from bns.physics.model import load_model
from bns.physics.wheels.khepera_drive import KheperaPhysics
from bns.robots import load_robot
from bns.spec import RunSpec
from bns.tasks import load_task

ROBOT, TASK = load_robot("khepera"), load_task("khepera", "circle")
DRAWING = load_model("khepera")
SMALL = {"population_size": 30, "generations_per_evaluation": 3, "max_commands": 12, "world": "physics"}


def hidden(**effects):
    """A world whose model has effects that the drawing has not, with a camera that errs by a millimetre."""
    model = DRAWING
    for name, values in effects.items():
        model = model.with_effect(name.replace("_", "-"), **values)
    return KheperaPhysics(ROBOT, model)


def started(approach, seed=0, **changes):
    spec = RunSpec(approach=approach, seed=seed, **SMALL | changes)
    return start_approach(ROBOT, TASK, Key.of_run(seed, 0, "khepera", "circle"), spec)


def drive(approach, world, evaluations, first=1):
    for evaluation in range(first, first + evaluations):
        commands = approach.pick(evaluation)
        approach.learn(commands, world.drive(commands, Key(9, 9), Purpose.WORLD_EVALUATED, evaluation), evaluation)
        approach.advance()


def error_on_fresh_commands(simulator, world):
    """Root mean square error of displacements, in `UNITS`, on random commands that nothing has learned from."""
    fresh = ROBOT.random_controllers(Key(77, 1), 10, 10)
    errors = []
    for i in range(10):
        commands = fresh.controller(i)
        measured = world.drive(commands, Key(77, 2), Purpose.PROBE, i + 1)
        errors.append(ROBOT.measured_displacements(simulator.poses(commands)) - ROBOT.measured_displacements(measured))
    return np.sqrt(np.mean((np.array(errors) / UNITS) ** 2))


def test_on_the_robot_fitness_grows_from_generation_to_generation():
    """Floreano and Mondada, figure 4: the best and the mean of the population grow, and the best is not lost."""
    evals = run(RunSpec(approach="on-robot+population=10", evaluations=190, **SMALL)).tables["evals"]
    assert (np.diff(evals["best_fitness"]) >= 0).all()
    first, last = evals["evaluated_fitness_world"][:10], evals["evaluated_fitness_world"][-9:]
    assert evals["generations"][-1] == 21
    assert last.mean() > 1.1 * first.mean()


def test_precomputed_networks_are_the_better_the_more_data_they_have():
    """Pretorius and others: the error on data not seen falls with the training data."""
    world, errors = hidden(motor_lag={"tau_s": 0.08}), []
    for data in (0.1, 0.9):
        approach = started(f"precomputed+data={data}+iterations=1500", evaluations=40)
        drive(approach, world, 40)
        errors.append(error_on_fresh_commands(approach.simulator, world))
    assert errors[1] < 0.5 * errors[0]


def test_what_evolved_in_simulation_goes_on_growing_on_the_robot_from_a_better_start():
    """Pollack and others: the robot improves on what simulation found, which random controllers do not reach as fast."""
    gained = []
    for seed in range(3):
        spec = RunSpec(approach="then-on-robot+data=0.5+population=6+iterations=2000", evaluations=60, seed=seed, **SMALL)
        evals = run(spec).tables["evals"]
        random = run(RunSpec(approach="on-robot+population=6", evaluations=30, seed=seed, **SMALL)).tables["evals"]
        first, last = np.nanmax(evals["evaluated_fitness_world"][30:36]), evals["best_fitness"][-1]
        assert last >= first
        gained.append((last - first, last - random["best_fitness"][-1]))
    assert (np.median(gained, axis=0) > 0).all()


def test_the_monitor_follows_a_robot_that_changes():
    """Grefenstette and Ramsey: the estimate tracks the environment, and learning begins anew in part when it has changed."""
    approach = started("anytime+window=6", population_size=12, generations_per_evaluation=1)
    drive(approach, hidden(speed_gain={"gain": 1.1}), 6)
    before, updates = approach.space.model(approach.known.mean).values_of("speed-gain")["gain"], approach.updates
    drive(approach, hidden(speed_gain={"gain": 0.85}), 8, first=7)
    after = approach.space.model(approach.known.mean).values_of("speed-gain")["gain"]
    assert before == pytest.approx(1.1, abs=0.02)
    assert after == pytest.approx(0.85, abs=0.02)
    assert updates >= 1
    assert approach.updates > updates


@pytest.mark.slow
def test_tests_on_which_models_disagree_find_hidden_numbers_with_fewer_drives_than_random_tests():
    """Bongard and Lipson: with as many drives, models are nearer to the target than with random tests."""
    world, errors = hidden(speed_gain={"gain": 0.93}, motor_lag={"tau_s": 0.15}), {1: [], 40: []}
    for seed in range(4):
        for candidates, found in errors.items():
            name = f"estimation-exploration+tests=1+commands=3+models=16+generations=8+candidates={candidates}"
            approach = started(name, seed, evaluations=5)
            drive(approach, world, 3)
            found.append(error_on_fresh_commands(approach.simulator, world))
    assert np.median(errors[40]) < np.median(errors[1])


def test_models_disagree_most_where_they_differ():
    tests = ROBOT.random_controllers(Key(1, 1), 5, 4)
    one = PhysicsSimulator(ROBOT, TASK, DRAWING)
    other = PhysicsSimulator(ROBOT, TASK, DRAWING.with_effect("speed-gain", gain=0.9))
    assert disagreement([one, one], tests).tolist() == [0] * 5
    assert (disagreement([one, other], tests) > 0).all()


@pytest.mark.slow
def test_co_evolving_simulators_lower_the_difference_of_fitness():
    """Zagal and Ruiz-del-Solar, figure 9: the difference of fitness falls, though nothing but fitness is used."""
    gained = []
    for seed in range(3):
        approach = started("back-to-reality", seed)
        drive(approach, hidden(speed_gain={"gain": 0.9}, wheel_mismatch={"ratio": 1.03}), 12)
        gained.append(approach.drives.fitness_error(DRAWING, 10) / approach.models.errors[0])
    assert np.median(gained) > 2


def test_what_is_expected_to_transfer_has_a_smaller_gap_than_what_is_fittest_in_simulation():
    """Koos, Mouret and Doncieux, section V: the gap of what is chosen is lower than with fitness alone."""
    world, gaps = hidden(speed_limit={"max_m_s": 0.09}), []
    for seed in range(5):
        chosen = started("transferability", seed)
        drive(chosen, world, 12)
        alone = Evolver.start(ROBOT, TASK, chosen.setting.key, chosen.setting.spec, chosen.fixed)
        for _ in range(12):
            alone.evolve(chosen.fixed)
        gaps.append([gap_of(chosen.fixed, controller, world) for controller in (chosen.fittest(), alone.fittest())])
    with_gap, without = np.median(gaps, axis=0)
    assert with_gap < 0.6 * without


def gap_of(simulator, controller, world):
    driven = world.drive(controller, Key(5, 5), Purpose.PROBE, 1)
    return np.linalg.norm(simulator.poses(controller)[:, :2] - driven[:, :2], axis=1).mean()
