"""Figure 4.7: how many runs succeed after each evaluation, by mutation rate."""

from __future__ import annotations

import pandas as pd
from matplotlib.axes import Axes
from matplotlib.ticker import MaxNLocator

from analysis.common import (
    Drawn,
    Selection,
    Store,
    comparable,
    counted,
    coverage,
    mutation_sweeps,
    percent,
    task_title,
)
from analysis.intervals import INDEPENDENCE, INTERVALS, wilson
from bns.plotting import lettered, note, ordered_styles, panels, style

NAME = "success-by-mutation"
PAPER = "figure 4.7"
FEWEST = 5
"""Runs behind a curve; a thinner one jumps between 0 and 100 % and is left out, unless there are no others."""


def counts(store: Store, chosen: Selection) -> pd.DataFrame:
    """Runs and successes of each task, mutation rate and evaluation."""
    return store.query(f"""
        SELECT task, mutation_rate, evaluation, count(success_7cm) AS runs,
               count(*) FILTER (success_7cm) AS successes
        FROM evals SEMI JOIN ({chosen.sql}) USING (run_id, sweep)
        WHERE success_7cm IS NOT NULL GROUP BY ALL ORDER BY ALL""")


@style()
def draw(store: Store) -> list[Drawn]:
    chosen = comparable(store, mutation_sweeps(store))
    rows, thin = _thick_enough(counts(store, chosen))
    tasks, n = [pair for pair in chosen.tasks if pair[1] in set(rows.task)], chosen.n - thin
    looks = dict(zip(sorted(rows.mutation_rate.unique()), ordered_styles(rows.mutation_rate.nunique()), strict=True))
    figure, axes = panels(len(tasks), 3.6, rows_each=2, ratios=(3, 1))
    for number, ((robot, task), (ax, below)) in enumerate(zip(tasks, axes, strict=True)):
        _panel(ax, rows[rows.task == task], looks)
        ax.set_title(lettered(number, len(axes), task_title(robot, task)))
        below.set_axis_off()
        below.legend(*ax.get_legend_handles_labels(), loc="upper center", title="mutation rate")
    axes[0, 0].set_ylabel("successful runs, 7 cm (%)")
    said = coverage(store, chosen.sweeps, n)
    too_few = (f"{counted(thin, 'run')} in curves of fewer than {FEWEST} not drawn",) if thin else ()
    note(figure, "; ".join((*said.sentences, *too_few, f"bands: {INTERVALS}")) + ".")
    shows = (
        f"Share of runs whose fittest controller, driven in the world after each evaluation, visits all goals "
        f"within 7 cm, by mutation rate; all other parameters pooled. n = {n:,} runs of "
        f"{', '.join(chosen.sweeps)}; bands are 95 % Wilson intervals ({INDEPENDENCE})."
    )
    return [Drawn(NAME, figure, shows, n, chosen.sweeps, (*said.missing, *too_few, *chosen.left_out))]


def _thick_enough(rows: pd.DataFrame) -> tuple[pd.DataFrame, int]:
    """The curves to draw, and how many runs stand in the others."""
    runs = rows.groupby(["task", "mutation_rate"]).runs.transform("max")
    thick = runs >= FEWEST if (runs >= FEWEST).any() else runs > 0
    left_out = rows[~thick].groupby(["task", "mutation_rate"]).runs.max().sum()
    return rows[thick], int(left_out)


def _panel(ax: Axes, rows: pd.DataFrame, looks: dict[float, dict[str, str]]) -> None:
    for rate, curve in rows.groupby("mutation_rate"):
        low, high = wilson(curve.successes, curve.runs)
        every = max(1, len(curve) // 6)
        ax.fill_between(curve.evaluation, 100 * low, 100 * high, color=looks[rate]["color"], alpha=0.18, linewidth=0)
        ax.plot(
            curve.evaluation,
            100 * curve.successes / curve.runs,
            **looks[rate],
            markevery=(every // 2, every),
            label=f"{percent(rate)} (n = {curve.runs.max():,})",
        )
    ax.set(ylim=(-2, 102), xlabel="evaluation in the world", xlim=(0, rows.evaluation.max() + 1))
    ax.xaxis.set_major_locator(MaxNLocator(6, integer=True, steps=[1, 2, 5, 10]))
