"""Clusters of combinations by diversity, and what a large population does to the bad ones (section 5.9.2)."""

from __future__ import annotations

import numpy as np
import pandas as pd

from analysis.checks.exact_tests import fewer
from analysis.intervals import wilson
from analysis.labels import TITLES, valued
from analysis.results import NoDataError, Results
from analysis.scatter import combinations
from analysis.selection import Selection
from analysis.verdicts import UNDECIDED, Checked, likely, within

STRONG = 10.0
"""Difference of the Bayesian information criterion that counts as strong evidence (Kass and Raftery, 1995)."""
APART = 2.0
"""Ashman's D (1994) of two components that are clearly separated."""
NEARLY_ALL = 0.9
BAD = 0.5
"""A combination is bad with less than this share of the best one's success."""
_FEWEST = 10


def two_clusters(store: Results, chosen: Selection, task: str, centres: list[float]) -> Checked:
    """A mixture of two normal distributions describes the diversities better than one, and its halves lie apart."""
    low, high = centres
    claim = f"two clusters of diversity, about {low:g} and {high:g}"
    values = _diversities(store, chosen, task).diversity.to_numpy()
    one, two = _mixture(values, 1), _mixture(values, 2)
    gained, apart = one.bic(values[:, None]) - two.bic(values[:, None]), _ashman(two)
    means = np.sort(two.means_.ravel())
    ours = f"best two at {means[0]:.2f} and {means[1]:.2f}, {apart:.1f} standard deviations apart; evidence {gained:+.0f}"
    if gained <= 0 or (gained > STRONG and apart < APART):
        return Checked(claim, ours, "differs")
    return Checked(claim, ours, "agrees" if gained > STRONG else UNDECIDED)


def lower_cluster_is(store: Results, chosen: Selection, task: str, parameter: str, value: float) -> Checked:
    """Combinations that are in the lower of two clusters where they have this value, and in the upper where they have not."""
    claim = f"the lower cluster of diversity is that of {TITLES[parameter]} {valued(parameter, value)}"
    rows = _diversities(store, chosen, task)
    mixture = _mixture(rows.diversity.to_numpy(), 2)
    lower = mixture.predict(rows.diversity.to_numpy()[:, None]) == int(mixture.means_.ravel().argmin())
    right = lower == (rows[parameter] == value).to_numpy()
    low, high = (float(end) for end in wilson(right.sum(), len(right)))
    ours = f"of {right.sum()} of {len(right)} combinations it is true ({100 * low:.0f} to {100 * high:.0f} %)"
    return Checked(claim, ours, within(low, high, NEARLY_ALL, 1.0))


def large_population_has_fewer_bad(store: Results, chosen: Selection, task: str) -> Checked:
    """Of combinations with the largest population fewer have less than half of the best one's success than of the others."""
    rows = combinations(store, chosen)[0].query("task == @task")
    share, largest = rows.success / rows.runs, rows.population_size == rows.population_size.max()
    claim = f"population {rows.population_size.max()} removes the badly performing combinations"
    if largest.all() or not share.max():
        return Checked(claim, "not compared yet", UNDECIDED)
    bad = share < BAD * share.max()
    counts = [[int((bad & part).sum()), int((~bad & part).sum())] for part in (largest, ~largest)]
    ours = f"{counts[0][0]} of {sum(counts[0])} are bad, {counts[1][0]} of {sum(counts[1])} with smaller ones"
    return Checked(claim, ours, likely(1 - fewer(counts)))


def _diversities(store: Results, chosen: Selection, task: str) -> pd.DataFrame:
    rows = combinations(store, chosen)[0].query("task == @task").dropna(subset=["diversity"])
    if len(rows) < _FEWEST:
        raise NoDataError(f"{len(rows)} combinations of {task} have a diversity; clusters need {_FEWEST}")
    return rows


def _mixture(values: np.ndarray, parts: int):  # type: ignore[no-untyped-def]  # a GaussianMixture
    from sklearn.mixture import GaussianMixture  # noqa: PLC0415  # a second to load

    return GaussianMixture(parts, n_init=5, random_state=0).fit(values[:, None])


def _ashman(mixture) -> float:  # type: ignore[no-untyped-def]
    """Distance of two means in root mean square standard deviations."""
    means, variances = mixture.means_.ravel(), mixture.covariances_.ravel()
    return float(abs(means[0] - means[1]) / np.sqrt(variances.mean()))
