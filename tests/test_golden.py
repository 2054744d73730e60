"""A tiny run's numbers are written down: who changes them raises ENGINE_VERSION, so that results are never mixed."""

import pytest

from bns.bootstrap.loop import run
from bns.spec import ENGINE_VERSION, RunSpec

SPEC = RunSpec(
    seed=5,
    population_size=30,
    evaluations=2,
    generations_per_evaluation=3,
    training_iterations_per_evaluation=25,
    world="physics",
)
KNOWN = {
    3: {
        "diversity": [0.569527, 0.366708],
        "fitness_simulation": [0.0323846, 0.0319481],
        "fitness_world": [0.0241326, 0.0241249],
        "evaluated_fitness_world": [0.0240954, 0.0241344],
        "validation_error": [0.352969, 0.350278],
        "training_patterns": [3.0, 5.0],
        "commands": [5.0, 4.0],
        "mean_commands": [4.2, 4.16667],
        "driven_ms": [6242.71, 6879.65],
    }
}


def test_numbers_of_the_first_evaluations_are_those_of_this_engine_version():
    evals = run(SPEC).tables["evals"]
    assert {name: evals[name].tolist() for name in KNOWN[ENGINE_VERSION]} == {
        # Only the first steps: later ones amplify what the last bit of another kind of processor does.
        name: pytest.approx(values, rel=2e-3)
        for name, values in KNOWN[ENGINE_VERSION].items()
    }
