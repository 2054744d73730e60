"""Prototype trials in two worlds: medians with intervals, runs that never succeed, and the dissertation's values beside."""

import numpy as np
import pandas as pd
import pytest
from figure_helpers import with_evals, written
from scipy.stats import binom

from analysis import prototype_worlds
from analysis.prototype_worlds import median_in_words, median_interval
from analysis.results import NoDataError, Results
from bns.spec import RunSpec

EVALUATIONS = 12


def never_but_from(first, evaluations=EVALUATIONS):
    return np.arange(1, evaluations + 1) >= first


def test_medians_by_task_and_world_beside_the_dissertations_trials(tmp_path):
    made = []
    for world, later in (("substitute", 0), ("physics", 3)):
        for seed in range(9):
            spec = RunSpec(task="infinity", seed=seed, world=world, evaluations=EVALUATIONS)
            near, nearer = never_but_from(1 + seed // 3 + later), never_but_from(2 + seed // 3 + later + 20 * (seed == 8))
            made.append(with_evals(spec, success=nearer, success_10cm=near))
    written(tmp_path, "prototype-worlds", made)
    [drawn] = prototype_worlds.draw(Results(tmp_path))
    assert (drawn.n, list(drawn.table.world), list(drawn.table.runs)) == (18, ["substitute", "physics"], [9, 9])
    assert set(drawn.table["the dissertation, by eye"]) == {"40, 30, 20"}
    assert list(drawn.table["first success"]) == ["3 (2 to 4); 1 never", "6 (5 to 7); 1 never"]
    assert list(drawn.table["consistent, within 10 cm"]) == ["4 (3 to 5)", "7 (6 to 8)"]
    written(tmp_path / "none", "prototype", made[:1])
    with pytest.raises(NoDataError, match="bns sweep prototype-worlds"):
        prototype_worlds.draw(Results(tmp_path / "none"))


@pytest.mark.parametrize("many", [6, 9, 10, 30, 31])
def test_the_interval_of_a_median_holds_it_in_95_percent_and_a_narrower_one_does_not(many):
    low, high = median_interval(np.arange(1.0, many + 1))
    assert low + high == many + 1

    def coverage(rank):
        return 1 - 2 * binom.cdf(rank - 1, many, 0.5)

    assert coverage(low) >= 0.95 > coverage(low + 1)


def test_of_few_runs_there_is_a_median_and_no_interval():
    assert median_in_words(pd.Series([3.0, np.inf, 7.0]), 12) == "7; 1 never"
    assert median_in_words(pd.Series([np.inf] * 6), 12) == "over 12 (over 12 to over 12); 6 never"
