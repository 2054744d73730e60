"""The ranking of section 4.5: the ten best combinations as swept, beside the same on fresh seeds.

The best of many is partly the luckiest of many: its share as swept is too high. A sweep NAME-confirm reruns the best on
seeds that did not pick them.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import pandas as pd
from matplotlib.axes import Axes

from analysis.coverage import coverage
from analysis.figure_result import FigureResult
from analysis.intervals import INDEPENDENCE, INTERVALS, wilson
from analysis.labels import CELL, counted, task_title
from analysis.multiple_tests import holm
from analysis.outcomes import NEAR, criterion
from analysis.ranking import TEN, in_words, ranking, varied
from analysis.results import Results
from analysis.selection import CONFIRMING, Selection, selections
from bns.plotting.style import BLUE, RED, TEXT_PT, note, panels, style
from bns.sweep.expand.shipped_sweeps import shipped_sweeps

NAME = "best-combinations"
PAPER = "the ranking of section 4.5"
LEVEL = 0.05


def draw(store: Results) -> list[FigureResult]:
    drawn = []
    for chosen in selections(store):
        rows = ranking(store, chosen)
        for task in (task for task in chosen.tasks if task in set(rows.task)):
            drawn.append(_draw(store, chosen, task, rows[rows.task == task]))
    return drawn


def confirmed(store: Results, chosen: Selection, task: str) -> pd.DataFrame:
    """Of each combination that was rerun on fresh seeds, at the last evaluation: confirm_runs, confirm_successes, and successes
    within each radius, confirm_success_7cm and so on."""
    rerun = chosen.of([sweep + CONFIRMING for sweep in chosen.sweeps])
    # A seed that took part in picking the best confirms nothing.
    return store.query(f"""
        SELECT {", ".join(CELL)}, count(*) AS confirm_runs, count(*) FILTER (success) AS confirm_successes,
               {", ".join(f"count(*) FILTER ({name}) AS confirm_{name}" for name in NEAR)}
        FROM evals JOIN ({rerun}) AS rerun USING (run_id, sweep)
        WHERE task = '{task}' AND evaluation = evaluations AND run_id NOT IN (SELECT run_id FROM ({chosen.sql}))
        GROUP BY ALL""")


def not_worse_than(rows: pd.DataFrame, best: pd.Series) -> np.ndarray:
    """Holm-corrected p-values of Fisher's exact test of each combination's successes against those of ``best``."""
    from scipy.stats import fisher_exact  # noqa: PLC0415  # slow to load

    pairs = list(zip(rows.successes, rows.runs, strict=True))
    known = {
        pair: fisher_exact([[best.successes, best.runs - best.successes], [pair[0], pair[1] - pair[0]]]).pvalue
        for pair in set(pairs)
    }
    return holm([known[pair] for pair in pairs])


def tied(rows: pd.DataFrame) -> tuple[str, ...]:
    """What is said where more combinations than are shown succeed as often as the first; ``rows``: from best to worst."""
    alike = int((rows.success == rows.success.iloc[0]).sum())
    if alike <= TEN:
        return ()
    return (f"{alike} combinations tie at {100 * rows.success.iloc[0]:.0f} %, in the order of wider goal radii and mean fitness",)


@style()
def _draw(store: Results, chosen: Selection, task: str, rows: pd.DataFrame) -> FigureResult:
    best, again = rows.head(TEN), confirmed(store, chosen, task)
    best = best.merge(again, how="left", on=list(CELL)).fillna({"confirm_runs": 0, "confirm_successes": 0})
    others = rows.iloc[1:]
    equal = int((not_worse_than(others, rows.iloc[0]) >= LEVEL).sum()) if len(others) else 0
    figure, axes = panels(1, 1.5 + 0.26 * len(best), wide=True)
    _panel(axes[0, 0], best, varied(rows))
    # Over the whole figure: beside the names of the combinations the axes are narrow.
    title = f"{task_title(chosen.robot, task)}: the {len(best)} best of {counted(len(rows), 'combination')}"
    handles = axes[0, 0].get_legend_handles_labels()
    figure.legend(*handles, loc="outside upper center", ncols=2, title=title, title_fontsize=TEXT_PT + 1)
    reruns, n = int(best.confirm_runs.sum()), int(best.runs.sum())
    said = coverage(store, chosen.sweeps, chosen.n)
    name = chosen.sweeps[0]
    how = f"bns sweep {name if name in shipped_sweeps() else f'{name}.yaml'} --confirm-top {TEN}"
    unconfirmed = () if reruns else (f"not confirmed on fresh seeds: {how}",)
    doubts = (*said.missing, *(unconfirmed and ("not confirmed",)), *tied(rows))
    note(figure, "; ".join((f"{n:,} runs", *doubts, f"bars: {INTERVALS}")) + ".")
    shows = (
        f"The {len(best)} best combinations of {counted(len(rows), 'combination')}, by the fraction of runs whose fittest "
        f"controller {criterion(store, chosen)} at the last evaluation. As swept: n = {n:,} runs of "
        f"{chosen.source}, the ones that picked them, so too high; confirmed: {reruns:,} runs on fresh seeds. "
        f"Bars are 95 % Wilson intervals ({INDEPENDENCE})."
    )
    return FigureResult(
        f"{NAME}-{chosen.robot}-{task}", f"Best combinations, {task_title(chosen.robot, task)}", figure, shows, n + reruns,
        chosen.sweeps, (*said.missing, *unconfirmed, *chosen.left_out), see=_in_words(rows, best, equal), data=best,
    )  # fmt: skip


def _panel(ax: Axes, best: pd.DataFrame, names: Sequence[str]) -> None:
    places = np.arange(len(best))
    _bars(ax, places - 0.12, best.successes, best.runs, {"color": BLUE, "marker": "o", "label": "as swept"})
    known = best.confirm_runs > 0
    if known.any():
        again = best[known]
        look = {"color": RED, "marker": "s", "label": "confirmed on fresh seeds"}
        _bars(ax, places[known] + 0.18, again.confirm_successes, again.confirm_runs, look)
    ax.set_yticks(places, [f"{row.rank}. {in_words(row, names)}" for row in best.itertuples()])
    ax.set(ylim=(len(best) - 0.5, -0.5), xlim=(-2, 102), xlabel="successful runs at the last evaluation (%)")


def _bars(ax: Axes, places: np.ndarray, successes: pd.Series, runs: pd.Series, look: dict[str, str]) -> None:
    low, high = wilson(successes, runs)
    ax.hlines(places, 100 * low, 100 * high, color=look["color"], linewidth=1.2)
    ax.plot(100 * successes / runs, places, linestyle="none", **look)


def _in_words(rows: pd.DataFrame, best: pd.DataFrame, equal: int) -> str:
    said = f"The first has {100 * best.success.iloc[0]:.0f} % as swept"
    if best.confirm_runs.iloc[0]:
        said += f" and {100 * best.confirm_successes.iloc[0] / best.confirm_runs.iloc[0]:.0f} % on fresh seeds"
    said += "".join(f"; {text}" for text in tied(rows))
    return f"{said}; {equal} of the {len(rows) - 1} others cannot be distinguished from it (Fisher's test, Holm, {LEVEL:g})."
