"""Evolution under noise: ``approach: bns+noise=...``."""

from dataclasses import replace

import numpy as np
import pytest

from bns.approaches import start_approach
from bns.approaches.parts.hybrid import Arcs, HybridSimulator
from bns.approaches.parts.noisy import DRAWS, ELITE, FEWEST, NoisySimulator, most_certain, residual_sd
from bns.bootstrap.loop import run
from bns.bootstrap.simulators import NetworkSimulator
from bns.engine import reference
from bns.engine.evolution import Population, rank
from bns.engine.patterns import PatternSet
from bns.engine.philox import Key, Purpose, normals
from bns.engine.snn import predict
from bns.errors import SpecError
from bns.physics.model import load_model
from bns.robots import load_robot
from bns.robots.base import RandomStream
from bns.robots.khepera import GOAL_RADIUS_M, MISSED_GOAL_M, START
from bns.robots.simulator import load_static_simulator
from bns.spec import RunSpec
from bns.tasks import load_task

SMALL = {"evaluations": 6, "population_size": 20, "generations_per_evaluation": 3, "training_iterations_per_evaluation": 5}
KHEPERA, CIRCLE, KEY = load_robot("khepera"), load_task("khepera", "circle"), Key(3, 4)
STREAM, SD, ROWS = RandomStream(KEY, 17), np.array([0.02, 0.03, 0.1]), 6
STILL = load_static_simulator("khepera").weights


def numbers(approach, **changes):
    evals = run(RunSpec(**SMALL | {"approach": approach} | changes)).tables["evals"]
    return {name: list(evals[name]) for name in ("best_fitness", "mean_fitness", "fitness_world", "driven_ms")}


def some(count=60, seed=1):
    return KHEPERA.initial_population(Key(seed, 1), count, 4, 40)


def drawn(rows, longest, sd=SD, stream=STREAM):
    return normals(stream.key, Purpose.ROLLOUT_NOISE, stream.step, rows, longest)[..., :3] * sd


@pytest.mark.parametrize(("radius_m", "most"), [(None, 0.5), (0.3, 3.0)])
def test_the_kernel_is_algorithm_2_under_each_row_of_noise(radius_m, most):
    population, task = some(), replace(CIRCLE, radius_m=radius_m)
    outputs = KHEPERA.score(population, STILL, task).outputs
    found = KHEPERA.expected(population, outputs, task, SD, ROWS, STREAM)
    noise, ends = drawn(ROWS, int(population.lengths.max())), np.cumsum(population.lengths)
    for i, (end, length) in enumerate(zip(ends, population.lengths, strict=True)):
        moved = KHEPERA.displacements(outputs[:, end - length : end])
        slow = reference.expected_walk(
            moved, noise[:, :length], START, task.goals_m, radius_m or GOAL_RADIUS_M, MISSED_GOAL_M
        )
        np.testing.assert_allclose((1 / found.fitness[i], found.goals_reached[i], found.success[i]), slow, rtol=1e-5)
    assert found.goals_reached.max() > most  # else little was compared
    assert (found.success.max() > 0) == (radius_m is not None)
    assert found.failures == 0


def test_without_any_noise_it_is_the_robot_s_own_score():
    population = some()
    plain = KHEPERA.score(population, STILL, CIRCLE)
    found = KHEPERA.expected(population, plain.outputs, CIRCLE, 0 * SD, ROWS, STREAM)
    np.testing.assert_allclose(found.fitness, plain.fitness, rtol=1e-12)
    np.testing.assert_allclose(found.goals_reached, plain.goals_reached)


def test_failed_arithmetic_under_noise_is_counted():
    population = some(3)
    outputs = KHEPERA.score(population, STILL, CIRCLE).outputs
    outputs[2, 0] = np.nan
    found = KHEPERA.expected(population, outputs, CIRCLE, SD, ROWS, STREAM)
    assert found.failures == 1
    assert found.fitness[0] == 0 < found.fitness[1:].min()


def test_all_controllers_have_the_same_noise_and_the_next_generation_another():
    one = some(1)
    twice = Population(np.repeat(one.commands, 2, axis=0), np.repeat(one.lengths, 2))
    simulator = NoisySimulator(NetworkSimulator(KHEPERA, CIRCLE, STILL), SD, ROWS)
    now, later = (simulator.score(twice, RandomStream(KEY, step)).fitness for step in (1, 2))
    assert now[0] == now[1] != later[0] == later[1]
    assert simulator.score(twice).fitness[0] == simulator.networks.score(twice).fitness[0]


