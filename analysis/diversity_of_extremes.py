"""Figures 4.13 to 4.15 (Khepera), 5.29 and 5.30 (snake): diversity over evaluations, ten best and ten worst combinations."""

from __future__ import annotations

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.ticker import MaxNLocator

from analysis.coverage import coverage
from analysis.figure_result import FigureResult
from analysis.intervals import BOOTSTRAP, FEWEST_SEEDS, bootstrap, ratios
from analysis.labels import CELL, task_title
from analysis.outcomes import by_seed
from analysis.ranking import any_of, by_seed_array, extremes, ranking
from analysis.results import BEGIN, NoDataError, Results, remembered
from analysis.selection import Selection, selections
from bns.plotting.style import BLUE, GREY, lettered, note, panels, style

NAME = "diversity-of-extremes"
PAPER = "figures 4.13 to 4.15, 5.29 and 5.30"
FIRST_EVALUATION = 5
"""Before it controllers are almost random; the dissertation draws nothing of that either."""


def draw(store: Results) -> list[FigureResult]:
    drawn, reason = [], NoDataError("")
    for chosen in selections(store):
        rows = ranking(store, chosen)
        for task in (task for task in chosen.tasks if task in set(rows.task)):
            try:
                drawn.append(_draw(store, chosen, task, extremes(rows, task)))
            except NoDataError as none:
                reason = none
    if not drawn:
        raise reason
    return drawn


@remembered
def curves(store: Results, chosen: Selection, task: str, which: int) -> pd.DataFrame:
    """Of each of the best (0) or worst (1) combinations, seed and evaluation from the fifth on: summed diversity and how many
    runs are in it.

    Raises:
        NoDataError: the runs end before, or no diversity is known.
    """
    cells = extremes(ranking(store, chosen), task)[which]
    where = f"task = '{task}' AND evaluation >= {FIRST_EVALUATION} AND ({any_of(cells)})"
    rows = by_seed(store, chosen, ("evaluation", *CELL), where)
    if not rows.diversities.any():
        raise NoDataError(
            f"no run of {task} has a diversity from evaluation {FIRST_EVALUATION} on (populations are random before it); "
            f"run {BEGIN}"
        )
    return rows


@style()
def _draw(store: Results, chosen: Selection, task: str, ends: tuple[pd.DataFrame, pd.DataFrame]) -> FigureResult:
    figure, axes = panels(2, 3.2)
    pooled = {}
    for number, (which, cells, ax) in enumerate(zip(("best", "worst"), ends, axes[:, 0], strict=True)):
        rows = curves(store, chosen, task, number)
        pooled[which] = _panel(ax, rows)
        ax.set_title(lettered(number, 2, f"{task_title(chosen.robot, task)}, the {len(cells)} {which} combinations"))
        ax.set(xlabel="evaluation in the world", ylabel="diversity of the population")
    top = max(ax.get_ylim()[1] for ax in axes[:, 0])
    for ax in axes[:, 0]:
        ax.set_ylim(0, top)
    figure.legend(*axes[0, 0].get_legend_handles_labels(), loc="outside upper center", ncols=3)
    n, said = int(sum(cells.runs.sum() for cells in ends)), coverage(store, chosen.sweeps, chosen.n)
    known = any(frame.low.notna().any() for frame in pooled.values())
    bands = f"bands: {BOOTSTRAP}" if known else f"no bands: fewer than {FEWEST_SEEDS} seeds"
    note(figure, "; ".join((f"{n:,} runs in these combinations", *said.missing, bands)) + ".")
    shows = (
        f"Mean diversity of the populations after each evaluation from the fifth on, of the {len(ends[0])} best and as many "
        f"worst combinations on task {task_title(chosen.robot, task)}, ranked by success at the last evaluation. Thin: each "
        f"combination; thick: their mean; {bands}. n = {n:,} runs of {chosen.source}."
    )
    data = pd.concat([frame.assign(which=which) for which, frame in pooled.items()])
    return FigureResult(
        f"{NAME}-{chosen.robot}-{task}",
        f"Diversity of the best and worst combinations, {task_title(chosen.robot, task)}",
        figure,
        shows,
        n,
        chosen.sweeps,
        (*said.missing, *chosen.left_out),
        see=_in_words(pooled),
        data=data,
    )


def _panel(ax: Axes, rows: pd.DataFrame) -> pd.DataFrame:
    for number, (_, one) in enumerate(rows.groupby(list(CELL))):
        line = one.groupby("evaluation")[["diversity", "diversities"]].sum()
        label = "each combination" if not number else None
        ax.plot(line.index, line.diversity / line.diversities, color=GREY, linewidth=0.6, alpha=0.7, label=label)
    (sums, evaluations), (counts, _) = (by_seed_array(rows, name) for name in ("diversity", "diversities"))
    low, high = bootstrap(sums, counts)
    mean = ratios(np.ones((1, len(sums))), sums, counts)[0]
    ax.fill_between(evaluations, low, high, color=BLUE, alpha=0.3, linewidth=0)
    ax.plot(evaluations, mean, color=BLUE, linewidth=2, label="their mean")
    ax.xaxis.set_major_locator(MaxNLocator(6, integer=True, steps=[1, 2, 5, 10]))
    return pd.DataFrame({"evaluation": evaluations, "diversity": mean, "low": low, "high": high})


def _in_words(pooled: dict[str, pd.DataFrame]) -> str:
    ends = {which: (frame.iloc[0], frame.iloc[-1]) for which, frame in pooled.items()}
    return " ".join(
        f"The {which}: {first.diversity:.2f} at evaluation {first.evaluation:.0f}, {last.diversity:.2f} at {last.evaluation:.0f}."
        for which, (first, last) in ends.items()
    )
