"""Children that lose commands: ``approach: bns+shorten=...``."""

import numpy as np
import pytest

from bns.approaches import start_approach
from bns.approaches.parts.shortening import shorten
from bns.bootstrap.loop import run
from bns.engine.evolution import Population
from bns.engine.philox import Key
from bns.errors import SpecError
from bns.robots import load_robot
from bns.spec import RunSpec
from bns.tasks import load_task

SMALL = {"evaluations": 4, "population_size": 30, "generations_per_evaluation": 3, "training_iterations_per_evaluation": 5}
KHEPERA, KEY = load_robot("khepera"), Key(3, 4)


def numbered(lengths, capacity=12):
    """Command c of list i is (i, c, 0), and it comes from the place 100 i + c."""
    population = Population(np.zeros((len(lengths), capacity, 3), np.float32), np.array(lengths, np.int32))
    population.commands[..., 0] = np.arange(len(lengths))[:, None]
    population.commands[..., 1] = np.arange(capacity)
    population.origin[:] = 100 * np.arange(len(lengths))[:, None] + np.arange(capacity)
    return population


def test_all_but_the_elite_and_the_shortest_lose_their_end_or_one_command():
    population = numbered([10] * 400 + [4] * 10)
    shorten(population, 1.0, 4, KEY, 1)
    ends = np.zeros(410, bool)
    for i in range(410):
        kept, length = population.controller(i), int(population.lengths[i])
        if i == 0 or i >= 400:
            assert length == len(numbered([10] * 400 + [4] * 10).controller(i))
            continue
        assert 4 <= length <= 9
        assert (kept[:, 0] == i).all()
        which = kept[:, 1].astype(int)
        ends[i] = (which == np.arange(length)).all()
        if not ends[i]:
            assert length == 9
            assert sorted(set(range(10)) - set(which)) == [np.flatnonzero(which != np.arange(9))[0]]
            out = int(np.flatnonzero(which != np.arange(9))[0])
            assert (population.origin[i, out:9] == -1).all()
            assert (population.origin[i, :out] == 100 * i + np.arange(out)).all()
    assert 0.45 < ends[1:400].mean() < 0.65  # half, and where the last command alone is left out
    assert set(population.lengths[1:400]) == {4, 5, 6, 7, 8, 9}


def test_so_large_a_share_loses_some_and_draws_go_by_key_and_generation():
    def lengths(share=0.2, key=KEY, generation=1):
        population = numbered([10] * 1000)
        shorten(population, share, 4, key, generation)
        return population.lengths

    assert (lengths(0.0) == 10).all()
    assert np.mean(lengths() < 10) == pytest.approx(0.2, abs=0.04)
    assert (lengths() == lengths()).all()
    assert (lengths() != lengths(key=Key(5, 4))).any()
    assert (lengths() != lengths(generation=2)).any()


@pytest.mark.parametrize("noise", ["", "+noise=2"])
def test_what_is_taken_over_from_parents_is_what_would_be_computed_anew(noise):
    spec = RunSpec(**SMALL | {"approach": f"bns+shorten=0.5{noise}", "population_size": 100})
    approach = start_approach(KHEPERA, load_task("khepera", "circle"), KEY, spec)
    approach.evolve()
    evolver = approach.evolver
    anew = approach.simulator.score(Population(evolver.population.commands, evolver.population.lengths))
    np.testing.assert_array_equal(evolver.scores.outputs, anew.outputs)


def test_each_generation_is_shortened_with_draws_of_its_own(monkeypatch):
    told = []
    monkeypatch.setattr("bns.approaches.bns.shorten", lambda children, *given: told.append((len(children), *given)))
    spec = RunSpec(**SMALL | {"approach": "bns+shorten=0.25", "min_commands": 5})
    approach = start_approach(KHEPERA, load_task("khepera", "circle"), KEY, spec)
    approach.evolve()
    key = approach.setting.own_key("shortening")
    assert told == [(30, 0.25, 5, key, generation) for generation in (1, 2, 3)]


@pytest.mark.parametrize(("robot", "task"), [("khepera", "circle"), ("snake", "two-regions")])
def test_none_by_default_and_the_same_numbers_then(robot, task):
    fitness = {
        name: list(run(RunSpec(robot=robot, task=task, approach=name, **SMALL)).tables["evals"]["mean_commands"])
        for name in ("bns", "bns+shorten=0", "bns+shorten=0.3")
    }
    assert fitness["bns"] == fitness["bns+shorten=0"] != fitness["bns+shorten=0.3"]


def test_it_is_a_share():
    with pytest.raises(SpecError, match=r"shorten is '1\.5'; it must be a number from 0 to 1"):
        run(RunSpec(approach="bns+shorten=1.5", **SMALL))
