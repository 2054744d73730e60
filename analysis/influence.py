"""How much each parameter matters (said in words in sections 4.6.1 and 5.9.1): gap, variance share, permutation importance."""

from __future__ import annotations

from collections.abc import Callable
from importlib import import_module
from threading import Thread

import numpy as np
import pandas as pd
from matplotlib.axes import Axes

from analysis.coverage import coverage
from analysis.figure_result import FigureResult
from analysis.importance import at_the_end, largest_gap, permutation_importances, variance_shares
from analysis.intervals import BOOTSTRAP, FEWEST_SEEDS, band
from analysis.labels import CELL, TITLES, counted, task_title, valued
from analysis.outcomes import criterion
from analysis.ranking import varied
from analysis.results import Results
from analysis.selection import Selection, selections
from bns.plotting.style import lettered, note, ordered_styles, panels, style

NAME = "influence"
PAPER = "sections 4.6.1 and 5.9.1"
MEASURES = {
    "gap": "largest gap (points)",
    "variance": "variance share (%)",
    "permutation": "loss of R² when shuffled",
}


def draw(store: Results) -> list[FigureResult]:
    Thread(target=import_module, args=("sklearn.inspection",)).start()  # a second to load, beside the queries
    return [_draw(store, chosen) for chosen in selections(store)]


def influences(store: Results, chosen: Selection) -> pd.DataFrame:
    """One row a task and parameter; of each measure its value and the ends low and high of its interval, and the seeds."""
    made = []
    for task in chosen.tasks:
        cells, sums, counts = at_the_end(store, chosen, task)
        names = varied(cells)
        if not names:
            continue
        shares = variance_shares(cells, sums, counts, names)
        splits = permutation_importances(cells, sums, counts, names)
        low, high = band(splits)
        for number, name in enumerate(names):
            gap = largest_gap(store, chosen, task, name)
            row = {"task": task, "parameter": name, "seeds": len(sums), "combinations": len(cells), "runs": int(counts.sum())}
            row |= {"gap" if key == "points" else f"gap_{key}": value for key, value in gap.items()}
            row |= dict(zip(("variance", "variance_low", "variance_high"), (100 * end[number] for end in shares), strict=True))
            row |= {"permutation": splits[:, number].mean(), "permutation_low": low[number], "permutation_high": high[number]}
            made.append(row)
    return pd.DataFrame(made)


@style()
def _draw(store: Results, chosen: Selection) -> FigureResult:
    rows = influences(store, chosen)
    names = [name for name in CELL if name in set(rows.parameter)]
    tasks = [task for task in chosen.tasks if task in set(rows.task)]
    figure, axes = panels(len(MEASURES), 1.4 + 0.45 * len(names))
    for number, (ax, (measure, label)) in enumerate(zip(axes[:, 0], MEASURES.items(), strict=True)):
        _panel(ax, rows, measure, names, tasks, lambda task: task_title(chosen.robot, task))
        ax.set(xlabel=label, title=lettered(number, len(MEASURES), ""))
        ax.set_yticks(range(len(names)), [TITLES[name] if not number else "" for name in names])
    if len(tasks) > 1:
        figure.legend(*axes[0, 0].get_legend_handles_labels(), loc="outside upper center", ncols=len(tasks))
    n, said = int(rows.drop_duplicates("task").runs.sum()), coverage(store, chosen.sweeps, chosen.n)
    unknown = ("no mark where combinations differ no more than by chance",) if rows.variance.isna().any() else ()
    luck = "in (a) extended downwards by the width that the largest of several gaps has by chance"
    bars = f"bars in (a) and (b): {BOOTSTRAP.removeprefix('pointwise ')}, {luck}; in (c): 95 % of the splits"
    if (few := rows.seeds.max()) < FEWEST_SEEDS:
        bars = f"no bars, and nothing in (c): {counted(few, 'seed')}, and {FEWEST_SEEDS} are needed"
    note(figure, "; ".join((*said.sentences, *unknown, bars)) + ".")
    shows = (
        f"What each parameter does to success (the fittest controller {criterion(store, chosen)}), seeds as the unit. (a) The "
        f"dissertation's measure: the largest gap between the curves of its values. (b) Functional analysis of variance: "
        f"fraction of the variance between combinations at the last evaluation that it explains alone, corrected for chance. (c) "
        f"Permutation: how much of its R² a regression tree loses on seeds it has not seen, when the values are shuffled. "
        f"n = {n:,} runs of {chosen.source}, {rows.seeds.max()} seeds."
    )
    return FigureResult(
        f"{NAME}-{chosen.robot}", "Influence of the parameters", figure, shows, n, chosen.sweeps,
        (*said.missing, *chosen.left_out), see=_in_words(rows, chosen), data=rows, table=_table(rows, chosen),
    )  # fmt: skip


def _panel(
    ax: Axes, rows: pd.DataFrame, measure: str, names: list[str], tasks: list[str], title: Callable[[str], str]
) -> None:
    for task, look, offset in zip(tasks, ordered_styles(len(tasks)), _offsets(len(tasks)), strict=True):
        own = rows[rows.task == task].set_index("parameter").reindex(names)
        places = np.arange(len(names)) + offset
        ax.hlines(places, own[f"{measure}_low"], own[f"{measure}_high"], color=look["color"], linewidth=1.4)
        ax.plot(own[measure], places, linestyle="none", color=look["color"], marker=look["marker"], label=title(task))
    ax.axvline(0, color="black", linewidth=0.6)
    ax.set_ylim(len(names) - 0.5, -0.5)
    if measure == "variance":
        ax.set_xlim(-3, 103)
    elif rows[measure].isna().all():
        ax.set_xticks([0])


def _offsets(count: int) -> np.ndarray:
    return np.linspace(-0.22, 0.22, count) if count > 1 else np.zeros(1)


def _table(rows: pd.DataFrame, chosen: Selection) -> pd.DataFrame:
    def interval(row: dict, measure: str, form: str) -> str:
        if np.isnan(row[measure]):
            return f"from {FEWEST_SEEDS} seeds on" if measure == "permutation" and row["seeds"] < FEWEST_SEEDS else "chance alone"
        value, low, high = (format(row[name], form) for name in (measure, f"{measure}_low", f"{measure}_high"))
        return value if "nan" in (low, high) else f"{value} ({low} to {high})"

    return pd.DataFrame(
        {
            "task": task_title(chosen.robot, row["task"]),
            "parameter": TITLES[row["parameter"]],
            "largest gap, points": interval(row, "gap", ".1f"),
            "where": f"evaluation {row['gap_evaluation']:.0f}, {valued(row['parameter'], row['gap_best'])} above "
            f"{valued(row['parameter'], row['gap_worst'])}",
            "variance share, %": interval(row, "variance", ".1f"),
            "loss of R²": interval(row, "permutation", ".2f"),
        }
        for row in rows.to_dict("records")
    )


def _in_words(rows: pd.DataFrame, chosen: Selection) -> str:
    widest = rows.sort_values("gap").drop_duplicates("task", keep="last").set_index("task")
    return " ".join(
        f"{task_title(chosen.robot, task)}: {TITLES[widest.parameter[task]]} has the widest gap, {widest.gap[task]:.0f} points."
        for task in chosen.tasks
        if task in widest.index
    )
