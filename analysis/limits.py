"""Success of some options of BNS, and what limits it: networks, the world without its noise, its noise, or no approach at all.

`python -m analysis.limits [--runs ARCHIVE] [--lists CSV] [--drives CSV] [--out PNG]`: by default from what is published:
the archive of the sweep ``noise``, the lists of `analysis.ceiling`, and the rows of `analysis.margins` of the same runs. Then the
table of the sweep ``noise-late``, from its own archive and drives.
"""

from __future__ import annotations

import argparse
from collections.abc import Sequence
from pathlib import Path

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from analysis import ceiling
from analysis.intervals import FEWEST_SEEDS, band, resampled, wilson
from analysis.labels import task_title
from analysis.results import Results
from bns.plotting.style import GREY, OKABE_ITO, PAGE_IN, lettered, style

PUBLISHED = Path(__file__).parents[1] / "results" / "published"
SWEEP, PHYSICS, BASE, LATE = "noise", "noise-physics", "bns+margin=0.03", "noise-late"
APPROACHES = ("bns", BASE, "bns+noise=16", "bns+noise=16+margin=0.01+renew=10")
_COLOURS = (OKABE_ITO[0], OKABE_ITO[4], OKABE_ITO[1], OKABE_ITO[2])
LAST, EARLY, LATEST = 5, 20, 5
"""Evaluations at the end and at the beginning that are averaged, and those that a point of a curve is the mean of."""
_PLACES = {"simulated": "networks", "quiet": "world without noise", "noisy": "world"}


def evaluations(store: Results, sweep: str = SWEEP) -> pd.DataFrame:
    """A row an evaluation of the seeds that all approaches have: task, approach, seed, evaluation, success (within 7 cm)."""
    rows = store.query(f"""
        SELECT task, approach, generations_per_evaluation AS generations, seed, evaluation, evals.success::INT AS success,
               cpu_s, robot_s
        FROM evals JOIN (SELECT run_id, sweep, cpu_s FROM runs WHERE status = 'ok' AND sweep = '{sweep}') USING (run_id, sweep)
        ORDER BY task, approach, generations, seed, evaluation""")
    have = rows.groupby(["task", "seed"]).approach.transform("nunique")
    return rows[have == rows.approach.nunique()]


def compared(rows: pd.DataFrame, approaches: Sequence[str] = APPROACHES, base_name: str = BASE) -> pd.DataFrame:
    """By task and approach: runs, per cent of success at the last evaluation with its Wilson interval, over the first and the
    last evaluations with bootstrap intervals over seeds, and the paired change of the latter from the base."""
    table = []
    for task in ceiling.TASKS:
        base = of_seeds(rows[(rows.task == task) & (rows.approach == base_name)])
        for approach in (name for name in approaches if name in set(rows.approach)):
            own = rows[(rows.task == task) & (rows.approach == approach)]
            shares = of_seeds(own)
            at_end = own[own.evaluation == own.evaluation.max()].success
            low, high = wilson(at_end.sum(), len(at_end))
            row = {"task": task, "approach": approach, "runs": len(shares), "end": 100 * at_end.mean()}
            row |= {"end_low": 100 * float(low), "end_high": 100 * float(high)}
            row |= {"cpu_s": own.groupby("seed").cpu_s.first().median()}
            for name, values in (("early", shares.early), ("last", shares["last"]), ("change", (shares - base)["last"])):
                row |= interval(name, values.to_numpy())
            table.append(row)
    return pd.DataFrame(table)


def of_seeds(own: pd.DataFrame) -> pd.DataFrame:
    """Shares of success of each seed, ``early`` and ``last``."""
    last = own.evaluation.max()
    parts = {"early": own[own.evaluation <= EARLY], "last": own[own.evaluation > last - LAST]}
    return pd.DataFrame({name: part.groupby("seed").success.mean() for name, part in parts.items()})


def interval(name: str, values: np.ndarray) -> dict[str, float]:
    """Mean in per cent and its interval over seeds."""
    low = high = float("nan")
    if len(values) >= FEWEST_SEEDS:
        low, high = (float(end) for end in band(resampled(len(values)) @ values / len(values)))
    return {name: 100 * float(values.mean()), f"{name}_low": 100 * low, f"{name}_high": 100 * high}


def in_words(table: pd.DataFrame) -> list[str]:
    """The rows of the table as the page shows them."""
    lines = []
    for row in table.itertuples():
        change = "" if row.approach == BASE else f"{row.change:+.0f} ({row.change_low:+.0f} to {row.change_high:+.0f})"
        lines.append(
            f"| {row.task} | `{row.approach}` | {row.end:.0f} % ({row.end_low:.0f}–{row.end_high:.0f}) "
            f"| {row.last:.0f} % ({row.last_low:.0f}–{row.last_high:.0f}) | {change.replace('-', '−')} | {row.early:.0f} % |"
        )
    return lines


def late_in_words(rows: pd.DataFrame, drives: pd.DataFrame, shown: str = "`{}`") -> list[str]:
    """Rows of the table of `LATE`: with the success of final controllers in the world, ``drives`` as `limits` takes them, and
    medians of a run's robot minutes and CPU seconds; approaches as ``shown``."""
    found, lines = limits(drives).set_index(["task", "approach"]), []
    names = sorted(set(rows.approach))
    for row in compared(rows, names, names[0]).itertuples():
        world = found.loc[(row.task, row.approach)]
        own = rows[(rows.task == row.task) & (rows.approach == row.approach) & (rows.evaluation == rows.evaluation.max())]
        lines.append(
            f"| {row.task} | {shown.format(row.approach)} | {row.end:.0f} % ({row.end_low:.0f}–{row.end_high:.0f}) "
            f"| {row.last:.0f} % ({row.last_low:.0f}–{row.last_high:.0f}) "
            f"| {world.noisy:.0f} % ({world.noisy_low:.0f}–{world.noisy_high:.0f}) | {row.early:.0f} % "
            f"| {own.robot_s.median() / 60:.0f} | {row.cpu_s:.1f} |"
        )
    return lines


