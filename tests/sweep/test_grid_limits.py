"""Sweep files that are too large, too odd or not to be run as a whole: an explanation, not a traceback."""

import itertools
import re
from pathlib import Path

import pytest

from bns.cli.main import SWEEP_OF_SINGLE_RUNS
from bns.errors import SpecError
from bns.sweep.expand.combos import MOST_RUNS
from bns.sweep.expand.grid import Sweep, load_sweep

HEAD = "name: demo\nrobot: khepera\n"


def sweep_of(tmp_path: Path, body: str, head: str = HEAD) -> Sweep:
    path = tmp_path / "x.yaml"
    path.write_text(head + body)
    return load_sweep(path)


def refused(tmp_path: Path, line: int, text: str, body: str, head: str = HEAD) -> None:
    with pytest.raises(SpecError, match=re.escape(text)) as caught:
        sweep_of(tmp_path, body, head)
    assert str(caught.value).startswith(f"{tmp_path / 'x.yaml'}:{line}: ")


def test_more_seeds_than_anybody_can_run_are_refused(tmp_path):
    refused(tmp_path, 3, "this makes 4294967296 runs, and a sweep may have 10000000 at most", "seeds: 4294967296\n")
    refused(tmp_path, 4, "this makes 10000002 runs", "grid: {task: [circle, complex]}\nseeds: 5000001\n")
    assert sweep_of(tmp_path, "grid: {task: [circle, complex]}\nseeds: 5000000\n").total == MOST_RUNS


def test_product_that_would_fill_the_memory_is_refused_before_it_is_laid_out(tmp_path):
    many = ", ".join(map(str, range(2, 1002)))
    names = "evaluations", "population_size", "generations_per_evaluation", "training_iterations_per_evaluation"
    grid = "grid:\n" + "".join(f"  {name}: [{many}]\n" for name in names[:3])
    refused(tmp_path, 4, "this makes 1000000000 runs", grid)
    refused(tmp_path, 4, "this makes 1000000000000 runs", f"{grid}zip:\n  {names[3]}: [{many}]\n")


ODD = ('!!int ""', "!!int foo", "!!bool foo", "!!timestamp foo", '!!float ""', "!!float " + "9:" * 200 + "9")
NO_DATA = ("!!set foo", "!!binary ä", "{[1]: 2}", "&a [*a]")


@pytest.mark.parametrize("value", ODD + NO_DATA)
def test_odd_yaml_is_answered_with_its_line(tmp_path, value):
    refused(tmp_path, 4, "cannot be understood: ", f"fixed:\n  evaluations: {value}\n")
    refused(tmp_path, 1, "cannot be understood: ", "robot: khepera\n", f"name: {value}\n")


def test_brackets_without_end_are_answered_with_their_line(tmp_path):
    for deep in "[" * 3000 + "]" * 3000, "[" * 3000, "{a: " * 3000:
        refused(tmp_path, 4, "nested too deeply", f"fixed:\n  evaluations: {deep}\n")


@pytest.mark.parametrize(
    ("body", "line"),
    [
        ("fixed:\n  evaluations: 1\n  min_commands: 101\n", 5),  # against the default of the other
        ("fixed: {min_commands: 5}\ngrid:\n  task: [circle]\n  max_commands: [7, 5, 3]\n", 3),
        ("grid:\n  max_commands: [50, 60]\n  min_commands: [4, 55]\n", 4),
        ("zip:\n  min_commands: [1, 9]\n  max_commands: [2, 8]\n", 4),
        ("include:\n  - {max_commands: 9}\n  - {evaluations: 2,\n     max_commands: 3}\n", 5),
    ],
)
def test_combination_that_cannot_be_run_is_found_when_the_file_is_read(tmp_path, body, line):
    refused(tmp_path, line, "a combination cannot be run: min_commands is ", body)


def test_combination_that_cannot_be_run_may_be_excluded(tmp_path):
    grid = "grid: {max_commands: [50, 60], min_commands: [4, 55]}\n"
    sweep = sweep_of(tmp_path, grid + "exclude:\n  - {max_commands: 50, min_commands: 55}\n")
    assert {(c["min_commands"], c["max_commands"]) for c in sweep.combos} == {(4, 50), (4, 60), (55, 60)}


def test_names_are_short_and_not_that_of_the_single_runs(tmp_path):
    for name, text in {
        "n" * 300: "name has 300 characters; it may have 80 at most",
        "n" * 81: "name has 81 characters",
        SWEEP_OF_SINGLE_RUNS: "the name 'by-hand' is kept for the single runs of 'bns run'",
    }.items():
        refused(tmp_path, 2, text, "", f"robot: khepera\nname: {name}\n")
    assert sweep_of(tmp_path, "", f"robot: khepera\nname: {'n' * 80}\n").name == "n" * 80


def test_aliases_that_stand_for_millions_are_refused(tmp_path):
    names = "abcdefghi"
    lines = [f"{after}: &{after} [{','.join([f'*{before}'] * 9)}]" for before, after in itertools.pairwise(names)]
    bomb = "\n".join(["a: &a [1,1,1,1,1,1,1,1,1]", *lines])
    with pytest.raises(SpecError, match="keys and values with all aliases; 50000 are allowed"):
        sweep_of(tmp_path, f"{bomb}\n")
