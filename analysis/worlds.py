"""Which conclusions survive another world: the same combinations and seeds in the substitute world and in physics.

`sweeps/worlds.yaml` and `sweeps/worlds-snake.yaml` make the runs; an archive of them is in `results/published/`. Two questions of
sections 4.6.1, 5.9.1 and 6.2: by how much each parameter moves success, and what it costs to follow the advice that they come
to, low mutation and large populations.
"""

from __future__ import annotations

import numpy as np
import pandas as pd

from analysis.figure_result import FigureResult
from analysis.intervals import FEWEST_SEEDS, band, resampled
from analysis.labels import CELL, SHORT, TITLES, each, task_order, task_title, valued
from analysis.results import NoDataError, Results
from analysis.selection import WORLDS
from bns.plotting.style import OKABE_ITO, lettered, note, panels, style

NAME = "worlds"
PAPER = "sections 4.6.1, 5.9.1 and 6.2, asked in another world"
LATE = 0.8
"""Evaluations that count: those beyond this share of a run."""
_GROUP = ["robot", "task", "world"]


def draw(store: Results) -> list[FigureResult]:
    runs = of_each_run(store)
    rows = influences(runs)
    shows = (
        "How many points of success (the fittest controller meets all goals, mean over the last fifth of a run) lie between the "
        "best and the worst value of each parameter, the others averaged over, in the substitute world and in the physics world: "
        "the same combinations, the same seeds. Bars: 95 % bootstrap intervals over seeds of the difference between these two. "
        f"n = {len(runs):,} runs."
    )
    return [_drawn(robot, own, runs[runs.robot == robot], shows) for robot, own in rows.groupby("robot")]


def _drawn(robot: str, rows: pd.DataFrame, runs: pd.DataFrame, shows: str) -> FigureResult:
    title, sweeps = "Influence of the parameters in two worlds", tuple(sorted(set(runs.sweep)))
    return FigureResult(f"{NAME}-{robot}", title, _figure(robot, rows), shows, len(runs), sweeps, data=rows, table=table(rows))


def of_each_run(store: Results) -> pd.DataFrame:
    """A row a finished run: robot, task, world, the four parameters, seed, and success in per cent of its late evaluations.

    Raises:
        NoDataError: there is none.
    """
    runs = store.query(f"""
        SELECT sweep, robot, task, world, {", ".join(CELL)}, seed,
               100 * avg(success::INT) FILTER (evaluation > {LATE} * evaluations) AS success
        FROM evals JOIN (SELECT run_id, sweep, any_value(evaluations) AS evaluations FROM runs
                         WHERE status = 'ok' AND starts_with(sweep, '{WORLDS}') GROUP BY ALL) AS done USING (run_id, sweep)
        GROUP BY ALL ORDER BY ALL""")
    if runs.empty:
        raise NoDataError("no sweep has the same combinations in two worlds; run bns sweep worlds")
    return runs


def of_whole_seeds(runs: pd.DataFrame) -> tuple[pd.DataFrame, np.ndarray]:
    """Combinations (rows), and success (seeds, combinations) of one robot, task and world; only seeds that have all of them."""
    rates = runs.pivot_table(index="seed", columns=list(CELL), values="success").dropna()
    return rates.columns.to_frame(index=False), rates.to_numpy()


def influences(runs: pd.DataFrame) -> pd.DataFrame:
    """A row a robot, task, world and parameter that varies: points between its best and worst value, and how sure that is.

    Columns: seeds; best, worst: the values; points, low, high; widest: in which share of the bootstrap samples no other parameter
    moves success more. Intervals and shares are NaN from fewer than `FEWEST_SEEDS` seeds.
    """
    rows = []
    for key, own in runs.groupby(_GROUP):
        cells, rates = of_whole_seeds(own)
        names = [name for name in CELL if cells[name].nunique() > 1]
        if not len(rates) or not names:
            continue
        samples = resampled(len(rates)) @ rates / len(rates) if len(rates) >= FEWEST_SEEDS else None
        found = [_influence(cells[name].to_numpy(), rates.mean(axis=0), samples) for name in names]
        spans = None if samples is None else np.stack([_span(cells[name].to_numpy(), samples) for name in names])
        for number, (name, one) in enumerate(zip(names, found, strict=True)):
            widest = np.nan if spans is None else float((spans.argmax(axis=0) == number).mean())
            rows.append(dict(zip(_GROUP, key, strict=True)) | {"parameter": name, "seeds": len(rates), "widest": widest} | one)
    return pd.DataFrame(rows)


