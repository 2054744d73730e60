"""Figure 5.28: success against diversity of the combinations with the largest population alone."""

from __future__ import annotations

from analysis.figure_result import FigureResult
from analysis.intervals import INDEPENDENCE, INTERVALS
from analysis.labels import TITLES
from analysis.outcomes import criterion
from analysis.results import Results
from analysis.scatter import combinations, described, intervals_shown, scatter_figure
from analysis.selection import Selection, selections
from analysis.success_by_diversity import COLOUR, in_words, success_panels
from bns.plotting.style import style

NAME = "success-by-diversity-largest-population"
PAPER = "figure 5.28"


def draw(store: Results) -> list[FigureResult]:
    return [_draw(store, chosen) for chosen in selections(store, "population_size")]


@style()
def _draw(store: Results, chosen: Selection) -> FigureResult:
    found, _ = combinations(store, chosen)
    largest = found.population_size.max()
    rows = found[found.population_size == largest]
    figure, axes = scatter_figure(success_panels(store, chosen, rows), COLOUR, "successful runs (%)")
    for ax in axes:
        ax.set_ylim(-2, 102)
    what = (
        f"Fraction of runs whose fittest controller {criterion(store, chosen)} at the last evaluation, against the mean "
        f"diversity of their populations of {largest} then, by {TITLES[COLOUR]}; "
        + intervals_shown(rows, f"95 % Wilson intervals ({INDEPENDENCE})")
    )
    return described(
        store, chosen, figure, rows, name=NAME, title=f"Success against diversity, population {largest}", what=what,
        intervals=INTERVALS, thin=0, see=in_words(chosen, rows),
    )  # fmt: skip
