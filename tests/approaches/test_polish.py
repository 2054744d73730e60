"""A local search on the surest controller after each round: ``approach: bns+noise=...+polish=...``."""

from dataclasses import replace

import numpy as np
import pytest

from bns.approaches.bns import BootstrappedNeuroSimulation
from bns.approaches.parts.base import Setting
from bns.approaches.parts.noisy import NoisySimulator
from bns.approaches.parts.polishing import _changed, polished
from bns.bootstrap.loop import run
from bns.bootstrap.simulators import NetworkSimulator
from bns.engine.evolution import Population
from bns.engine.philox import Key
from bns.errors import SpecError
from bns.options import parsed_options
from bns.robots import load_robot
from bns.robots.base import RandomStream
from bns.robots.simulator import load_static_simulator
from bns.spec import RunSpec
from bns.tasks import load_task

SMALL = {"evaluations": 6, "population_size": 20, "generations_per_evaluation": 3, "training_iterations_per_evaluation": 5}
KHEPERA, KEY = load_robot("khepera"), Key(3, 4)
WIDE = replace(load_task("khepera", "circle"), radius_m=0.2)
STATIC = load_static_simulator("khepera")
SIMULATOR = NoisySimulator(NetworkSimulator(KHEPERA, WIDE, STATIC.weights), STATIC.noise_sd, 8)
START = np.array([[20000, 20000, 2000], [20000, 10000, 2000], [20000, 15000, 2000]], np.float32)


def setting(approach="bns+noise=4+polish=20", **changes):
    spec = RunSpec(**SMALL | {"approach": approach} | changes)
    return Setting(KHEPERA, WIDE, KEY, spec, parsed_options(approach, BootstrappedNeuroSimulation.options))


def alone(commands):
    return Population(commands[None].copy(), np.array([len(commands)], np.int32))


def success(commands, stream):
    return SIMULATOR.success(alone(commands), WIDE, stream)[0][0]


@pytest.fixture(scope="module")
def lists():
    """Three of 4,000 random controllers, which succeed in some 20, 30 and 40 % of noisy simulations."""
    population = KHEPERA.initial_population(Key(5, 1), 4000, 4, 12)
    share, _ = SIMULATOR.success(population, WIDE, RandomStream(KEY, 1))
    return [population.controller(int(np.argmin(np.abs(share - wanted)))) for wanted in (0.2, 0.3, 0.4)]


def test_it_succeeds_more_often_in_draws_that_it_has_not_seen(lists):
    found = polished(SIMULATOR, lists, setting("bns+noise=4+polish=150"), 7)
    fresh = RandomStream(KEY, 99)
    assert success(found, fresh) > success(lists[-1], fresh) + 0.3
    assert (found >= KHEPERA.bounds.low).all()
    assert (found <= KHEPERA.bounds.high).all()


def test_without_a_step_it_is_the_surest_of_those_given(lists):
    own = setting("bns+noise=4+polish=0")
    stream = RandomStream(own.own_key("polishing"), 7)
    shares = [success(one, stream) for one in lists]
    assert max(shares) > min(shares)
    for given in (lists, lists[::-1]):
        np.testing.assert_array_equal(polished(SIMULATOR, given, own, 7), lists[int(np.argmax(shares))])


def test_in_the_draws_of_its_round_it_is_never_worse(lists):
    own = setting("bns+noise=4+polish=5")
    for number in range(4):
        stream = RandomStream(own.own_key("polishing"), number)
        assert success(polished(SIMULATOR, lists, own, number), stream) >= max(success(one, stream) for one in lists)


def test_where_nothing_helps_the_list_stays():
    far = [np.repeat(START, 4, axis=0)]
    np.testing.assert_array_equal(polished(SIMULATOR, far, setting(), 1), far[0])


