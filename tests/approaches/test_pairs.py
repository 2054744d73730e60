"""Approaches two by two, against SciPy and by hand."""

from dataclasses import replace

import numpy as np
import pandas as pd
import pytest
from scipy.stats import mannwhitneyu

from analysis import approach_pairs, approach_summary, approaches
from analysis.approach_pairs import compared, improvement, pairs, scores
from analysis.intervals import bootstrap, wilson
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
    runs = pd.DataFrame(rows, columns=["approach", "seed", "late"]).assign(task="t", minutes=-1.0, setting=0)
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


def runs_at_rates(seeds, rates=(0.1, 0.3), names=("bns", "on-robot"), begins=None):
    """Runs of approaches at each mutation rate; ``begins``: the evaluation that a (name, rate) succeeds from, else never."""
    runs = []
    for seed in seeds:
        for name in names:
            for rate in rates:
                success = np.arange(1, 10) >= (begins or {}).get((name, rate), 99)
                spec = RunSpec(approach=name, seed=seed, evaluations=9, mutation_rate=rate)
                runs.append(with_evals(spec, success=success, success_7cm=success, robot_s=60.0 * np.arange(1, 10)))
    return runs


ALL_FIGURES = (approaches, approach_summary, approach_pairs)


@pytest.mark.parametrize("archived", [False, True])
def test_approaches_by_another_parameter_are_compared_whatever_the_sweep_is_called(tmp_path, archived):
    written(tmp_path / "results", "mixed", runs_at_rates(range(6), begins={("bns", 0.1): 1, ("bns", 0.3): 1}))
    place = archive(tmp_path / "results", tmp_path / "mixed.parquet").path if archived else tmp_path / "results"
    for module in ALL_FIGURES:
        (drawn,) = module.draw(Results(place, archived=archived))
        assert drawn.n == 24
        assert "Pooled over mutation rate (10 %, 30 %): each approach with the same combinations and seeds." in drawn.shows
    assert drawn.data.iloc[0][["one", "other", "runs", "late_probability"]].tolist() == ["bns", "on-robot", 12, 1.0]


def test_only_combinations_and_seeds_that_every_approach_has_are_pooled(tmp_path):
    written(tmp_path, "mixed", runs_at_rates(range(6)))
    written(tmp_path, "mixed", runs_at_rates(range(6, 9), rates=(0.1,), names=("bns",)))
    written(tmp_path, "mixed", runs_at_rates(range(6), rates=(0.5,), names=("bns",)))
    for module in ALL_FIGURES:
        (drawn,) = module.draw(Results(tmp_path))
        assert drawn.n == 24
        assert "(10 %, 30 %)" in drawn.shows


@pytest.mark.parametrize("archived", [False, True])
def test_a_run_that_differs_in_what_it_records_alone_counts_once(tmp_path, archived):
    made = runs_at_rates(range(6), begins={("bns", 0.1): 1, ("bns", 0.3): 1})
    again = [with_evals(replace(run.spec, record="paths"), **run.tables["evals"]) for run in made if run.spec.approach == "bns"]
    written(tmp_path / "results", "mixed", [*made, *again])
    place = archive(tmp_path / "results", tmp_path / "mixed.parquet").path if archived else tmp_path / "results"
    for module in ALL_FIGURES:
        (drawn,) = module.draw(Results(place, archived=archived))
        assert drawn.n == 24


def test_approaches_that_share_no_other_parameter_are_not_compared_and_the_parameter_is_named(tmp_path):
    written(tmp_path, "mixed", runs_at_rates(range(6), rates=(0.1,), names=("bns",)))
    written(tmp_path, "mixed", runs_at_rates(range(6), rates=(0.3,), names=("on-robot",)))
    for module in (approaches, approach_summary):
        with pytest.raises(NoDataError, match="no seed has a run of every approach with the same mutation rate; "):
            module.draw(Results(tmp_path))
    with pytest.raises(NoDataError, match="5 runs each on the same task and seeds, with every mutation rate; "):
        approach_pairs.draw(Results(tmp_path))


def test_approaches_on_different_tasks_are_not_compared(tmp_path):
    made = [with_evals(RunSpec(approach="bns", task="circle", evaluations=3))]
    made += [with_evals(RunSpec(approach="on-robot", task="infinity", evaluations=3))]
    written(tmp_path, "mixed", made)
    with pytest.raises(NoDataError, match="no sweep has runs of two approaches on the same robot, task and world"):
        approaches.draw(Results(tmp_path))


def test_pooled_runs_of_a_seed_are_one_draw(tmp_path):
    # At both rates bns succeeds on seeds 0 to 3 of 8: eight runs of 16, but the luck of eight seeds alone.
    made = runs_at_rates(range(4), begins={("bns", 0.1): 1, ("bns", 0.3): 1}) + runs_at_rates(range(4, 8))
    written(tmp_path, "mixed", made)
    (drawn,) = approaches.draw(Results(tmp_path))
    bns = drawn.table.set_index("approach").loc["bns"]
    low, high = bootstrap(np.repeat([2.0, 0.0], 4), np.full(8, 2.0))
    assert (bns["low (%)"], bns["high (%)"]) == (round(100 * float(low)), round(100 * float(high)))
    assert float(wilson(8, 16)[0]) > float(low)
    assert "bootstrap intervals over seeds" in drawn.shows


def test_seeds_are_exchanged_together_at_all_settings():
    one, other = np.arange(6.0) + 10, np.arange(6.0)
    alone = compared({"t": (one, other)})
    assert compared({"t": (np.stack([one] * 3), np.stack([other] * 3))}) == pytest.approx(alone)
    assert compared(dict.fromkeys("abc", (one, other)))["p"] < alone["p"]  # other tasks are independent
