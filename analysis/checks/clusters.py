"""Clusters of combinations by diversity, and what a large population does to the bad ones (section 5.9.2)."""

from __future__ import annotations

import numpy as np
import pandas as pd

from analysis.intervals import Z, wilson
from analysis.labels import TITLES, valued
from analysis.results import NoDataError, Results
from analysis.scatter import combinations
from analysis.selection import Selection
from analysis.verdicts import UNDECIDED, Checked, near, within

STRONG = 10.0
"""Difference of the Bayesian information criterion that counts as strong evidence (Kass and Raftery, 1995)."""
APART = 2.0
"""Ashman's D (1994) of two components that are clearly separated."""
NEARLY_ALL = 0.9
BAD = 0.5
"""A combination is bad with less than this share of the best one's success."""
MOST = 0.5
"""Of the bad combinations most are gone where at most this share of them is left."""
MOST_PARTS = 5
"""Normal distributions in a mixture: there are five mutation rates."""
_FEWEST = 10


def two_clusters(store: Results, chosen: Selection, task: str, centres: list[float]) -> Checked:
    """Two normal distributions describe the diversities better than one, and no worse than more; they lie apart, and there."""
    claim = f"two clusters of diversity, about {centres[0]:g} and {centres[1]:g}"
    values = _diversities(store, chosen, task).diversity.to_numpy()
    most = max(2, min(MOST_PARTS, len(values) // _FEWEST))  # with fewer in each, a part describes points that lie close by chance
    fitted = {parts: _mixture(values, parts) for parts in range(1, most + 1)}
    bic = {parts: float(mixture.bic(values[:, None])) for parts, mixture in fitted.items()}
    two, gained, apart = fitted[2], bic[1] - bic[2], _ashman(fitted[2])
    ours = f"best two at {_listed(two)}, {apart:.1f} standard deviations apart; evidence {gained:+.0f}"
    if gained <= 0 or (gained > STRONG and apart < APART):
        return Checked(claim, ours, "differs")
    best = min(bic, key=lambda parts: bic[parts])
    if bic[2] - bic[best] > STRONG:
        return Checked(claim, f"{best} describe them better than two, at {_listed(fitted[best])}", "differs")
    there = [near(low, high, centre, 0.0) for (low, high), centre in zip(_intervals(two, len(values)), centres, strict=True)]
    if "differs" in there:
        return Checked(claim, ours, "differs")
    return Checked(claim, ours, "agrees" if gained > STRONG and set(there) == {"agrees"} else UNDECIDED)


def _listed(mixture) -> str:  # type: ignore[no-untyped-def]  # a GaussianMixture
    means = [f"{mean:.2f}" for mean in np.sort(mixture.means_.ravel())]
    return f"{', '.join(means[:-1])} and {means[-1]}"


def _intervals(mixture, count: int) -> list[tuple[float, float]]:  # type: ignore[no-untyped-def]  # a GaussianMixture
    """95 % intervals of the means, the lowest first, as if it were known which of ``count`` values belong to which part."""
    order = mixture.means_.ravel().argsort()
    half = Z * np.sqrt(mixture.covariances_.ravel() / (mixture.weights_ * count))
    return [(float(mixture.means_[i, 0] - half[i]), float(mixture.means_[i, 0] + half[i])) for i in order]


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
    """With the largest population at most half as large a share of combinations is bad (`BAD`) as with the others.

    The ratio of the two shares has the interval of Katz and others (1978), with half a combination added to each count.
    """
    rows = combinations(store, chosen)[0].query("task == @task")
    share, largest = rows.success / rows.runs, rows.population_size == rows.population_size.max()
    claim = f"population {rows.population_size.max()} removes most of the badly performing combinations"
    if largest.all() or not share.max():
        return Checked(claim, "not compared yet", UNDECIDED)
    bad = share < BAD * share.max()
    (few, of), (many, of_others) = ((int((bad & part).sum()), int(part.sum())) for part in (largest, ~largest))
    a, m, b, n = few + 0.5, of + 0.5, many + 0.5, of_others + 0.5
    half = Z * np.sqrt(1 / a - 1 / m + 1 / b - 1 / n)
    low, high = (float(a / m / (b / n) * np.exp(end)) for end in (-half, half))
    ours = f"{few} of {of} are bad, {many} of {of_others} with smaller ones; ratio of the shares {low:.2f} to {high:.2f}"
    return Checked(claim, ours, within(low, high, 0.0, MOST))


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
