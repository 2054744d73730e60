"""Best and worst combinations: how they are ranked, what is drawn of them, what fresh seeds say."""

from __future__ import annotations

import re
import shutil
from types import SimpleNamespace

import numpy as np
import pandas as pd
import pytest
from figure_helpers import MUTATION, carry_out, curves, with_evals, written

from analysis import best_combinations, diversity_of_extremes, potential_success
from analysis.checks import best_combination, success
from analysis.curves import _largest_gap
from analysis.labels import CELL
from analysis.ranking import extremes, in_words, ranking
from analysis.results import NoDataError, Results
from analysis.selection import selections
from bns.spec import RunSpec
from bns.store import load
from bns.sweep.confirm import confirmation
from bns.sweep.expand.grid import parse_sweep

ROUNDED = 5.1e-4
"""Figures take diversity and fitness to 0.001, as an archive keeps them."""

NEAR = {f"success_{cm}cm": False for cm in (7, 10, 14, 20)}


def rated(rate: float, seeds: int = 5, sweep_seed: int = 0, good: int = 0, **columns) -> list:
    """``seeds`` runs of six evaluations at a mutation rate; the first ``good`` succeed."""
    specs = [RunSpec(seed=sweep_seed + seed, evaluations=6, mutation_rate=rate) for seed in range(seeds)]
    return [
        with_evals(spec, **{**NEAR, "success": number < good, "success_7cm": number < good, **columns})
        for number, spec in enumerate(specs)
    ]


def test_ties_are_broken_at_wider_radii_then_by_fitness_in_the_world(tmp_path):
    planted = {
        0.1: {"good": 3},
        0.2: {"good": 3, "success_10cm": True},
        0.3: {"good": 4},
        0.4: {"fitness_world": 0.5},
        0.5: {"fitness_world": 0.7},
        0.6: {"success_20cm": True, "fitness_world": 0.0},
    }
    written(tmp_path, "grid", [run for rate, columns in planted.items() for run in rated(rate, **columns)])
    store = Results(tmp_path)
    rows = ranking(store, selections(store)[0])
    assert rows.mutation_rate.tolist() == [0.3, 0.2, 0.1, 0.6, 0.5, 0.4]
    best, worst = extremes(rows, "circle")
    assert (best.mutation_rate.tolist(), worst.mutation_rate.tolist()) == ([0.3, 0.2, 0.1], [0.6, 0.5, 0.4])
    assert in_words(rows.iloc[0]) == "population 400, tournament 50 %, mutation 30 %, real-world selection 70 %"
    with pytest.raises(NoDataError, match="best and worst need two"):
        extremes(rows.head(1), "circle")


def test_diversity_of_the_best_is_what_pandas_computes(study):
    store = Results(study)
    best, worst = extremes(ranking(store, selections(store)[0]), "circle")
    drawn = next(one for one in diversity_of_extremes.draw(store) if one.name.endswith("circle"))
    evals = load(study, "evals", where={"task": "circle"}).query("evaluation >= 5")
    for number, cells in enumerate((best, worst)):
        own = evals.merge(cells[list(CELL)], on=list(CELL))
        x, y = curves(drawn.figure, number)["their mean"]
        means = own.groupby("evaluation").diversity.mean()
        assert list(x) == means.index.tolist() == [5, 6, 7, 8, 9, 10]
        assert y == pytest.approx(means.to_numpy(), abs=ROUNDED)
    assert drawn.n == 160
    planted_low, planted_high = drawn.data[drawn.data.evaluation == 10].diversity
    assert planted_low < planted_high  # diversity was planted to follow the mutation rate, success to fall with it