@pytest.mark.parametrize("sd", [0 * SD, SD / 3], ids=["none", "some"])
def test_behind_a_model_the_sum_of_model_and_networks_is_walked_under_noise(sd):
    population, task = some(), replace(CIRCLE, radius_m=0.3)
    networks = NetworkSimulator(KHEPERA, task, STILL)
    hybrid = HybridSimulator(KHEPERA, task, Arcs(KHEPERA, load_model("khepera")), networks)
    found = NoisySimulator(hybrid, sd, ROWS).score(population, STREAM)
    rows = drawn(ROWS, int(population.lengths.max()), sd)
    for i, length in enumerate(population.lengths):
        moved = KHEPERA.measured_displacements(hybrid.poses(population.controller(i)))
        slow = reference.expected_walk(moved, rows[:, :length], START, task.goals_m, 0.3, MISSED_GOAL_M)
        np.testing.assert_allclose(1 / found.fitness[i], slow[0], rtol=1e-4)
    assert len(set(found.goals_reached)) > 1  # else the walk meant little
    # What children inherit is what the networks said, without the model.
    np.testing.assert_array_equal(found.outputs, networks.score(population).outputs)


def test_behind_a_model_the_noise_is_what_the_networks_have_not_learned_of_its_errors():
    drives = [KHEPERA.random_controllers(KEY, 10, 13).controller(number) for number in range(5)]

    def started(name):
        approach = start_approach(KHEPERA, CIRCLE, KEY, RunSpec(**SMALL | {"approach": name, "population_size": 50}))
        approach._narrowed = 10
        for number, commands in enumerate(drives, start=1):
            approach.learn(commands, _driven(commands), number)
        return approach

    said, plain = started("bns+noise=2+model=khepera"), started("bns+noise=2")
    # The drawing is what was driven: untrained networks say nothing beside it, and there is no noise but rounding.
    assert said._on(said.weights).sd.max() < 1e-5 < plain._on(plain.weights).sd.min() / 100


def _driven(commands):
    arcs = Arcs(KHEPERA, load_model("khepera"))
    return KHEPERA.poses(arcs.displacements(commands), commands)


def test_the_noise_is_the_error_on_patterns_that_taught_nothing():
    X = KHEPERA.inputs(KHEPERA.random_controllers(KEY, 1, 4000).controller(0))
    patterns, off = PatternSet.empty(5, 3), np.random.default_rng(0).normal(size=(4000, 3)) * SD
    patterns.add(X[:, :7], predict(STILL, X[:, :7]) + np.float32(0.5))
    assert residual_sd(KHEPERA, STILL, patterns).tolist() == [0, 0, 0]
    patterns.add(X, KHEPERA.targets(KHEPERA.displacements(predict(STILL, X)) + off))
    patterns.forget(7)
    np.testing.assert_allclose(residual_sd(KHEPERA, STILL, patterns), SD, rtol=0.04)
    assert FEWEST == 8


def test_a_run_takes_its_noise_from_its_own_drives_and_not_from_the_world_s_file(monkeypatch):
    spec = RunSpec(**SMALL | {"approach": "bns+noise=2+margin=0.02", "population_size": 50})
    approach, rng = start_approach(KHEPERA, CIRCLE, KEY, spec), np.random.default_rng(1)
    assert approach.simulator.sd.tolist() == [0, 0, 0]  # nothing is known yet
    for number in range(1, 5):
        commands = KHEPERA.random_controllers(KEY, 10, 13).controller(number)
        approach.learn(commands, KHEPERA.poses(rng.normal(size=(13, 3)) * 0.1), number)
        approach._narrowed = 7  # tenths
        approach.advance()
    validation = approach.trainer.data.validation
    assert validation.count >= FEWEST
    np.testing.assert_allclose(approach.simulator.sd, 0.7 * residual_sd(KHEPERA, approach.weights, validation))
    assert approach.simulator.sd.min() > 0.035


def test_noise_grows_by_a_tenth_when_all_goals_are_reached_and_shrinks_when_they_are_not():
    approach, shares = start_approach(KHEPERA, CIRCLE, KEY, RunSpec(**SMALL | {"approach": "bns+noise=2"})), []
    approach.learn(np.full((50, 3), 10_000.0, np.float32), KHEPERA.poses(np.full((50, 3), 0.1)), 1)
    for reached in [True] * 12 + [False] * 3:
        count = len(CIRCLE.goals_m) * reached
        approach.evolve = lambda count=count: approach.evolver.scores.goals_reached.fill(count)
        approach.advance()
        whole = residual_sd(KHEPERA, approach.weights, approach.trainer.data.validation)
        shares.append(10 * approach.simulator_now().sd[1] / whole[1])
    np.testing.assert_allclose(shares, [*range(1, 11), 10, 10, 9, 8, 7])


