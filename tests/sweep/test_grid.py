"""Sweep files: what they mean, and what every mistake in them is answered with."""

import re
from pathlib import Path

import pytest

from bns.errors import ModelError, SpecError
from bns.spec import FIELDS
from bns.sweep.expand.grid import Sweep, load_sweep, load_sweeps
from bns.sweep.forecast.plan import plan
from bns.sweep.runner import run_sweep
from bns.tasks import task_names

HEAD = "name: demo\nrobot: khepera\n"


def sweep_of(tmp_path: Path, body: str, head: str = HEAD) -> Sweep:
    path = tmp_path / "x.yaml"
    path.write_text(head + body)
    return load_sweep(path)


def combos(sweep: Sweep) -> list[tuple]:
    return sorted(tuple(combo.items()) for combo in sweep.combos)


def test_grid_is_a_product_on_top_of_fixed(tmp_path):
    sweep = sweep_of(
        tmp_path, "seeds: 3\nfixed: {evaluations: 5}\ngrid: {mutation_rate: [0, 1e-2], population_size: [10, 20]}\n"
    )
    assert (sweep.name, sweep.robot, sweep.seeds, sweep.total) == ("demo", "khepera", 3, 12)
    assert combos(sweep) == [
        (("evaluations", 5), ("mutation_rate", rate), ("population_size", size))
        for rate in (0.0, 0.01)
        for size in (10, 20)
    ]


def test_fixed_alone_and_nothing_at_all_are_one_combination(tmp_path):
    assert sweep_of(tmp_path, "").combos == ({},)
    assert sweep_of(tmp_path, "fixed: {evaluations: 5}").combos == ({"evaluations": 5},)


def test_zip_goes_in_step_and_is_multiplied_with_the_grid(tmp_path):
    sweep = sweep_of(tmp_path, "grid: {evaluations: [1, 2]}\nzip: {mutation_rate: [0.1, 0.2], population_size: [8, 9]}")
    assert {(c["evaluations"], c["mutation_rate"], c["population_size"]) for c in sweep.combos} == {
        (1, 0.1, 8),
        (1, 0.2, 9),
        (2, 0.1, 8),
        (2, 0.2, 9),
    }


def test_exclude_matches_all_its_values_defaults_too_and_include_comes_after(tmp_path):
    sweep = sweep_of(
        tmp_path,
        """
fixed: {evaluations: 7}
grid: {mutation_rate: [0.1, 0.2], population_size: [8, 9]}
exclude:
  - {mutation_rate: 0.1, population_size: 8, world: substitute}
  - {mutation_rate: 0.1}
include:
  - {mutation_rate: 0.1, population_size: 8}
  - {evaluations: 9}
""",
    )
    assert {(c["evaluations"], c.get("mutation_rate"), c.get("population_size")) for c in sweep.combos} == {
        (7, 0.2, 8),
        (7, 0.2, 9),
        (7, 0.1, 8),
        (9, None, None),
    }


def test_include_without_a_grid_adds_nothing_else(tmp_path):
    sweep = sweep_of(tmp_path, "fixed: {evaluations: 7}\ninclude: [{population_size: 8}, {population_size: 9}]")
    assert [c["population_size"] for c in sweep.combos] == [8, 9]


def test_equal_combinations_are_one(tmp_path):
    sweep = sweep_of(
        tmp_path, "grid: {mutation_rate: [0.1, 0.2]}\ninclude: [{mutation_rate: 0.2, world: substitute}]"
    )
    assert sweep.combos == ({"mutation_rate": 0.1}, {"mutation_rate": 0.2})  # the order of runs goes by what is written


def test_the_last_seed_there_is_may_be_the_last_of_a_sweep(tmp_path):
    last = FIELDS["seed"].metadata["high"]
    assert sweep_of(tmp_path, f"seeds: 2\nfirst_seed: {last - 1}\n").all_seeds == range(last - 1, last + 1)
    with pytest.raises(SpecError, match=f"3 seeds from {last - 1} on go beyond the last seed, {last}"):
        sweep_of(tmp_path, f"seeds: 3\nfirst_seed: {last - 1}\n")


