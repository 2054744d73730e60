"""The statistics against independent routines, and against effects that were planted."""

from __future__ import annotations

import itertools

import numpy as np
import pandas as pd
import pytest
from statsmodels.formula.api import ols
from statsmodels.stats.anova import anova_lm
from statsmodels.stats.multitest import multipletests

from analysis import importance, influence
from analysis.importance import at_the_end, chance, permutation_importances, sums_of_squares, variance_shares
from analysis.intervals import band, bootstrap, mean_interval, ratios, resampled
from analysis.labels import CELL
from analysis.multiple_tests import holm
from analysis.results import Results
from analysis.selection import selections
from analysis.trials import first_in_a_row
from analysis.verdicts import AGREES, DIFFERS, UNDECIDED, likely, near, within

NAN = float("nan")


def grid(**values) -> pd.DataFrame:
    rows = [dict(zip(values, one, strict=True)) for one in itertools.product(*values.values())]
    return pd.DataFrame(rows)


def test_type_ii_sums_of_squares_agree_with_statsmodels_on_a_grid_with_holes():
    random = np.random.default_rng(3)
    cells = grid(a=[1, 2, 3, 4], b=[0.1, 0.5, 0.9], c=[0, 1]).drop(index=[0, 5, 6, 17]).reset_index(drop=True)
    rates = 0.1 * cells.a + 0.3 * (cells.b == 0.5) + random.random(len(cells))
    effects, total = sums_of_squares(cells, rates.to_numpy(), ["a", "b", "c"])
    theirs = anova_lm(ols("y ~ C(a) + C(b) + C(c)", cells.assign(y=rates)).fit(), typ=2)
    assert effects == pytest.approx(theirs.sum_sq[["C(a)", "C(b)", "C(c)"]].to_numpy())
    assert total == pytest.approx(((rates - rates.mean()) ** 2).sum())


def test_many_samples_at_once_give_what_each_gives_alone():
    cells, rates = grid(a=[1, 2], b=[1, 2, 3]), np.random.default_rng(1).random((5, 6))
    effects, total = sums_of_squares(cells, rates, ["a", "b"])
    for number, one in enumerate(rates):
        alone = sums_of_squares(cells, one, ["a", "b"])
        assert (effects[number], total[number]) == (pytest.approx(alone[0]), pytest.approx(alone[1]))


def runs(cells: pd.DataFrame, rate, seeds: int) -> tuple[np.ndarray, np.ndarray]:
    luck = np.random.default_rng(11).random((seeds, len(cells)))
    return (luck < np.asarray(rate)).astype(float), np.ones((seeds, len(cells)))


def test_shares_of_variance_are_those_of_the_true_rates_and_chance_is_taken_off():
    cells = grid(mutation_rate=[0.1, 0.3, 0.5], population_size=[50, 100, 200], tournament_size=[0.1, 0.2, 0.5])
    truth = 0.2 + 0.6 * (cells.mutation_rate - 0.1) / 0.4 + 0.1 * (cells.population_size == 200)
    names = list(cells)
    exact = sums_of_squares(cells, truth.to_numpy(), names)
    whole, low, high = variance_shares(cells, *runs(cells, truth, 40), names)
    assert whole == pytest.approx(exact[0] / exact[1], abs=0.06)
    assert (low <= whole + 1e-9).all()
    assert (high >= whole - 1e-9).all()
    assert high[2] < 0.05  # the tournament has no effect at all


def test_combinations_that_differ_by_chance_alone_have_no_shares():
    cells = grid(mutation_rate=[0.1, 0.3, 0.5], population_size=[50, 100, 200])
    sums, counts = runs(cells, 0.5, 20)
    sums[:, :] = sums[:, :1]  # every combination has the luck of the seed and nothing else
    whole, low, high = variance_shares(cells, sums, counts, list(cells))
    assert np.isnan([*whole, *low, *high]).all()


def test_chance_knows_nothing_of_what_a_seed_does_to_all_combinations():
    cells = grid(mutation_rate=[0.1, 0.3], population_size=[50, 100])
    sums, counts = runs(cells, 0.5, 200)
    luck = (np.arange(200) % 2)[:, None] * np.ones(4)
    assert chance(luck, counts) == pytest.approx(0)
    assert chance(sums, counts) == pytest.approx(0.25 / 200 * 3 / 4, rel=0.15)
    assert np.isnan(chance(sums[:1], counts[:1]))


def test_shuffling_what_matters_costs_a_tree_its_predictions_on_other_seeds():
    cells = grid(mutation_rate=[0.1, 0.3, 0.5, 0.7, 0.9], population_size=[50, 100, 200, 400])
    lost = permutation_importances(cells, *runs(cells, 0.9 - 0.8 * cells.mutation_rate, 20), list(cells))
    assert (lost[:, 0] > lost[:, 1] + 0.5).all()
    again = permutation_importances(cells, *runs(cells, 0.9 - 0.8 * cells.mutation_rate, 20), list(cells))
    assert (lost == again).all()
    assert np.isnan(permutation_importances(cells, *runs(cells, 0.5, 4), list(cells))).all()


def test_the_bootstrap_agrees_with_one_that_draws_seed_by_seed():
    random = np.random.default_rng(5)
    sums, counts = random.random((6, 3)) * 10, random.integers(1, 4, (6, 3)).astype(float)
    weights = resampled(6, 40)
    slow = []
    for weight in weights:
        drawn = [seed for seed in range(6) for _ in range(int(weight[seed]))]
        assert len(drawn) == 6
        slow.append(sums[drawn].sum(axis=0) / counts[drawn].sum(axis=0))
    assert ratios(weights, sums, counts) == pytest.approx(np.array(slow))
    assert (resampled(6, 40) == weights).all()
    assert (resampled(7, 40)[:, :6] != weights).any()