def limits(drives: pd.DataFrame) -> pd.DataFrame:
    """By task and approach, per cent of success in each of `_PLACES` with bootstrap intervals over runs; ``drives``: the rows of
    `analysis.margins.margins`."""
    rows = []
    for (task, approach), own in drives.groupby(["task", "approach"]):
        row: dict[str, object] = {"task": task, "approach": approach, "runs": len(own)}
        for place in _PLACES:
            row |= interval(place, own[place].to_numpy(float))
        rows.append(row)
    return pd.DataFrame(rows)


def limits_in_words(found: pd.DataFrame) -> list[str]:
    """The rows of `limits` as the page shows them."""
    lines = []
    for task in ceiling.TASKS:
        for approach in APPROACHES:
            row = found[(found.task == task) & (found.approach == approach)].iloc[0]
            cells = (f"{row[place]:.0f} % ({row[f'{place}_low']:.0f}–{row[f'{place}_high']:.0f})" for place in _PLACES)
            lines.append(f"| {task} | `{approach}` | {' | '.join(cells)} |")
    return lines


@style()
def drawn(rows: pd.DataFrame, found: pd.DataFrame, possible: pd.DataFrame) -> Figure:
    """Success against evaluations above, what limits it below, a column a task."""
    figure = Figure(figsize=(PAGE_IN, 4.6))
    axes = figure.subplots(2, 3, sharey=True)
    for column, task in enumerate(ceiling.TASKS):
        most = float(possible[possible.task == task].success.iloc[0])
        for approach, colour in zip(APPROACHES, _COLOURS, strict=True):
            _curve(axes[0, column], rows[(rows.task == task) & (rows.approach == approach)], approach, colour)
        _bars(axes[1, column], found[found.task == task])
        for ax in axes[:, column]:
            ax.axhline(most, color=GREY, linestyle=":", linewidth=1, label="known controllers")
        title = lettered(column, 3, task_title("khepera", task))
        axes[0, column].set(xlabel="evaluation in the world", ylim=(0, 102), title=title)
    axes[0, 0].set_ylabel("successful runs (%)")
    axes[1, 0].set_ylabel("success of the final controllers (%)")
    figure.legend(*axes[0, 0].get_legend_handles_labels(), loc="outside upper center", ncols=3)
    return figure


def _curve(ax: Axes, own: pd.DataFrame, approach: str, colour: str) -> None:
    by_evaluation = own.groupby("evaluation").success.mean().rolling(LATEST, min_periods=1).mean()
    runs = own.seed.nunique()
    low, high = wilson(by_evaluation * runs, runs)
    ax.plot(by_evaluation.index, 100 * by_evaluation, color=colour, label=approach)
    ax.fill_between(by_evaluation.index, 100 * low, 100 * high, color=colour, alpha=0.15, linewidth=0)


def _bars(ax: Axes, found: pd.DataFrame) -> None:
    for number, approach in enumerate(APPROACHES):
        own, at = found[found.approach == approach].iloc[0], np.arange(len(_PLACES)) + 0.2 * (number - 1.5)
        heights = [own[place] for place in _PLACES]
        below = [own[place] - own[f"{place}_low"] for place in _PLACES]
        above = [own[f"{place}_high"] - own[place] for place in _PLACES]
        ax.bar(at, heights, 0.18, yerr=(below, above), color=_COLOURS[number], error_kw={"elinewidth": 0.8, "ecolor": GREY})
    ax.set_xticks(range(len(_PLACES)), [name.replace(" without", "\nwithout") for name in _PLACES.values()])


def main(arguments: Sequence[str] | None = None) -> int:
    """Print both tables and draw the figure."""
    parser = argparse.ArgumentParser(prog="python -m analysis.limits", description=__doc__.split("\n\n", maxsplit=1)[0])
    parser.add_argument("--runs", type=Path, default=PUBLISHED / "noise.parquet", help="archive of the sweep")
    parser.add_argument("--lists", type=Path, default=PUBLISHED / "ceiling.csv", help="lists of analysis.ceiling")
    parser.add_argument("--drives", type=Path, default=PUBLISHED / "noise-drives.csv", help="rows of analysis.margins")
    parser.add_argument("--out", type=Path, default=Path("noise.png"), help="figure (noise.png)")
    wanted = parser.parse_args(arguments)
    rows = evaluations(Results(wanted.runs, archived=True))
    found, possible = limits(pd.read_csv(wanted.drives)), ceiling.summary(pd.read_csv(wanted.lists))
    elsewhere = evaluations(Results(wanted.runs, archived=True), PHYSICS)
    for lines in (in_words(compared(rows)), in_words(compared(elsewhere)), limits_in_words(found)):
        print(*lines, sep="\n")
    print(possible.round(1).to_string(index=False))
    late = evaluations(Results(PUBLISHED / f"{LATE}.parquet", archived=True), LATE)
    print(*late_in_words(late, pd.read_csv(PUBLISHED / f"{LATE}-drives.csv")), sep="\n")
    with style():
        drawn(rows, found, possible).savefig(wanted.out)
    return 0


if __name__ == "__main__":
    raise SystemExit(main())