ERRORS = {
    "parameter": (
        "seeds: 2\ngrid:\n  population_size: [8]\n  mutation_rte: [0.1]\n",
        6,
        "unknown parameter 'mutation_rte'. Did you mean 'mutation_rate'? Valid: ",
    ),
    "key": ("sed: 2\n", 3, "unknown key 'sed'. Did you mean 'seeds'? Valid: exclude, first_seed, fixed, grid"),
    "parameter as key": ("mutation_rate: 0.1\n", 3, "it belongs under fixed or grid"),
    "seed": ("fixed: {seed: 3}\n", 3, "write 'seeds: 30'"),
    "robot": ("grid:\n  robot: [khepera]\n", 4, "one robot a sweep"),
    "range": (
        "grid:\n  mutation_rate:\n    - 0.1\n    - 40\n",
        6,
        "mutation_rate is 40.0; it must be a number from 0 to 1. For 40 percent write 0.4.",
    ),
    "type": ("fixed:\n  population_size: many\n", 4, "population_size is 'many'; it must be a whole number"),
    "quoted": (
        "fixed:\n  mutation_rate: '0.1'\n",
        4,
        "mutation_rate is '0.1'; it must be a number from 0 to 1. It is a text: write 0.1, without quotes.",
    ),
    "quoted seeds": ("seeds: '10'\n", 3, "how many, from first_seed on. It is a text: write 10, without quotes."),
    "value twice": (
        "grid:\n  evaluations:\n    - 1\n    - 2\n    - 1\n",
        7,
        "evaluations has the value 1 twice (first on line 5). Keep one of the two",
    ),
    "list in fixed": ("fixed:\n  mutation_rate: [0.1]\n", 4, "Lists belong under grid"),
    "value in grid": (
        "grid:\n  mutation_rate: 0.1\n",
        4,
        "must be a list, such as [1, 2], but this is the value '0.1'",
    ),
    "empty list": ("grid:\n  mutation_rate: []\n", 4, "is an empty list"),
    "empty grid": ("grid:\n", 3, "grid must be a mapping (lines of 'key: value'), but this is empty"),
    "twice": (
        "fixed: {evaluations: 1}\ngrid:\n  evaluations: [2]\n",
        5,
        "'evaluations' is given under grid and, on line 3, under fixed",
    ),
    "zip lengths": (
        "zip:\n  evaluations: [2]\n  population_size: [3, 4]\n",
        4,
        "evaluations has 1, population_size has 2",
    ),
    "duplicate key": ("fixed:\n  evaluations: 1\n  evaluations: 2\n", 5, "'evaluations' is already given on line 4"),
    "duplicate section": ("seeds: 1\nseeds: 2\n", 4, "'seeds' is already given on line 3"),
    "syntax": ("fixed: {evaluations: 1\ngrid: 2\n", 4, "not valid YAML"),
    "tab": ("fixed:\n\tevaluations: 1\n", 4, "not valid YAML"),
    "tag": ("fixed:\n  evaluations: !!python/object:os.system x\n", 4, "cannot be understood"),
    "task": ("grid:\n  task:\n  - circel\n", 5, "robot khepera: unknown task 'circel'. Did you mean 'circle'?"),
    "exclude nothing": ("grid: {evaluations: [1, 2]}\nexclude:\n  - {evaluations: 3}\n", 5, "matches no combination"),
    "exclude all": ("fixed: {evaluations: 1}\nexclude:\n  - {evaluations: 1}\n", 1, "leaves no combination"),
    "exclude empty": ("exclude:\n  - {}\n", 4, "would leave everything out"),
    "include unknown": ("include:\n  - {evaluation: 3}\n", 4, "Did you mean 'evaluations'?"),
    "seeds": ("seeds: 0\n", 3, "seeds is 0; it must be a whole number from 1"),
    "seeds true": ("seeds: yes\n", 3, "seeds is True"),
    "first seed": ("seeds: 1\nfirst_seed: -1\n", 4, "first_seed is -1; it must be a whole number from 0"),
    "first seed true": ("first_seed: true\n", 3, "first_seed is True"),
    "last seed": ("first_seed: 4294967290\nseeds: 10\n", 3, "10 seeds from 4294967290 on go beyond the last seed"),
    "anchor": ("base: &b {evaluations: 1}\n", 3, "unknown key 'base'"),
}


