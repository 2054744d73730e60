"""A spec is checked, named by its hash, and says what is wrong with it."""

import dataclasses
import json
import re

import numpy as np
import pytest

import bns
from bns.cli.main import main
from bns.errors import SpecError
from bns.spec import APPROACH_VERSIONS, FIELDS, RunSpec, checked, evolvable, parameters_in
from bns.sweep.expand.grid import parse_stored


def test_equal_specs_have_equal_names_and_every_field_changes_the_name():
    base = RunSpec()
    assert base.run_id == RunSpec(mutation_rate=0.10).run_id
    others = {
        "robot": "snake", "task": "infinity", "world": "physics", "training_algorithm": "irprop-", "record": "full",
        "approach": "on-robot",
    }  # fmt: skip
    names = {base.run_id}
    for name, field in FIELDS.items():
        value = others.get(name) or (field.default / 2 if isinstance(field.default, float) else field.default + 1)
        names.add(dataclasses.replace(base, **{name: value}).run_id)
    assert len(names) == len(FIELDS) + 1


def test_name_begins_with_a_letter_and_the_engine_is_part_of_it():
    assert RunSpec().run_id[0] == "r"
    assert "engine_version" in json.loads(RunSpec().canonical_json())


def test_the_version_of_an_approach_is_part_of_its_runs_names_alone():
    for name, version in APPROACH_VERSIONS.items():
        said = json.loads(RunSpec(approach=name).canonical_json())
        assert said["approach_version"] == version
        assert RunSpec(**parameters_in(said)) == RunSpec(approach=name)
    assert "approach_version" in json.loads(RunSpec(approach="anytime+restart=0.1").canonical_json())
    assert "approach_version" not in json.loads(RunSpec(approach="on-robot").canonical_json())


def test_whole_numbers_and_shares_are_taken_as_their_own_type():
    assert RunSpec(population_size=50.0).run_id == RunSpec(population_size=50).run_id
    assert isinstance(RunSpec(mutation_rate=1).mutation_rate, float)


def test_numbers_of_numpy_are_the_plain_ones():
    given = RunSpec(seed=np.int64(3), evaluations=np.uint8(5), mutation_rate=np.float32(0.25), tournament_size=np.float64(0.3))
    plain = RunSpec(seed=3, evaluations=5, mutation_rate=0.25, tournament_size=0.3)
    assert given.run_id == plain.run_id
    for name in FIELDS:
        assert type(getattr(given, name)) is type(getattr(plain, name))
    assert RunSpec(evaluations=np.float32(5)).run_id == RunSpec(evaluations=5).run_id
    for odd in (np.True_, np.float64(1.5), np.array([3])):
        with pytest.raises(SpecError, match="it must be a whole number"):
            RunSpec(seed=odd)


@pytest.mark.parametrize(
    ("name", "value", "message"),
    [
        ("population_size", 0, r"population_size is 0; it must be a whole number from 1 to"),
        ("population_size", 1_000_000, r"population_size is 1000000; it must be a whole number from 1 to 100000\."),
        ("population_size", 1.5, r"population_size is 1.5; it must be a whole number"),
        ("population_size", True, r"population_size is True"),
        ("mutation_rate", 30, r"from 0 to 1\. For 30 percent write 0\.3"),
        ("mutation_rate", float("nan"), r"mutation_rate is nan"),
        ("mutation_rate", "high", r"mutation_rate is 'high'; it must be a number from 0 to 1"),
        ("world", "physic", r"unknown world 'physic'\. Did you mean 'physics'\? Valid: physics, robot, substitute"),
        ("mutation_rte", 0.1, r"unknown parameter 'mutation_rte'\. Did you mean 'mutation_rate'\?"),
        ("evaluations", -1, r"evaluations is -1"),
        ("seed", 2**32, r"seed is 4294967296; it must be a whole number from 0 to 4294967295\."),
    ],
)
def test_bad_values_are_named_with_what_is_allowed(name, value, message):
    with pytest.raises(SpecError, match=message):
        checked(name, value)
    if name in FIELDS:
        with pytest.raises(SpecError, match=message):
            RunSpec(**{name: value})


@pytest.mark.parametrize(
    ("name", "value", "message"),
    [
        ("population_size", 1, r"population_size is 1; it must be a whole number of 2 or more: crossover takes two parents"),
        ("population_size", 0, r"population_size is 0; it must be a whole number of 2 or more"),
        ("population_size", np.int64(-3), r"population_size is -3; it must be a whole number of 2 or more"),
        ("tournament_size", 0, r"tournament_size is 0; it must be a number above 0, up to 1: a tournament of none has no winner"),
        ("real_world_selection_size", -0.1, r"selection_size is -0\.1; it must be a number above 0, up to 1"),
        ("population_size", True, r"population_size is True"),
        ("mutation_rate", -0.1, r"mutation_rate is -0\.1; it must be a number from 0 to 1"),
    ],
)
def test_what_cannot_evolve_is_refused_before_it_is_run(tmp_path, capsys, name, value, message):
    with pytest.raises(SpecError, match=message):
        evolvable(name, value)
    with pytest.raises(SpecError, match=message):
        bns.run(robot="khepera", **{name: value})
    if value is not True:
        (tmp_path / "x.yaml").write_text(f"name: demo\nrobot: khepera\ngrid: {{{name}: [{value}]}}\n")
        assert main(["sweep", str(tmp_path / "x.yaml"), "--results", str(tmp_path / "r")]) == 2
        assert re.search(rf"^bns: .*x\.yaml:3: .*{message}", capsys.readouterr().err)


def test_a_stored_run_of_one_controller_is_read():
    assert RunSpec(population_size=1).population_size == 1
    assert parse_stored("name: demo\nrobot: khepera\nfixed: {population_size: 1}\n", "demo").combos[0]["population_size"] == 1


def test_a_population_fits_into_memory():
    with pytest.raises(SpecError, match=r"population_size is 100000 and max_commands 1000; .* 20000000 commands, .* 0\.8 GB"):
        RunSpec(population_size=100_000, max_commands=1000)
    assert RunSpec(population_size=100_000, max_commands=200).max_commands == 200


def test_shortest_list_must_not_exceed_the_longest():
    with pytest.raises(SpecError, match=r"min_commands is 4 and max_commands 1"):
        RunSpec(max_commands=1)
    assert RunSpec(min_commands=1, max_commands=1).max_commands == 1
