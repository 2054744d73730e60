"""Combinations drawn from ranges."""

import numpy as np
import pytest

import bns
from bns.errors import SpecError
from bns.sweep.expand.grid import load_sweep

HEAD = "name: demo\nrobot: khepera\n"

RANGES = "ranges: {mutation_rate: [0.02, 0.3], population_size: [50, 53]}"


def sweep_of(tmp_path, body):
    path = tmp_path / "x.yaml"
    path.write_text(HEAD + body)
    return load_sweep(path)


def drawn(tmp_path, kind, count, more=""):
    combos = sweep_of(tmp_path, f"sample: {{{kind}: {count}, {RANGES}{more}}}\n").combos
    return np.array([[combo["mutation_rate"], combo["population_size"]] for combo in combos])


def test_a_latin_hypercube_has_one_value_in_each_part_of_each_range(tmp_path):
    values = drawn(tmp_path, "lhs", 40)
    assert sorted((values[:, 0] - 0.02) // (0.28 / 40)) == list(range(40))
    assert np.bincount(values[:, 1].astype(int))[50:].tolist() == [10, 10, 10, 10]


def test_sobol_points_are_balanced_in_two_dimensions(tmp_path):
    values = drawn(tmp_path, "sobol", 64)
    cells = np.floor((values - [0.02, 50]) / [0.28 / 4, 1]).astype(int)
    assert np.bincount(cells[:, 0] * 4 + cells[:, 1], minlength=16).tolist() == [4] * 16


def test_random_draws_keep_their_ranges_and_reach_their_ends(tmp_path):
    values = drawn(tmp_path, "random", 400)
    assert 0.02 <= values[:, 0].min() < 0.03
    assert 0.29 < values[:, 0].max() <= 0.3
    assert set(values[:, 1]) == {50, 51, 52, 53}


@pytest.mark.parametrize("kind", ["lhs", "sobol", "random"])
def test_the_same_file_gives_the_same_combinations_and_another_seed_others(tmp_path, kind):
    first = drawn(tmp_path, kind, 16)
    np.testing.assert_array_equal(drawn(tmp_path, kind, 16), first)
    assert (drawn(tmp_path, kind, 16, ", seed: 1")[:, 0] != first[:, 0]).any()
    ranges = "ranges: {population_size: [50, 53], mutation_rate: [0.02, 0.3]}"
    other_order = sweep_of(tmp_path, f"sample: {{{ranges}, {kind}: 16}}\n")
    assert [combo["mutation_rate"] for combo in other_order.combos] == first[:, 0].tolist()


def test_these_are_the_draws_of_every_machine_and_version(tmp_path):
    """Runs are named by their numbers: another draw for the same file would begin a stored sweep again."""
    ranges = "ranges: {mutation_rate: [0.02, 0.3]}"
    got = {
        kind: [c["mutation_rate"] for c in sweep_of(tmp_path, f"sample: {{{kind}: 4, {ranges}}}\n").combos]
        for kind in ("lhs", "sobol", "random")
    }
    assert got == GOLDEN


GOLDEN = {
    "lhs": [0.0239944, 0.207856, 0.109436, 0.291208],
    "sobol": [0.134786, 0.231012, 0.17679, 0.0629607],
    "random": [0.198349, 0.0955403, 0.0314726, 0.0246277],
}


def test_a_sample_is_multiplied_with_the_grid_and_stands_on_what_is_fixed(tmp_path):
    sweep = sweep_of(
        tmp_path,
        "seeds: 2\nfixed: {evaluations: 5}\ngrid: {task: [circle, infinity]}\n"
        "sample: {lhs: 8, ranges: {mutation_rate: [0, 1]}}\n",
    )
    assert sweep.total == 2 * 2 * 8
    by_task = {task: [c["mutation_rate"] for c in sweep.combos if c["task"] == task] for task in ("circle", "infinity")}
    assert by_task["circle"] == by_task["infinity"]
    assert all(combo["evaluations"] == 5 for combo in sweep.combos)


@pytest.mark.parametrize(
    ("sample", "message"),
    [
        ("{lhs: 8}", "sample needs one of lhs, sobol and random"),
        ("{ranges: {mutation_rate: [0, 1]}}", "sample needs one of lhs, sobol and random"),
        ("{lhs: 8, random: 8, ranges: {mutation_rate: [0, 1]}}", "sample needs one of"),
        ("{lsh: 8, ranges: {mutation_rate: [0, 1]}}", "unknown key of sample 'lsh'. Did you mean 'lhs'"),
        ("{lhs: 0, ranges: {mutation_rate: [0, 1]}}", "lhs is 0; it must be a whole number from 1 to 100000"),
        ("{lhs: 1e9, ranges: {mutation_rate: [0, 1]}}", "it must be a whole number from 1"),
        ("{lhs: true, ranges: {mutation_rate: [0, 1]}}", "lhs is True"),
        ("{sobol: 40, ranges: {mutation_rate: [0, 1]}}", "sobol is 40; .* write 32 or 64"),
        ("{lhs: 8, seed: -1, ranges: {mutation_rate: [0, 1]}}", "seed is -1"),
        ("{lhs: 8, ranges: {}}", "ranges is empty"),
        ("{lhs: 8, ranges: {mutation: [0, 1]}}", "unknown parameter with a range 'mutation'. Did you mean 'mutation_rate'"),
        ("{lhs: 8, ranges: {task: [circle, infinity]}}", "unknown parameter with a range 'task'"),
        ("{lhs: 8, ranges: {seed: [0, 5]}}", "unknown parameter with a range 'seed'"),
        ("{lhs: 8, ranges: {mutation_rate: 0.1}}", "the range of mutation_rate is 0.1; give its two ends"),
        ("{lhs: 8, ranges: {mutation_rate: [0.3, 0.1]}}", "its first end must be below its second"),
        ("{lhs: 8, ranges: {mutation_rate: [0, 20]}}", "the range of mutation_rate: mutation_rate is 20"),
        ("{lhs: 8, ranges: {mutation_rate: [0, .nan]}}", "the range of mutation_rate: mutation_rate is nan"),
        ("[lhs, 8]", "sample"),
    ],
)
def test_what_cannot_be_drawn_is_answered_with_its_line(tmp_path, sample, message):
    with pytest.raises(SpecError, match=rf"x\.yaml:3: .*{message}"):
        sweep_of(tmp_path, f"sample: {sample}\n")


def test_a_parameter_is_drawn_or_given_not_both(tmp_path):
    with pytest.raises(SpecError, match=r"x\.yaml:4: 'mutation_rate' is given under sample and, on line 3, under grid"):
        sweep_of(tmp_path, "grid: {mutation_rate: [0.1, 0.2]}\nsample: {lhs: 8, ranges: {mutation_rate: [0, 1]}}\n")


def test_a_sweep_in_python_draws_the_same(tmp_path):
    sample = {"lhs": 8, "ranges": {"mutation_rate": [0.02, 0.3]}}
    in_python = bns.Sweep("demo", "khepera", sample=sample)
    assert in_python._described.combos == sweep_of(tmp_path, "sample: {lhs: 8, ranges: {mutation_rate: [0.02, 0.3]}}\n").combos