@pytest.mark.parametrize("case", ERRORS)
def test_mistake_is_answered_with_its_line(tmp_path, case):
    body, line, text = ERRORS[case]
    with pytest.raises(SpecError, match=re.escape(text)) as caught:
        sweep_of(tmp_path, body)
    assert str(caught.value).startswith(f"{tmp_path / 'x.yaml'}:{line}: ")


@pytest.mark.parametrize(
    ("head", "text"),
    [
        ("robot: khepera\n", ":1: the key 'name' is missing"),
        ("name: demo\n", ":1: the key 'robot' is missing"),
        ("name: demo\nrobot: kepera\n", ":2: unknown robot 'kepera'. Did you mean 'khepera'?"),
        ("name: 7up\nrobot: khepera\n", ":1: name is '7up'; it must begin with a letter"),
        ("name: 2024-01-01\nrobot: khepera\n", ":1: name is datetime.date"),
        ("", ":1: the file is empty"),
        ("- name\n", ":1: a sweep file must be a mapping"),
        ("name: demo\n---\nname: demo\n", ":2: not valid YAML"),
        ("name: \0\n", ":1: not valid YAML"),
    ],
)
def test_head_of_the_file(tmp_path, head, text):
    with pytest.raises(SpecError, match=re.escape(text)):
        sweep_of(tmp_path, "", head)


def test_files_that_cannot_be_read(tmp_path):
    with pytest.raises(SpecError, match=r"there is no sweep file .*nowhere\.yaml"):
        load_sweep(tmp_path / "nowhere.yaml")
    (tmp_path / "latin.yaml").write_bytes(b"name: \xe9\n")
    with pytest.raises(SpecError, match="is not UTF-8 text"):
        load_sweep(tmp_path / "latin.yaml")
    with pytest.raises(SpecError, match="cannot be read: Is a directory"):
        load_sweep(tmp_path)


def test_default_task_of_another_robot_is_refused(tmp_path, monkeypatch):
    monkeypatch.setattr("bns.sweep.expand.grid.task_names", lambda _robot: ("letter-s",))
    with pytest.raises(SpecError, match="no task is given, and robot 'khepera' has no task 'circle'"):
        sweep_of(tmp_path, "")
    assert sweep_of(tmp_path, "fixed: {task: letter-s}").combos == ({"task": "letter-s"},)


def test_every_task_of_the_robot_can_be_named(tmp_path):
    tasks = task_names("khepera")
    sweep = sweep_of(tmp_path, f"grid: {{task: [{', '.join(tasks)}]}}")
    assert tuple(combo["task"] for combo in sweep.combos) == tasks


def test_two_files_of_one_name_are_not_carried_out_together(tmp_path):
    files = [tmp_path / "one.yaml", tmp_path / "other.yaml"]
    for seeds, file in enumerate(files, start=1):
        file.write_text(f"name: both\nrobot: khepera\nseeds: {seeds}\n")
    with pytest.raises(SpecError, match=r"other\.yaml: the sweep is named both, like that of .*one\.yaml"):
        load_sweeps(files)
    files[1].write_text("name: other\nrobot: khepera\n")
    assert [sweep.name for sweep in load_sweeps(files)] == ["both", "other"]
    with pytest.raises(SpecError, match="named both"):
        load_sweeps([files[0], files[0]])


def test_a_world_that_is_no_file_is_named_with_its_line_once_a_run_needs_it(tmp_path):
    sweep = sweep_of(tmp_path, "fixed: {evaluations: 2}\ngrid:\n  world:\n    - physics\n    - nonexist.yaml\n")
    for use in (lambda: plan(sweep, tmp_path / "results", 1), lambda: run_sweep(sweep, tmp_path / "results", jobs=1)):
        with pytest.raises(ModelError, match=rf"^{sweep.path}:7: .*nonexist\.yaml"):
            use()
    assert not (tmp_path / "results").exists()


def test_values_under_zip_may_come_twice(tmp_path):
    sweep = sweep_of(tmp_path, "zip: {evaluations: [1, 1], population_size: [2, 3]}")
    assert [combo["population_size"] for combo in sweep.combos] == [2, 3]


def test_a_folder_is_no_sweep_and_no_misspelt_name_of_one(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "mine").mkdir()
    with pytest.raises(SpecError, match=r"mine is a folder; give the sweep file in it: mine/NAME\.yaml"):
        load_sweep("mine")
