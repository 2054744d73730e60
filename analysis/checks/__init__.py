"""One function a kind of finding: it measures these results as the dissertation measured its own, with an interval.

Each takes the store, a selection, a task and the arguments that stand in source.yaml, and gives a `Checked`.
"""

from analysis.checks.clusters import large_population_has_fewer_bad, lower_cluster_is, two_clusters
from analysis.checks.diversity import (
    best_have_a_range,
    best_in_range,
    diversity_of_best_is_steady,
    diversity_of_best_moves,
    diversity_of_worst_goes_nowhere,
    diversity_of_worst_grows,
    diversity_of_worst_saturates,
    diversity_range,
    error_rises,
    goes_with,
    low_diversity_spreads,
)
from analysis.checks.one_run import probes_settle, simulators_change_less, world_is_mostly_below
from analysis.checks.parameters import (
    best_values,
    gap_at_the_end,
    larger_is_better,
    largest_gap,
    most_influential,
    no_trend,
    second_best,
    values_alike,
    worst_value,
)
from analysis.checks.success import (
    best_combination,
    best_have_at_most,
    convergence_is_lost_and_regained,
    grows_evenly,
    half_by,
    needs_more_than,
    saturates,
    worst_have_at_least,
    worst_never_succeed,
)

__all__ = [
    "best_combination",
    "best_have_a_range",
    "best_have_at_most",
    "best_in_range",
    "best_values",
    "convergence_is_lost_and_regained",
    "diversity_of_best_is_steady",
    "diversity_of_best_moves",
    "diversity_of_worst_goes_nowhere",
    "diversity_of_worst_grows",
    "diversity_of_worst_saturates",
    "diversity_range",
    "error_rises",
    "gap_at_the_end",
    "goes_with",
    "grows_evenly",
    "half_by",
    "large_population_has_fewer_bad",
    "larger_is_better",
    "largest_gap",
    "low_diversity_spreads",
    "lower_cluster_is",
    "most_influential",
    "needs_more_than",
    "no_trend",
    "probes_settle",
    "saturates",
    "second_best",
    "simulators_change_less",
    "two_clusters",
    "values_alike",
    "world_is_mostly_below",
    "worst_have_at_least",
    "worst_never_succeed",
    "worst_value",
]
