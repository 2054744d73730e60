"""Approaches stand in one order and have one look, in every figure, whichever of them are there."""

import re
from itertools import combinations
from pathlib import Path

import numpy as np
import pytest

from analysis import approach_pairs, approach_summary, approaches
from analysis.approach_order import ORDER, in_order, looks
from analysis.results import Results
from bns.registry import APPROACHES
from bns.spec import RunSpec
from tests.analysis.figure_helpers import with_evals, written

PAGE = (Path(__file__).parents[2] / "docs" / "approaches.md").read_text()
SOME = ("transferability", "bns+noise=16", "anytime", "bns", "then-on-robot")
INNER = ["bns", "bns+noise=16", "then-on-robot", "anytime", "transferability"]


def test_the_order_is_that_of_the_page_and_every_approach_is_in_it():
    table = PAGE[PAGE.index("| name | after | here |") :]
    assert re.findall(r"^\| `([\w-]+)` \|", table[: table.index("\n\n")], flags=re.M) == list(ORDER)
    assert set(ORDER) >= set(APPROACHES.names())


def test_approaches_of_packages_come_last_and_options_after_none():
    given = ["zeta", "bns+b=1", "alpha+c=2", "on-robot", "bns+a=1", "alpha", "bns", "zeta"]
    assert in_order(given) == ["bns", "bns+a=1", "bns+b=1", "on-robot", "alpha", "alpha+c=2", "zeta"]


def test_no_two_look_alike_and_a_look_does_not_depend_on_who_else_is_there():
    every = looks([*ORDER, "bns+noise=16", "bns+margin=0.03", "alpha", "zeta"])
    seen = [(str(look["color"]), str(look["linestyle"])) for look in every.values()]
    assert len(set(seen)) == len(seen) == 12
    assert len({colour for colour, _ in seen}) == 9
    assert {every[name]["color"] for name in every if name.startswith("bns")} == {every["bns"]["color"]}
    for pair in combinations(ORDER, 2):
        assert looks(pair) == {name: every[name] for name in pair}


@pytest.fixture(scope="module")
def results(tmp_path_factory):
    """One sweep with five approaches, another with two of them, six seeds each."""
    folder = tmp_path_factory.mktemp("approaches")
    for sweep, names in (("many", SOME), ("few", ("transferability", "bns+noise=16"))):
        specs = [RunSpec(approach=name, seed=seed, evaluations=9) for seed in range(6) for name in names]
        success = np.arange(1, 10) > 4
        written(folder, sweep, [with_evals(spec, success=success, robot_s=60.0 * np.arange(1, 10)) for spec in specs])
    return Results(folder)


def test_every_figure_and_table_has_that_order(results):
    few, many = sorted(approaches.draw(results), key=lambda one: one.n)
    assert few.table.approach.tolist() == ["bns+noise=16", "transferability"]
    assert many.table.approach.tolist() == INNER
    legends = [[text.get_text() for text in one.figure.subfigs[0].legends[0].get_texts()] for one in (few, many)]
    assert legends == [["bns+noise=16", "transferability"], INNER]
    assert [one.data.approach.tolist() for one in sorted(approach_summary.draw(results), key=lambda one: one.n)] == legends
    pairs = max(approach_pairs.draw(results), key=lambda one: one.n)
    assert list(zip(pairs.data.one, pairs.data.other, strict=True)) == list(combinations(INNER, 2))
    labels = [text.get_text() for text in pairs.figure.axes[0].get_yticklabels()]
    assert labels == [f"{number} {name}" for number, name in enumerate(INNER, 1)]


def test_a_curve_has_the_same_colour_and_line_in_a_figure_that_lacks_others(results):
    few, many = (
        {line.get_label(): (line.get_color(), line.get_linestyle()) for line in one.figure.axes[0].get_lines()}
        for one in sorted(approaches.draw(results), key=lambda one: one.n)
    )
    assert few.items() <= many.items()
    assert many == {name: (look["color"], look["linestyle"]) for name, look in looks(SOME).items()}
