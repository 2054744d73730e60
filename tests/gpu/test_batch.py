"""Whole runs in the simulator against the CPU engine's, and what goes wrong in one of them."""

from dataclasses import replace

import numpy as np
import pytest

from bns.bootstrap.loop import run
from bns.cuda import batch as batches
from bns.cuda.batch import Batch
from bns.cuda.single import run as run_there
from bns.errors import SpecError
from bns.spec import RunSpec
from tests.gpu import ON_GPU

TINY = RunSpec(
    population_size=8,
    evaluations=2,
    generations_per_evaluation=2,
    training_iterations_per_evaluation=3,
    min_commands=2,
    max_commands=6,
)
OTHER = replace(
    TINY, seed=1, task="infinity", population_size=5, mutation_rate=0.5, training_algorithm="irprop-", max_commands=5,
    tournament_size=0.2, real_world_selection_size=0.3, generations_per_evaluation=1, training_iterations_per_evaluation=2,
)  # fmt: skip
SHORT = replace(TINY, seed=2, evaluations=1, min_commands=1, max_commands=4)
SNAKE = RunSpec(
    robot="snake", task="two-regions", population_size=4, evaluations=2, generations_per_evaluation=1,
    training_iterations_per_evaluation=2, min_commands=1, max_commands=2,
)  # fmt: skip
OTHER_SNAKE = replace(
    SNAKE, seed=1, task="three-regions", population_size=3, mutation_rate=0.9, training_algorithm="irprop-", max_commands=1,
    generations_per_evaluation=0, training_iterations_per_evaluation=1,
)  # fmt: skip
APART = 0.005
"""Share of the weights that may differ after training on a GPU. Rprop steps by the sign of a gradient; where the gradient is
nearly zero, rounding decides it (3 of 3,505 weights of one snake on an H100, 0.16 apart, which is two steps)."""


def carried_out(specs, spoil=None):
    batch = Batch(specs, threads=4)
    while not batch.done:
        batch.step()
        if spoil:
            spoil(batch)
    return batch


def assert_same(got, want):
    """Tolerances: single precision, summed up in another order, for a handful of iterations and generations."""
    assert set(got) == set(want)
    for name, values in want.items():
        if not name.endswith("_s"):
            there = np.asarray(got[name])
            assert (there.dtype.kind, len(there)) == (np.asarray(values).dtype.kind, len(values)), name
            np.testing.assert_allclose(
                there.astype(float), np.asarray(values, float), rtol=1e-4, atol=1e-7, err_msg=name, equal_nan=True
            )


def are_trained_alike(there, here):
    """False where a GPU's rounding led training elsewhere: from there a run goes its own way, and its rows are not compared."""
    apart = ~np.isclose(there, here, rtol=1e-4, atol=1e-4)
    assert apart.mean() <= (APART if ON_GPU else 0)
    return not apart.any()


@pytest.fixture(scope="module", params=["khepera", "snake"])
def together(request):
    """Runs that differ in everything a run can differ in, side by side."""
    return carried_out({"khepera": [TINY, OTHER, SHORT], "snake": [SNAKE, OTHER_SNAKE]}[request.param])


@pytest.mark.slow
def test_runs_side_by_side_are_those_of_the_cpu_engine(together):
    for number, (spec, columns) in enumerate(zip(together.specs, together.evals(), strict=True)):
        here = run(spec)
        if are_trained_alike(together.result(number).weights, here.weights):
            assert_same(columns, here.tables["evals"])


@pytest.mark.slow
def test_result_is_that_of_the_loop(together):
    for number, spec in enumerate(together.specs):
        there, here = together.result(number), run(spec)
        assert (there.world_digest, there.networks) == (here.world_digest, here.networks)
        if not are_trained_alike(there.weights, here.weights):
            continue
        np.testing.assert_allclose(there.fittest, here.fittest, rtol=1e-5)
        np.testing.assert_allclose(there.world_poses, here.world_poses, rtol=1e-4, atol=1e-4)
        np.testing.assert_allclose(there.snn_poses, here.snn_poses, rtol=1e-3, atol=1e-4)
        np.testing.assert_allclose(there.learned_from, here.learned_from, rtol=1e-6)


@pytest.mark.parametrize("spec", [TINY, pytest.param(SNAKE, marks=pytest.mark.slow)], ids=lambda spec: spec.robot)
def test_one_run_shows_every_evaluation_as_it_ends(spec, monkeypatch):
    monkeypatch.setattr(batches, "THREADS", 2)
    rows, spec = [], replace(spec, generations_per_evaluation=0, training_iterations_per_evaluation=0)
    result = run_there(spec, rows.append)
    assert [row["evaluation"] for row in rows] == [1, 2]
    assert_same(result.tables["evals"], run(spec).tables["evals"])


def test_a_run_is_the_same_to_the_last_bit_whatever_runs_beside_it():
    quick = replace(TINY, evaluations=1, training_iterations_per_evaluation=1, generations_per_evaluation=1)
    beside = replace(quick, seed=9, population_size=11, max_commands=9)
    alone, together = (carried_out(specs).columns(0) for specs in ([quick], [quick, beside]))
    for name in set(alone) - {"training_cpu_s", "evolution_cpu_s"}:
        np.testing.assert_array_equal(alone[name], together[name], err_msg=name)


@pytest.mark.parametrize("spec", [TINY, SNAKE], ids=lambda spec: spec.robot)
def test_networks_that_fail_begin_anew_in_their_run_alone(spec):
    quick = replace(spec, training_iterations_per_evaluation=0, generations_per_evaluation=0)

    def spoil(batch):
        batch._weights[1, 2, 7] = np.nan

    columns = carried_out([quick, replace(quick, seed=5)], spoil).evals()
    assert_same(columns[0], run(quick).tables["evals"])
    assert columns[1]["arithmetic_failures"].tolist() == [0, 1]
    assert np.isfinite(columns[1]["best_fitness"]).all()


def test_numbers_that_are_lost_mark_their_run_alone():
    quick = replace(TINY, training_iterations_per_evaluation=0, generations_per_evaluation=0)

    def spoil(batch):
        batch._measured[1, 0, 0] = np.nan

    columns = carried_out([quick, replace(quick, seed=5)], spoil).evals()
    assert_same(columns[0], run(quick).tables["evals"])
    assert isinstance(columns[1], ArithmeticError)
    assert str(columns[1]) == "diversity is nan at evaluation 1"


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"robot": "snake+rigid", "task": "two-regions"}, r"there are no kernels for the robot snake\+rigid"),
        ({"world": "physics"}, "world is 'physics', and a GPU has only 'substitute'"),
        ({"record": "paths"}, "record is 'paths', and a GPU keeps only 'evals'"),
        ({"population_size": 5000}, "population_size is 5000; at most 4096"),
    ],
)
def test_what_only_the_cpu_can_do(changes, message):
    with pytest.raises(SpecError, match=f"--device cuda: {message}.*leave --device out"):
        Batch([TINY, replace(TINY, **changes)])