def test_potential_success_is_what_pandas_counts(study):
    store = Results(study)
    best, _ = extremes(ranking(store, selections(store)[0]), "infinity")
    drawn = potential_success.draw(store)[0]
    own = load(study, "evals", where={"task": "infinity"}).merge(best[list(CELL)], on=list(CELL))
    place = next(number for number, ax in enumerate(drawn.figure.axes) if "infinity sign" in ax.get_title())
    x, y = curves(drawn.figure, place)["all of them"]
    assert y == pytest.approx(100 * own.groupby("evaluation").success_20cm.mean().to_numpy(float))
    half = list(x)[int(np.argmax(y >= 50))]
    assert f"infinity sign: half of the runs by evaluation {half}." in drawn.see
    thin = [line.get_ydata() for line in drawn.figure.axes[place].get_lines() if line.get_label() == "_each"]
    first = own[(own[list(CELL)] == best[list(CELL)].iloc[0]).all(axis=1)]
    assert len(thin) == len(best)
    assert thin[0] == pytest.approx(100 * first.groupby("evaluation").success_20cm.mean().to_numpy(float))


def test_confirmed_shares_are_of_fresh_seeds_alone_and_stand_beside_the_swept(tmp_path):
    written(tmp_path, "grid", [*rated(0.1, good=5), *rated(0.5, good=1)])
    fresh = rated(0.1, seeds=8, sweep_seed=100, good=2)
    written(tmp_path, "grid-confirm", [*rated(0.1, good=5), *fresh])  # five of them picked the winner
    drawn = best_combinations.draw(Results(tmp_path))[0]
    first = drawn.data.iloc[0]
    assert (first.successes, first.runs, first.confirm_successes, first.confirm_runs) == (5, 5, 2, 8)
    lines = curves(drawn.figure)
    assert lines["as swept"][0].tolist() == [100, 20]
    assert lines["confirmed on fresh seeds"][0].tolist() == [25]
    assert "100 % as swept and 25 % on fresh seeds" in drawn.see
    assert "8 runs on fresh seeds" in drawn.shows
    assert not any("confirm" in text for text in drawn.missing)
    store = Results(tmp_path)
    said = best_combination(store, selections(store)[0], "circle", "success", 76)
    assert said.ours.startswith("25 (7 to 59) % of 8 runs on fresh seeds, the best of 1 that were rerun")
    assert said.verdict == "differs"
    wide = best_combination(store, selections(store)[0], "circle", "success_20cm", 25)
    assert "8 runs on fresh seeds" in wide.ours


def test_of_as_many_runs_as_the_dissertation_has_the_best_is_taken_as_swept(tmp_path, monkeypatch):
    """Both are the luckiest of as many; the spread is that of the best share over bootstrap samples of the seeds."""
    rates = [0.1, 0.3, 0.5, 0.7, 0.9]
    written(tmp_path, "grid", [one for n, rate in enumerate(rates) for one in rated(rate, seeds=30, good=(18, 21, 20, 3, 19)[n])])
    written(tmp_path, "grid-confirm", rated(0.3, seeds=40, sweep_seed=100, good=12))
    store = Results(tmp_path)
    said = best_combination(store, selections(store)[0], "circle", "success", 76)
    assert said.ours.startswith("30 (18 to 45) % of 40 runs on fresh seeds")  # five combinations are not five hundred
    monkeypatch.setattr(success, "COMBINATIONS", 5)
    said = best_combination(store, selections(store)[0], "circle", "success", 76)
    assert re.fullmatch(
        r"70 \(\d+ to \d+\) % of 30 runs, the best of 5 as swept; the same combination on fresh seeds 30 % of 40", said.ours
    )
    low, high = map(int, re.findall(r"\d+", said.ours)[1:3])
    # all combinations succeed on the first seeds here, so the best share scatters as one of 30 runs: 1.96 x 8.4 points
    assert (low, high) == pytest.approx((53.6, 86.4), abs=1.5)
    assert said.verdict == "undecided"
    assert best_combination(store, selections(store)[0], "circle", "success", 37).verdict == "differs"


def test_a_confirming_sweep_is_not_pooled_with_what_it_confirms(tmp_path):
    written(tmp_path, "grid", [*rated(0.1, good=5), *rated(0.5, good=1)])
    written(tmp_path, "grid-confirm", [*rated(0.1, sweep_seed=100), *rated(0.5, sweep_seed=100)])
    store = Results(tmp_path)
    assert selections(store)[0].sweeps == ("grid",)
    assert ranking(store, selections(store)[0]).runs.tolist() == [5, 5]