@pytest.mark.parametrize(("shortest", "lengths"), [(3, {3}), (2, {2, 3})])
def test_lists_that_are_tried_are_no_shorter_than_the_shortest_allowed_and_within_bounds(shortest, lengths):
    own, random = setting(min_commands=shortest), np.random.default_rng(1)
    bounds = KHEPERA.bounds
    at_the_ends = np.array([bounds.low, bounds.high, bounds.low], np.float32)
    tried = [_changed(at_the_ends, 0.1, own, random) for _ in range(200)]
    assert {len(one) for one in tried} == lengths
    assert all((one >= bounds.low).all() and (one <= bounds.high).all() for one in tried)
    of_all = [one for one in tried if len(one) == 3 and (one != at_the_ends).sum() > 3]  # half of them lie at a bound
    assert 40 < len(of_all) < 140


def test_each_round_draws_anew_and_the_same_round_the_same(lists):
    one, again, other = (polished(SIMULATOR, lists, setting(), number) for number in (1, 1, 2))
    np.testing.assert_array_equal(one, again)
    assert one.shape != other.shape or (one != other).any()


def advanced(approach, rounds):
    """An approach after so many rounds whose networks are the static simulator, and which are said to have reached all goals."""
    evolver, goals = approach.evolver, len(WIDE.goals_m)
    approach.train = lambda: None
    for number in range(rounds):
        weights = STATIC.weights if number % 2 == 0 else STATIC.weights * np.float32(1.02)
        approach.copy = lambda weights=weights: setattr(approach, "simulator", replace(
            SIMULATOR, networks=NetworkSimulator(KHEPERA, WIDE, weights)))  # fmt: skip
        approach.evolve = lambda: (evolver.evolve(approach.simulator), evolver.scores.goals_reached.fill(goals))
        approach.advance()


def test_what_was_polished_is_the_fittest_drives_on_and_is_scored():
    approach = BootstrappedNeuroSimulation.start(setting())
    advanced(approach, 1)
    evolver, fittest = approach.evolver, approach.fittest()
    place = [i for i in range(20) if np.array_equal(evolver.population.controller(i), fittest)]
    assert len(place) == 1
    stream = RandomStream(evolver.key, evolver.generations)
    np.testing.assert_array_equal(evolver.scores.fitness, approach.simulator.score(evolver.population, stream).fitness)
    assert (np.diff(evolver.scores.fitness[evolver.order]) <= 0).all()
    assert (evolver.population.origin[place[0]] == -1).all()


def test_what_was_polished_is_the_fittest_though_others_succeed_more_often(monkeypatch):
    poor = np.repeat(START, 2, axis=0)
    monkeypatch.setattr("bns.approaches.bns.polished", lambda *_: poor)
    approach = BootstrappedNeuroSimulation.start(setting())
    advanced(approach, 1)
    np.testing.assert_array_equal(approach.fittest(), poor)


def test_what_was_polished_before_is_polished_further(monkeypatch):
    given = []

    def noted(simulator, lists, own, number):
        given.append([one.copy() for one in lists])
        return polished(simulator, lists, own, number)

    monkeypatch.setattr("bns.approaches.bns.polished", noted)
    approach = BootstrappedNeuroSimulation.start(setting())
    advanced(approach, 1)
    before = approach.fittest()
    advanced(approach, 1)
    assert [len(lists) for lists in given] == [1, 2]
    np.testing.assert_array_equal(given[1][1], before)


def test_it_waits_until_all_goals_are_reached_in_simulation():
    approach = BootstrappedNeuroSimulation.start(setting())
    approach.train = approach.copy = lambda: None
    approach.evolve = lambda: approach.evolver.scores.goals_reached.fill(0)
    before = approach.evolver.population.commands.copy()
    approach.advance()
    assert approach._polished == []
    np.testing.assert_array_equal(approach.evolver.population.commands, before)


def numbers(approach, **changes):
    evals = run(RunSpec(**SMALL | {"approach": approach} | changes)).tables["evals"]
    return [list(evals[name]) for name in ("best_fitness", "fitness_world", "driven_ms")]


def test_no_step_leaves_every_number_as_it_was():
    assert numbers("bns+noise=3") == numbers("bns+noise=3+polish=0")


def test_there_is_no_search_without_noise():
    with pytest.raises(SpecError, match="it searches for success under noise, and there is none"):
        run(RunSpec(**SMALL | {"approach": "bns+polish=5"}))
