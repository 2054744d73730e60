"""Anytime learning: the estimate and its spreads, environments drawn from them, and who gives way when they change."""

from dataclasses import dataclass

import numpy as np
import pytest

from bns.approaches import start_approach
from bns.approaches.anytime import Estimate, UncertainSimulator, estimate
from bns.approaches.parts.physics_models import COMMON, ModelSpace
from bns.bootstrap.simulators import PhysicsSimulator
from bns.engine.philox import Key
from bns.robots import load_robot
from bns.robots.base import RandomStream
from bns.spec import RunSpec
from bns.tasks import load_task

ROBOT, TASK, KEY = load_robot("khepera"), load_task("khepera", "circle"), Key(3, 4)
SPACE = ModelSpace.of(ROBOT, COMMON)


@dataclass
class Linear:
    """A model space whose models are their numbers, and drives whose residuals are linear in them."""

    A: np.ndarray
    b: np.ndarray
    size: int = 3
    bounds: tuple = (np.full(3, -50.0), np.full(3, 50.0))

    def model(self, point):
        return point

    def residuals(self, point, window):
        return (self.A @ point - self.b)[-window:].reshape(-1, 2)


@pytest.mark.parametrize(("noise", "window"), [(1.0, 40), (0.2, 40), (1.0, 6)])
def test_the_estimate_of_a_linear_world_is_that_of_bayes(noise, window):
    """Normal errors of this size and a normal prior of one spread: mean and covariance are known in closed form."""
    random = np.random.default_rng(2)
    world = Linear(random.normal(size=(40, 3)), random.normal(size=40))
    A, b = world.A[-window:], world.b[-window:]
    found = estimate(world, world, Estimate(np.zeros(3), np.ones(3), noise), window)
    covariance = np.linalg.inv(A.T @ A / noise**2 + np.eye(3))
    mean = covariance @ A.T @ b / noise**2
    np.testing.assert_allclose(found.mean, mean, atol=1e-4)
    np.testing.assert_allclose(found.spread, np.sqrt(np.diag(covariance)), rtol=1e-4)
    assert found.noise == pytest.approx(np.sqrt(np.mean((A @ mean - b) ** 2)), rel=1e-3)


def test_each_generation_is_scored_in_an_environment_of_its_own_around_the_means():
    known = Estimate(np.array([0.5, -1.0, 1.0, 0.5, 0.3]), np.full(5, 0.5))
    population = ROBOT.initial_population(KEY, 20, 4, 10)

    def scored(estimated, stream):
        model = SPACE.model(estimated.mean)
        return UncertainSimulator(ROBOT, TASK, model, True, SPACE, estimated).score(population, stream).fitness.tolist()

    on_the_means = PhysicsSimulator(ROBOT, TASK, SPACE.model(known.mean)).score(population).fitness.tolist()
    assert scored(known, None) == on_the_means
    assert scored(Estimate(known.mean, np.zeros(5)), RandomStream(KEY, 1)) == on_the_means
    drawn = [scored(known, stream) for stream in (RandomStream(KEY, 1), RandomStream(KEY, 2), RandomStream(Key(3, 5), 1))]
    assert drawn[0] == scored(known, RandomStream(KEY, 1))
    assert len({tuple(one) for one in (*drawn, on_the_means)}) == 4


@pytest.mark.parametrize(("share", "fresh"), [(0.0, 0), (0.25, 2), (0.5, 4), (1.0, 8)])
def test_where_the_environment_has_changed_the_worst_give_way_to_random_controllers(share, fresh):
    spec = RunSpec(approach=f"anytime+restart={share}", population_size=8, world="physics", max_commands=12)
    approach = start_approach(ROBOT, TASK, KEY, spec)
    ranked = [int(i) for i in approach.evolver.order]
    before = {i: approach.evolver.population.controller(i).tolist() for i in ranked}
    approach._update()
    population = approach.evolver.population
    assert [i for i in ranked if population.controller(i).tolist() != before[i]] == ranked[8 - fresh :]
    first = [population.controller(i).tolist() for i in ranked]
    approach._update()
    assert [i for place, i in enumerate(ranked) if population.controller(i).tolist() != first[place]] == ranked[8 - fresh :]
