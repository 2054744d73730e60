"""Findings about the snake: planted ones are found, contrary ones are not, and a sweep of two seeds shows its estimates."""

import itertools

import numpy as np
import pytest
from figure_helpers import with_evals, written

from analysis import checks, diversity_of_extremes, findings, fitness_error_by_diversity, influence, success_so_far
from analysis.results import NoDataError, Results
from analysis.scatter import combinations
from analysis.selection import selections
from bns.spec import RunSpec

EVALUATIONS = 21
RATES, SIZES = (0.1, 0.3, 0.5, 0.7, 0.9), (400, 200, 100, 50)
TEXT = f"""
name: planted
robot: snake
seeds: SEEDS
fixed: {{evaluations: {EVALUATIONS}}}
grid: {{task: [two-regions, three-regions], mutation_rate: {list(RATES)}, population_size: {list(SIZES)}}}
"""


def planted(task, number, seed, rate, size):
    """Combination ``number`` succeeds from evaluation 2 + number on; of two regions the last three of the twenty never do."""
    at = np.arange(1, EVALUATIONS + 1)
    success = (at > number + 1) & ((task == "three-regions") | (number < 17))
    trend = (1 if task == "three-regions" else -1) * 0.02 * at
    diversity = 1 + rate + np.log2(size / 50) / 10 + trend + 0.001 * seed
    spec = RunSpec(robot="snake", task=task, seed=seed, evaluations=EVALUATIONS, mutation_rate=rate, population_size=size)
    return with_evals(spec, success=success, success_7cm=None, success_10cm=None, success_14cm=None, success_20cm=None,
                      diversity=diversity, fitness_error=3 - np.log2(size / 50) + 0.01 * rate)  # fmt: skip


def made(place, seeds):
    cells = [(number, *cell) for number, cell in enumerate(itertools.product(RATES, SIZES))]
    runs = [
        planted(task, number, seed, rate, size)
        for task in ("two-regions", "three-regions")
        for number, rate, size in cells
        for seed in range(seeds)
    ]
    written(place, "planted", runs, sweep_text=TEXT.replace("SEEDS", str(seeds)), sweep_runs=len(runs))
    return Results(place)


@pytest.fixture(scope="module")
def store(tmp_path_factory):
    return made(tmp_path_factory.mktemp("planted"), 5)


def test_planted_findings_about_the_snake_are_found(store):
    table = findings.draw(store)[0].table
    found = {(row["where"], row["the dissertation"], row["task"][0]): row["verdict"] for _, row in table.iterrows()}
    assert found["figure 5.22", "success saturates at 80 to 90 %", "1"] == "agrees"
    for task in "12":
        assert found["figure 5.26", "fitness error falls with the population size", task] == "agrees"
        assert found["figure 5.26", "diversity grows with the population size", task] != "differs"
        assert found["figure 5.27", "diversity grows with the mutation rate", task] == "agrees"
        assert found["section 5.9.1", "population size matters most", task] == "differs"  # the mutation rate does
    assert found["figures 5.29 and 5.30", "diversity of the best falls from evaluation 5 on", "1"] == "agrees"
    assert found["figures 5.29 and 5.30", "diversity of the best grows from evaluation 5 on", "2"] == "agrees"


def test_the_contrary_of_what_is_planted_differs(store):
    chosen = selections(store)[0]
    two, three = (lambda check, **more: getattr(checks, check)(store, chosen, "two-regions", **more),
                  lambda check, **more: getattr(checks, check)(store, chosen, "three-regions", **more))  # fmt: skip
    assert three("saturates", range=[80, 90]).verdict == "differs"
    assert three("grows_evenly", since=2).verdict == "agrees"
    assert two("grows_evenly", since=15).verdict == "differs"  # from evaluation 18 on nothing is gained
    wrong = two("goes_with", parameter="population_size", measure="fitness_error", direction="grows")
    assert wrong.verdict == "differs"
    assert wrong.claim == "fitness error grows with the population size"
    assert two("diversity_of_best_moves", direction="grows", since=5).verdict == "differs"
    early = two("diversity_of_best_moves", direction="grows", since=21)
    assert (early.ours.split(",")[0], early.verdict) == ("too few evaluations: 21", "undecided")
    at_last = three("gap_at_the_end", parameter="mutation_rate", points=14.2)
    assert (at_last.ours, at_last.verdict) == ("0.0 (0.0 to 0.0) points at evaluation 21", "differs")
    assert two("gap_at_the_end", parameter="mutation_rate", points=75).verdict == "agrees"  # 4 of 4 against 1 of 4


def test_a_finished_sweep_of_two_seeds_has_its_dots_and_its_estimates_but_no_verdict_that_needs_seeds(tmp_path):
    store = made(tmp_path, 2)
    rows, thin = combinations(store, selections(store)[0])
    assert (len(rows), set(rows.runs), thin) == (40, {2}, 0)
    assert fitness_error_by_diversity.draw(store)[0].n == 80
    table = findings.draw(store)[0].table.set_index("the dissertation")
    assert not (table["where"] == "").any()
    assert "no bands: fewer than 5 seeds" in diversity_of_extremes.draw(store)[0].shows
    assert set(influence.draw(store)[0].table["loss of R²"]) == {"from 5 seeds on"}
    row = table.loc["success saturates at 80 to 90 %"]
    assert (row["these results"], row.verdict) == ("85 % at the last evaluation", "undecided")


def test_dots_of_a_sweep_that_asks_for_more_wait_for_five_runs(tmp_path):
    runs = [planted("two-regions", number, seed, rate, 50) for number, rate in enumerate(RATES) for seed in range(2)]
    written(tmp_path, "planted", runs, sweep_text=TEXT.replace("SEEDS", "30"), sweep_runs=1200)
    store = Results(tmp_path)
    with pytest.raises(NoDataError, match=r"no combination has 5 finished runs yet \(the most is 2\)"):
        combinations(store, selections(store)[0])


def test_success_so_far_counts_each_run_from_its_first_success_on(tmp_path):
    runs = []
    for seed, first in enumerate((2, 3, None)):
        now, ever = np.zeros(4, bool), np.zeros(4, bool)
        if first:
            now[first - 1], ever[first - 1 :] = True, True
        for rate in (0.1, 0.5):
            spec = RunSpec(robot="snake", task="two-regions", seed=seed, evaluations=4, mutation_rate=rate)
            runs.append(with_evals(spec, success=now, ever_success=ever))
    written(tmp_path, "planted", runs)
    rows = success_so_far.draw(Results(tmp_path))[0].data
    counts = {reading: own.successes.tolist() for reading, own in rows.groupby("reading")}
    assert counts == {"success": [0, 2, 2, 0], "ever_success": [0, 2, 4, 4]}
    assert set(rows.runs) == {6}
