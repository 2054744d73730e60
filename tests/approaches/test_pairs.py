"""Approaches two by two, against SciPy and by hand."""

import numpy as np
import pandas as pd
import pytest
from scipy.stats import mannwhitneyu

from analysis import approach_pairs, approach_summary, approaches
from analysis.approach_pairs import compared, improvement, pairs, scores
from analysis.results import NoDataError, Results
from bns.spec import RunSpec
from bns.store.archive.write import archive
from tests.analysis.figure_helpers import with_evals, written


def test_the_probability_of_improvement_is_the_statistic_of_mann_and_whitney():
    random = np.random.default_rng(3)
    one, other = random.integers(0, 5, 9).astype(float), random.integers(0, 5, 7).astype(float)
    assert improvement(one, other) == pytest.approx(mannwhitneyu(one, other).statistic / 63)
    assert improvement(np.array([-np.inf]), np.array([-np.inf])) == 0.5


def test_what_is_always_better_is_certain_and_what_is_alike_is_not():
    seeds = np.arange(10.0)
    better = compared({"a": (seeds + 10, seeds), "b": (seeds + 10, seeds)})
    assert better["probability"] == better["low"] == better["high"] == 1
    assert better["p"] < 0.001
    alike = compared({"a": (seeds, seeds), "b": (seeds, seeds)})
    assert (alike["probability"], alike["p"]) == (0.5, 1.0)
    assert alike["low"] < 0.4
    assert alike["high"] > 0.6


def test_tasks_count_alike_whatever_their_runs():
    few, many = (np.ones(2), np.zeros(2)), (np.zeros(30), np.ones(30))
    assert compared({"a": few, "b": many})["probability"] == 0.5


def test_chance_is_called_certain_as_often_as_the_level_says():
    """The two-sided test on pairs of runs that differ by luck alone, seeds shared."""
    random = np.random.default_rng(5)
    p = []
    for _ in range(200):
        luck = random.normal(size=8)
        p.append(compared({"a": (luck + random.normal(size=8), luck + random.normal(size=8))})["p"])
    assert 0.01 < np.mean(np.array(p) < 0.05) < 0.1


def test_a_run_scores_its_late_successes_and_when_success_began_to_last():
    runs = pd.DataFrame({"run_id": ["b", "a"], "success_late": [0.25, 0.5]})
    rows = pd.DataFrame({"run_id": ["a"] * 6 + ["b"] * 6, "robot_s": 60.0 * np.tile(range(1, 7), 2)})
    rows["success"] = [False, True, True, True, False, True, *[False] * 6]
    assert scores(runs, rows)[["late", "minutes"]].to_numpy().tolist() == [[0.25, -np.inf], [0.5, -2.0]]


def test_only_seeds_that_both_have_are_compared_and_five_are_needed():
    seeds = {"a": range(6), "b": range(1, 6), "c": range(1, 5)}
    rows = [(name, seed, seed + (name == "b")) for name, own in seeds.items() for seed in own]
    runs = pd.DataFrame(rows, columns=["approach", "seed", "late"]).assign(task="t", minutes=-1.0)
    table = pairs(runs)
    assert table[["one", "other", "runs"]].to_numpy().tolist() == [["a", "b", 5]]
    assert pairs(runs[runs.seed < 4]).empty


@pytest.fixture
def store(tmp_path):
    """Two approaches, six seeds: one succeeds from the third evaluation on, the other never."""
    runs = []
    for seed in range(6):
        for name, begins, seconds in (("bns", 3, 61.25), ("on-robot", 99, 50.0)):
            spec = RunSpec(approach=name, seed=seed, evaluations=9)
            success = np.arange(1, 10) >= begins
            runs.append(with_evals(spec, success=success, robot_s=seconds * np.arange(1, 10)))
    written(tmp_path / "results", "approaches-two", runs)
    return tmp_path / "results"


def test_an_approach_that_succeeds_beats_one_that_does_not_in_runs_and_in_their_archive(store, tmp_path):
    path = archive(store, tmp_path / "two.parquet").path
    for results in (Results(store), Results(path, archived=True)):
        (drawn,) = approach_pairs.draw(results)
        row = drawn.data.iloc[0]
        assert (row.one, row.other, row.late_probability, row.minutes_probability) == ("bns", "on-robot", 1.0, 1.0)
        (curves,) = approaches.draw(results)
        table = curves.table.set_index("approach")
        assert "mean minutes until it, within 8" in table
        assert table["success in the last 5 evaluations (%)"].tolist() == [100, 0]
        assert table.filter(like="mean minutes").iloc[:, 0].tolist() == ["3.1 (3.1 to 3.1)", "7.5 (7.5 to 7.5)"]
        assert table["robot minutes of a run"].tolist() == [9.2, 7.5]
        assert table["CPU seconds of a run, median"].tolist() == [1.2, 1.2]


def test_few_runs_are_drawn_by_time_and_not_compared(store):
    results = Results(store)
    results.keep("few", "SELECT * FROM runs WHERE seed < 3")
    results.query("CREATE OR REPLACE TEMP VIEW runs AS SELECT * FROM few")
    with pytest.raises(NoDataError, match="no two approaches have 5 runs each"):
        approach_pairs.draw(results)


def test_the_table_counts_tasks_and_seeds_that_every_approach_has(store, tmp_path):
    written(store, "approaches-two", [with_evals(RunSpec(approach="bns", seed=9, evaluations=9), success=np.zeros(9, bool))])
    path = archive(store, tmp_path / "two.parquet").path
    for results in (Results(store), Results(path, archived=True)):
        (drawn,) = approach_summary.draw(results)
        first, second = drawn.data.to_dict("records")
        assert (first["approach"], first["runs"], first["seeds"]) == ("bns", 6, 6)
        assert (first["success_late"], first["success_late_low"], first["success_early"]) == (100, 100, pytest.approx(100 / 3))
        assert (second["success_late"], second["robot_min"], second["cpu_s"]) == (0, 7.5, 1.25)
        assert drawn.table.iloc[0]["within 7 cm, late"] == "100 % (100–100)"
        assert "n = 12 runs" in drawn.shows


def test_a_stopped_sweep_without_a_whole_seed_has_no_table(tmp_path):
    runs = [with_evals(RunSpec(approach=name, seed=seed, evaluations=3)) for seed, name in enumerate(("bns", "on-robot"))]
    written(tmp_path, "approaches-two", runs)
    with pytest.raises(NoDataError, match="no seed has a run of every approach"):
        approach_summary.draw(Results(tmp_path))
    with pytest.raises(NoDataError, match="no two approaches have 5 runs each"):
        approach_pairs.draw(Results(tmp_path))
    with pytest.raises(NoDataError, match="no sweep has runs of two approaches"):
        approach_summary.draw(of_one(tmp_path / "one"))


def of_one(results):
    written(results, "approaches-one", [with_evals(RunSpec(seed=seed, evaluations=3)) for seed in range(2)])
    return Results(results)