def test_who_cannot_be_told_from_the_best_is_corrected_for_many_comparisons(tmp_path):
    rates = [round(0.1 + 0.05 * number, 2) for number in range(8)]
    runs = [run for rate in rates[1:] for run in rated(rate, seeds=10, good=5)]
    written(tmp_path, "grid", [*rated(0.1, seeds=10, good=10), *runs])
    drawn = best_combinations.draw(Results(tmp_path))[0]
    # Fisher's test of 10 of 10 against 5 of 10 gives 0.033: below 0.05 alone, not among seven.
    assert "7 of the 7 others cannot be distinguished from it" in drawn.see
    assert any("bns sweep grid.yaml --confirm-top 10" in text for text in drawn.missing)


def test_more_equals_of_the_best_than_are_shown_are_counted_and_the_title_is_whole(tmp_path, texts):
    rates = [round(0.1 + 0.05 * number, 2) for number in range(13)]
    written(tmp_path, "grid", [one for rate in rates for one in rated(rate, good=5 if rate < 0.7 else 4)])
    drawn = best_combinations.draw(Results(tmp_path))[0]
    assert "12 combinations tie at 100 %" in drawn.see
    said = " ".join(text.replace("\n", " ") for text, _ in texts(drawn.figure))
    assert "12 combinations tie at 100 %, in the order of wider goal radii and mean fitness" in said
    drawn.figure.draw_without_rendering()
    title, page = drawn.figure.legends[0].get_title(), drawn.figure.bbox
    assert title.get_text().endswith("the 10 best of 13 combinations")
    assert page.x0 <= title.get_window_extent().x0 < title.get_window_extent().x1 <= page.x1


def test_no_more_equals_than_are_shown_need_no_word(tmp_path):
    written(tmp_path, "grid", [*rated(0.1, good=5), *rated(0.5, good=5)])
    assert "tie" not in best_combinations.draw(Results(tmp_path))[0].see


def test_a_shipped_sweep_is_named_as_the_command_takes_it(tmp_path):
    written(tmp_path, "khepera", [*rated(0.1, seeds=10, good=5), *rated(0.3, seeds=10, good=9)])
    drawn = best_combinations.draw(Results(tmp_path))[0]
    assert any("bns sweep khepera --confirm-top 10" in text for text in drawn.missing)


def test_curves_that_lie_on_each_other_differ_nowhere():
    values = [{"evaluation": e, "value": v, "successes": 1, "runs": 2, "task": "circle"} for e in (1, 2) for v in (0.1, 0.9)]
    chosen = SimpleNamespace(robot="khepera")
    assert _largest_gap(pd.DataFrame(values), chosen, "mutation_rate").endswith(": no difference at any evaluation.")
    values[0]["successes"] = 2
    apart = _largest_gap(pd.DataFrame(values), chosen, "mutation_rate")
    assert "widest at evaluation 1, 50 points between 10 % and 90 %" in apart


def test_what_the_sweep_command_confirms_is_what_stands_first(real_results, tmp_path):
    results = tmp_path / "results"
    shutil.copytree(real_results, results)
    sweep = parse_sweep(MUTATION, tmp_path / "mutation.yaml")
    again = confirmation(sweep, results, top=1)
    carry_out(results, again.text)
    for drawn in best_combinations.draw(Results(results)):
        assert drawn.data.confirm_runs.tolist() == [5, 0]
        assert drawn.n == 15


def test_the_best_counts_as_that_of_a_whole_study_only_if_every_combination_has_its_runs(tmp_path, monkeypatch):
    monkeypatch.setattr(success, "COMBINATIONS", 2)
    written(tmp_path, "grid", [*rated(0.1, seeds=7, good=6), *rated(0.5, seeds=5, good=1)])
    store = Results(tmp_path)
    for runs, words in ((5, "7 runs, the best of 2 as swept"), (6, "7 runs, as swept")):
        monkeypatch.setattr(success, "RUNS", runs)
        said = best_combination(store, selections(store)[0], "circle", "success", 76)
        assert said.ours.startswith("86")
        assert said.ours.endswith(words)