def _means(values: np.ndarray, rates: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Values in order, and the mean of rates (..., combinations) at each of them, (..., values)."""
    levels = np.unique(values)
    return levels, np.stack([rates[..., values == level].mean(axis=-1) for level in levels], axis=-1)


def _span(values: np.ndarray, rates: np.ndarray) -> np.ndarray:
    return np.asarray(np.ptp(_means(values, rates)[1], axis=-1))


def _influence(values: np.ndarray, rates: np.ndarray, samples: np.ndarray | None) -> dict[str, float]:
    levels, means = _means(values, rates)
    best, worst = int(means.argmax()), int(means.argmin())
    ends = (np.nan, np.nan)
    if samples is not None:
        drawn = _means(values, samples)[1]
        ends = tuple(map(float, band(drawn[:, best] - drawn[:, worst])))
    points = float(means[best] - means[worst])
    return {"best": float(levels[best]), "worst": float(levels[worst]), "points": points, "low": ends[0], "high": ends[1]}


def table(rows: pd.DataFrame) -> pd.DataFrame:
    """In words: a row a task and parameter, a column a world."""
    said = rows.assign(
        says=[
            f"{row.points:.0f}{_interval(row)}: {valued(row.parameter, row.best)} above {valued(row.parameter, row.worst)}"
            + ("" if np.isnan(row.widest) else f"; the widest in {row.widest:.0%}")
            for row in rows.itertuples()
        ]
    )
    wide = said.pivot_table(index=["robot", "task", "parameter"], columns="world", values="says", aggfunc="first").reset_index()
    order = sorted(range(len(wide)), key=lambda i: (*task_order(wide.robot[i], wide.task[i]), CELL.index(wide.parameter[i])))
    wide = wide.iloc[order]
    titles = [task_title(robot, task) for robot, task in zip(wide.robot, wide.task, strict=True)]
    worlds = {f"{world} world (points)": wide[world].fillna("") for world in sorted(set(rows.world), reverse=True)}
    return pd.DataFrame({"task": titles, "parameter": wide.parameter.map(TITLES), **worlds})


def _interval(row) -> str:  # type: ignore[no-untyped-def]  # a named tuple
    return "" if np.isnan(row.low) else f" ({row.low:.0f} to {row.high:.0f})"


@style()
def _figure(robot: str, rows: pd.DataFrame):  # type: ignore[no-untyped-def]  # a Figure
    tasks = sorted(set(rows.task), key=lambda task: task_order(robot, task))
    names = [name for name in CELL if name in set(rows.parameter)]
    worlds = sorted(set(rows.world), reverse=True)
    figure, axes = panels(len(tasks), 1.2 + 0.4 * len(names))
    for number, (ax, task) in enumerate(zip(axes[:, 0], tasks, strict=True)):
        for place, world in enumerate(worlds):
            own = rows[(rows.task == task) & (rows.world == world)].set_index("parameter").reindex(names)
            at = np.arange(len(names)) + 0.24 * (place - (len(worlds) - 1) / 2)
            ax.hlines(at, own.low, own.high, color=OKABE_ITO[place])
            ax.plot(own.points, at, "os^D"[place % 4], color=OKABE_ITO[place], label=f"{world} world")
        ax.axvline(0, color="black", linewidth=0.6)
        title = lettered(number, len(tasks), task_title(robot, task))
        ax.set(ylim=(len(names) - 0.5, -0.5), xlabel="points of success", title=title)
        ax.set_yticks(range(len(names)), [SHORT[name] if not number else "" for name in names])
    figure.legend(*axes[0, 0].get_legend_handles_labels(), loc="outside upper center", ncols=len(worlds))
    seeds = each(int(rows.seeds.min()), int(rows.seeds.max()), "seed")
    note(figure, f"Best value against worst, the other parameters averaged over; {seeds}.")
    return figure
