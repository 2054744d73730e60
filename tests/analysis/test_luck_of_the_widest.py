"""A study that is not complete must not say more than it knows: of the widest of many gaps, and of the best of some."""

import numpy as np
import pytest

from analysis import importance
from analysis.findings import _among_all
from analysis.outcomes import COMBINATIONS
from analysis.verdicts import AGREES, DIFFERS, UNDECIDED, Checked


def gap_of(rates, monkeypatch, seeds=6, runs=20):
    """Of values with these rates of success at thirty evaluations, so many runs a seed."""
    draw = np.random.default_rng(0)
    counts = np.full((seeds, len(rates), 30), float(runs))
    sums = draw.binomial(runs, np.array(rates)[None, :, None], counts.shape).astype(float)
    told = (sums, counts, list(range(len(rates))), list(range(1, 31)))
    monkeypatch.setattr(importance, "by_value", lambda *_: told)
    return importance.largest_gap(None, None, "circle", "mutation_rate")


def test_the_widest_gap_of_equal_values_may_be_none(monkeypatch):
    gap = gap_of([0.4] * 5, monkeypatch)
    assert gap["points"] > 10
    assert gap["low"] < 3


def test_a_gap_that_is_there_is_known_to_be(monkeypatch):
    gap = gap_of([0.2, 0.2, 0.2, 0.7], monkeypatch)
    assert 25 < gap["low"] < 50 < gap["high"]


@pytest.mark.parametrize(
    ("verdict", "ranked", "then"), [(AGREES, 100, UNDECIDED), (DIFFERS, 499, UNDECIDED), (DIFFERS, 500, DIFFERS)]
)
def test_the_best_of_some_combinations_are_not_the_best_of_all(verdict, ranked, then):
    result = _among_all(Checked("best combination 76 %", "80 %", verdict), ranked)
    assert result.verdict == then
    assert (f"among {ranked} of {COMBINATIONS} combinations" in result.ours) == (then == UNDECIDED)
