"""What all approaches tell of themselves beside what they find."""

import itertools

import pytest

from bns.approaches import start_approach
from bns.engine.philox import Key
from bns.robots import load_robot
from bns.spec import RunSpec
from bns.tasks import load_task


@pytest.fixture
def approach():
    spec = RunSpec(population_size=4, generations_per_evaluation=1)
    return start_approach(load_robot("khepera"), load_task("khepera", "circle"), Key(3, 4), spec)


def test_processor_time_is_that_since_it_was_asked_for_last(approach, monkeypatch):
    clock = itertools.accumulate([0.0, 3.0, 10.0, 0.5, 10.0, 4.0])  # each pair begins and ends some work
    monkeypatch.setattr("bns.approaches.parts.evolving.thread_time", lambda: next(clock))
    rounds = (["training_cpu_s", "evolution_cpu_s"], (3.0, 0.5)), (["training_cpu_s"], (4.0, 0.0)), ([], (0.0, 0.0))
    for work, spent in rounds:
        for one in work:
            with approach.timed(one):
                pass
        measures = approach.measures()
        assert (measures["training_cpu_s"], measures["evolution_cpu_s"]) == spent


def test_arithmetic_that_failed_in_evolution_and_in_training_is_counted_together(approach):
    approach.evolver.failures, approach.trainer.failures = 2, 3
    assert approach.measures()["arithmetic_failures"] == 5