def test_the_fittest_is_the_one_of_the_best_tenth_that_succeeds_most_often():
    wide = replace(CIRCLE, radius_m=0.2)
    simulator = NoisySimulator(NetworkSimulator(KHEPERA, wide, STILL), SD / 3, 1)
    population = some(2000)
    order = rank(simulator.score(population, STREAM).fitness)
    found = most_certain(simulator, population, order, wide, KEY, 5)
    elite = order[: int(ELITE * 2000)]
    assert found in elite
    success, fitness = simulator.success(population, wide, RandomStream(KEY, 5))
    assert success[found] == success[elite].max() > success[order[0]]
    assert fitness[found] == fitness[elite[success[elite] == success[found]]].max()
    moved = KHEPERA.measured_displacements(simulator.poses(population.controller(found)))
    noise = drawn(DRAWS, 40, SD / 3, RandomStream(KEY, 5))[:, : len(moved)]
    slow = reference.expected_walk(moved, noise, START, wide.goals_m, 0.2, MISSED_GOAL_M)
    assert success[found] == pytest.approx(slow[2], abs=1e-9)


class Told:
    """A simulator whose answers are told."""

    def success(self, population, task, stream):
        assert len(population) == 3
        return np.array([0.5, 0.75, 0.75]), np.array([9.0, 1.0, 2.0])


def test_the_rate_of_success_counts_before_fitness_and_of_equals_fitness():
    order = np.arange(30)[::-1]
    assert most_certain(Told(), some(30), order, CIRCLE, KEY, 1) == order[2]


def test_goals_reached_are_the_rounded_mean():
    population, simulator = some(400), NoisySimulator(NetworkSimulator(KHEPERA, replace(CIRCLE, radius_m=0.2), STILL), SD, ROWS)
    scores = simulator.score(population, STREAM)
    mean = KHEPERA.expected(population, scores.outputs, simulator.networks.task, SD, ROWS, STREAM).goals_reached
    assert scores.goals_reached.dtype == np.int32
    assert np.abs(scores.goals_reached - mean).max() <= 0.5 + 1e-9
    assert (scores.goals_reached < mean - 0.1).any()
    assert (scores.goals_reached > mean + 0.1).any()


def test_each_round_judges_the_best_tenth_with_draws_of_its_own():
    spec = RunSpec(**SMALL | {"approach": "bns+noise=2", "population_size": 200})
    wide = replace(CIRCLE, radius_m=0.3)
    approach, rng, differs = start_approach(KHEPERA, wide, KEY, spec), np.random.default_rng(1), 0
    approach._narrowed = 10
    for number in range(1, 5):
        commands = KHEPERA.random_controllers(KEY, 10, 13).controller(number)
        approach.learn(commands, KHEPERA.poses(rng.normal(size=(13, 3)) * 0.1), number)
        approach.advance()
        evolver, key = approach.evolver, approach.setting.own_key("noise")
        judged = (approach.simulator, evolver.population, evolver.order, wide, key)
        np.testing.assert_array_equal(
            approach.fittest(), evolver.population.controller(most_certain(*judged, evolver.generations))
        )
        differs += most_certain(*judged, evolver.generations) != most_certain(*judged, 0)
    assert differs  # else the draws of a round do not matter here


def test_no_noise_leaves_every_number_as_it_was_and_noise_goes_by_the_seed():
    assert numbers("bns") == numbers("bns+noise=0") != numbers("bns+noise=3")
    assert numbers("bns+noise=3") == numbers("bns+noise=3") != numbers("bns+noise=3", seed=1)
    assert numbers("bns+noise=3") != numbers("bns+noise=3+margin=0.03")


@pytest.mark.parametrize(
    "more", ["ensemble=2", "ensemble=2+use=sampled", "informed=0.2", "window=3", "restart=2", "model=khepera", "polish=3"]
)
def test_it_combines_with_the_other_options(more):
    assert len(numbers(f"bns+noise=2+{more}")["best_fitness"]) == SMALL["evaluations"]


@pytest.mark.parametrize(
    ("approach", "changes", "said"),
    [
        ("bns+noise=4", {"robot": "snake", "task": "two-regions"}, "robot snake takes no noise from an approach"),
        ("bns+noise=4+ensemble=3+use=worst", {}, "cannot be combined with use=worst"),
        ("bns+noise=1.5", {}, "noise is '1.5'; it must be a whole number from 0 to 1000"),
    ],
)
def test_what_cannot_be_is_refused(approach, changes, said):
    with pytest.raises(SpecError, match=said):
        run(RunSpec(**SMALL | {"approach": approach} | changes))
