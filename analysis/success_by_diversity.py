"""Figure 4.12: success at the last evaluation against the population's diversity, a dot a combination."""

from __future__ import annotations

import pandas as pd
from matplotlib.axes import Axes

from analysis.common import (
    BEGIN,
    Drawn,
    NoDataError,
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

NAME = "success-by-diversity"
PAPER = "figure 4.12"
CELL = ("population_size", "tournament_size", "mutation_rate", "real_world_selection_size")
"""The parameters whose combinations the source compares (table 4.3)."""
FEWEST_RUNS = 5
CROWD = 60
"""From this many dots a panel on, their intervals are drawn faintly."""
ALSO_10CM = ("complex",)
"""Tasks that are too hard at 7 cm to show the pattern (figure 4.12d)."""


def combinations(store: Store, chosen: Selection) -> pd.DataFrame:
    """Of each task and combination at its last evaluation: runs, successes at 7 and 10 cm, mean diversity."""
    return store.query(f"""
        SELECT task, {", ".join(CELL)}, count(*) AS runs, count(*) FILTER (success_7cm) AS successes_7cm,
               count(*) FILTER (success_10cm) AS successes_10cm, avg(diversity) FILTER (isfinite(diversity)) AS diversity
        FROM evals JOIN ({chosen.sql}) AS chosen USING (run_id, sweep)
        WHERE evaluation = evaluations GROUP BY ALL ORDER BY ALL""")


@style()
def draw(store: Store) -> list[Drawn]:
    chosen = comparable(store, mutation_sweeps(store))
    every = combinations(store, chosen)
    rows = every[every.runs >= FEWEST_RUNS]
    if rows.empty:
        raise NoDataError(
            f"no combination has {FEWEST_RUNS} finished runs yet (the most is {every.runs.max()}); "
            f"run {BEGIN}, which goes on where it stopped"
        )
    shown = [
        (robot, task, cm)
        for robot, task in chosen.tasks
        for cm in (7, 10)
        if task in rows.task.values and (cm == 7 or task in ALSO_10CM)
    ]
    rates = sorted(rows.mutation_rate.unique())
    looks = dict(zip(rates, ordered_styles(len(rates)), strict=True))
    figure, axes = panels(len(shown), 3.0)
    for number, ((robot, task, cm), ax) in enumerate(zip(shown, axes[:, 0], strict=True)):
        _panel(ax, rows[rows.task == task], cm, looks)
        ax.set_title(lettered(number, len(axes), f"{task_title(robot, task)}, within {cm} cm"))
    _legend(figure, axes[:, 0])
    return [_drawn(store, chosen, figure, rows, len(every) - len(rows))]


def _panel(ax: Axes, rows: pd.DataFrame, cm: int, looks: dict[float, dict[str, str]]) -> None:
    for rate, dots in rows.groupby("mutation_rate"):
        share = 100 * dots[f"successes_{cm}cm"] / dots.runs
        low, high = wilson(dots[f"successes_{cm}cm"], dots.runs)
        look = {"color": looks[rate]["color"], "zorder": 2 + len(looks)}
        ax.vlines(
            dots.diversity,
            100 * low,
            100 * high,
            linewidth=1.0,
            color=look["color"],
            alpha=0.7 if len(rows) < CROWD else 0.3,
        )
        ax.plot(
            dots.diversity,
            share,
            marker=looks[rate]["marker"],
            linestyle="none",
            markeredgecolor="white",
            markeredgewidth=0.3,
            label=percent(rate),
            **look,
        )
    ax.set(ylim=(-2, 102), xlim=(0, 1.08 * rows.diversity.max()))
    ax.set(xlabel="diversity of the population", ylabel="successful runs (%)")


def _legend(figure, axes) -> None:
    named = {}
    for ax in axes:
        named.update(dict(zip(*reversed(ax.get_legend_handles_labels()), strict=True)))
    ordered = sorted(named, key=lambda label: float(label.split()[0]))
    figure.legend(
        [named[label] for label in ordered],
        ordered,
        loc="outside upper center",
        ncols=len(ordered),
        title="mutation rate",
        columnspacing=1.0,
        handletextpad=0.1,
    )


def _drawn(store: Store, chosen: Selection, figure, rows: pd.DataFrame, thin: int) -> Drawn:
    n = int(rows.runs.sum())
    said = coverage(store, chosen.sweeps, chosen.n)
    thinned = (f"{counted(thin, 'combination')} with fewer than {FEWEST_RUNS} runs left out",) if thin else ()
    few, most = rows.runs.min(), rows.runs.max()
    each = f"{few:,}" if few == most else f"{few:,} to {most:,}"
    note(
        figure,
        "; ".join(
            (
                f"{counted(len(rows), 'combination')} of {each} runs",
                *said.sentences,
                *thinned,
                f"bars: {INTERVALS}",
            )
        )
        + ".",
    )
    shows = (
        f"Share of runs whose fittest controller visits all goals at the last evaluation, against the mean "
        f"diversity (equation 4.1) of their populations then; one dot a combination of population, tournament, "
        f"mutation and real-world selection ({each} runs each, n = {n:,} runs of {', '.join(chosen.sweeps)}); "
        f"bars are 95 % Wilson intervals ({INDEPENDENCE})."
    )
    return Drawn(NAME, figure, shows, n, chosen.sweeps, (*said.missing, *thinned, *chosen.left_out))