def test_the_bootstrap_covers_the_mean_about_as_often_as_it_says():
    random, covered = np.random.default_rng(8), 0
    for _ in range(200):
        values = random.normal(3, 1, (30, 1))
        low, high = bootstrap(values, np.ones((30, 1)))
        covered += bool(low[0] <= 3 <= high[0])
    assert 0.88 <= covered / 200 <= 0.99


def test_too_few_seeds_and_empty_groups_have_no_interval():
    assert np.isnan(bootstrap(np.ones((4, 2)), np.ones((4, 2)))).all()
    low, high = bootstrap(np.ones((5, 2)), np.ones((5, 2)) * [1, 0])
    assert (low[0], high[0]) == (1, 1)
    assert np.isnan([low[1], high[1]]).all()


def test_the_interval_of_a_mean_is_students():
    low, high = mean_interval(10.0, 2.0, 4)  # t(3, 0.975) = 3.1824
    assert (low, high) == (pytest.approx(10 - 3.18245), pytest.approx(10 + 3.18245))


@pytest.mark.parametrize(
    ("successes", "many", "expected"),
    [("0110111", 1, 2), ("0110111", 2, 3), ("0110111", 3, 7), ("0110110", 3, None), ("11", 3, None), ("", 1, None)],
)
def test_the_first_successes_in_a_row(successes, many, expected):
    assert first_in_a_row(np.array([letter == "1" for letter in successes], bool), many) == expected


@pytest.mark.parametrize(
    ("low", "high", "verdict"),
    [(41, 49, AGREES), (40, 60, UNDECIDED), (60, 70, DIFFERS), (10, 30, DIFFERS), (0, 100, UNDECIDED), (NAN, 50, UNDECIDED)],
)
def test_an_interval_agrees_only_if_all_of_it_is_near(low, high, verdict):
    assert near(low, high, 45) == verdict  # near is within a fifth, 9


def test_verdicts_of_small_numbers_and_of_orders():
    assert near(0, 7, 3) == AGREES  # within 5 points
    assert within(0.51, 0.69, 0.5, 0.7) == AGREES
    assert within(float("inf"), float("inf"), 0, 20) == DIFFERS
    assert [likely(share) for share in (0.96, 0.5, 0.04, NAN)] == [AGREES, UNDECIDED, DIFFERS, UNDECIDED]


def test_planted_influence_is_found_end_to_end(study):
    store = Results(study)
    rows = influence.influences(store, selections(store)[0]).set_index(["task", "parameter"])
    for task in ("circle", "infinity"):
        for measure in ("gap", "variance", "permutation"):
            assert rows.loc[task][measure].idxmax() == "mutation_rate", (task, measure)
        assert rows.variance_low[task, "mutation_rate"] > 50
        assert rows.variance_high[task, "tournament_size"] < 20
        best, worst = rows.gap_best[task, "mutation_rate"], rows.gap_worst[task, "mutation_rate"]
        assert (best, worst) == (0.1, 0.9)
        # Planted: 0.75 x 0.8 at the last evaluation.
        assert rows.gap_low[task, "mutation_rate"] < 60 + 12
        assert rows.gap_high[task, "mutation_rate"] > 60 - 12


def test_the_rates_of_the_importances_are_those_of_the_last_evaluation(study):
    store = Results(study)
    cells, sums, counts = at_the_end(store, selections(store)[0], "circle")
    rows = store.query("SELECT * FROM evals WHERE task = 'circle' AND evaluation = 10")
    means = rows.groupby(list(CELL)).success.mean()
    assert (sums.sum(axis=0) / counts.sum(axis=0)) == pytest.approx(means.to_numpy())
    assert (cells[list(CELL)].to_numpy(float) == np.array([list(key) for key in means.index], float)).all()


def test_a_band_over_unknown_samples_is_unknown():
    low, _ = band(np.array([[1.0, NAN], [2.0, 3.0]]))
    assert low[0] == pytest.approx(1.025)
    assert np.isnan(low[1])


def test_holm_gives_what_is_worked_out_by_hand():
    np.testing.assert_allclose(holm([0.01, 0.04, 0.03, 0.005]), [0.03, 0.06, 0.06, 0.02], rtol=1e-15)
    assert list(holm([0.9, 0.8])) == [1.0, 1.0]
    assert list(holm([0.2])) == [0.2]
    assert len(holm([])) == 0


def test_holm_is_that_of_statsmodels_bit_for_bit():
    random = np.random.default_rng(5)
    for n in (1, 2, 7, 500):
        p = random.random(n) ** 4
        p[n // 2 :] = p[n // 2]  # ties
        assert list(holm(p)) == list(multipletests(p, method="holm")[1])


def test_an_order_that_holds_in_just_95_percent_of_the_samples_agrees_and_in_just_5_differs():
    assert [likely(share) for share in (0.95, 0.949, 0.051, 0.05)] == [AGREES, UNDECIDED, UNDECIDED, DIFFERS]


def test_a_share_of_variance_is_less_what_chance_adds_for_each_value_but_one():
    """Worked out by hand: sums of squares 0.04 and 0.015 of 0.055, chance 0.001 for two, one and five degrees of freedom."""
    cells = grid(a=[1, 2, 3], b=[0, 1])
    rates = (0.1 * cells.a + 0.1 * cells.b).to_numpy()
    assert importance._shares(cells, rates, ["a", "b"], 0.001) == pytest.approx([0.038 / 0.05, 0.014 / 0.05])
