"""Small stores, made up and real, and a walk over everything that is written on a figure."""

from __future__ import annotations

import sys
from pathlib import Path

import pytest
from matplotlib.text import Text

TESTS = Path(__file__).parents[1]
sys.path[:0] = [str(path) for path in (TESTS.parent, TESTS, TESTS / "analysis") if str(path) not in sys.path]

from figure_helpers import MUTATION, carry_out  # noqa: E402  # found on the path set above

PROTOTYPE = """
name: prototype
robot: khepera
seeds: 2
fixed: {evaluations: 3, population_size: 8, generations_per_evaluation: 2, training_iterations_per_evaluation: 20,
        record: full}
grid: {task: [infinity]}
"""
BUDGET = """
name: budget
robot: khepera
seeds: 2
fixed: {evaluations: 3, population_size: 8}
grid: {generations_per_evaluation: [1, 3], training_iterations_per_evaluation: [10, 20]}
"""


@pytest.fixture(scope="session")
def real_results(tmp_path_factory) -> Path:
    """A finished mutation sweep of 20 runs, one of 2 with paths, and 7 of 8 runs of a budget sweep."""
    results = tmp_path_factory.mktemp("results")
    carry_out(results, MUTATION)
    carry_out(results, PROTOTYPE)
    carry_out(results, BUDGET, slice(7))
    return results


@pytest.fixture
def texts():
    """Function: figure -> (text, size in points) of all that is visibly written on it."""
    from bns.plotting.style import style

    def walk(figure) -> list[tuple[str, float]]:
        with style():
            figure.draw_without_rendering()
        return [
            (one.get_text(), one.get_fontsize())
            for one in figure.findobj(Text)
            if one.get_visible() and one.get_text().strip()
        ]

    return walk


@pytest.fixture(scope="session")
def study(tmp_path_factory) -> Path:
    """A made-up study: two tasks, 20 combinations of three parameters, eight seeds, ten evaluations, planted effects."""
    from study import make_study

    results = tmp_path_factory.mktemp("study")
    fixed = {"tournament_size": (0.1, 0.5), "population_size": (50, 400), "real_world_selection_size": 0.7}
    make_study(results, seeds=8, tasks=("circle", "infinity"), evaluations=10, **fixed)
    return results
