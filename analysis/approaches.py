"""Approaches compared: success against evaluations and against robot minutes, and minutes until success lasts."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from analysis.approach_order import Look, in_order, looks
from analysis.approach_runs import (
    GROUP,
    OTHERS,
    done,
    groups,
    none_alike,
    on_the_same_seeds,
    pooled_over,
    varied,
    with_settings,
)
from analysis.figure_result import FigureResult
from analysis.intervals import FEWEST_SEEDS, INTERVALS, POOLED, band, resampled, wilson
from analysis.labels import counted, task_title
from analysis.results import Results
from analysis.robot_time import (
    LASTING,
    LATEST,
    minutes_until_lasting,
    of_latest,
    over_seeds,
    restricted_mean,
    success_by_minute,
    survival,
)
from bns.plotting.style import GREY, PAGE_IN, TEXT_PT, lettered, note, style

NAME = "approaches"
PAPER = "section 2.6, its approaches compared with BNS"
MINUTES = 60
_ACROSS = 3


def draw(store: Results) -> list[FigureResult]:
    others = ", ".join(f"done.{name}" for name in OTHERS)
    evals = store.query(
        f"""SELECT sweep, run_id, robot, task, world, approach, seed, {others}, evaluation, robot_s, evals.success,
               evaluated_fitness_error, cpu_s
        FROM evals JOIN {done(store)} AS done USING (run_id, sweep)
        ORDER BY sweep, robot, task, world, approach, run_id, evaluation"""
    )
    several = groups(with_settings(evals), (*GROUP, "task"))
    comparable = [own for own in map(_comparable, several) if len(own)]
    if not comparable:
        raise none_alike(several)
    look = looks(evals.approach)
    return [_draw(own, look) for own in comparable]


def _comparable(evals: pd.DataFrame) -> pd.DataFrame:
    """All runs where they differ in approach and seed alone, else those `on_the_same_seeds`."""
    return on_the_same_seeds(evals) if varied(evals) else evals


@style()
def _draw(evals: pd.DataFrame, look: Mapping[str, Look]) -> FigureResult:
    first = evals.iloc[0]
    bands, unit = (POOLED, "seeds") if varied(evals) else (f"bands: {INTERVALS}", "runs")
    approaches = in_order(evals.approach)
    rows = -(-len(approaches) // _ACROSS)
    figure = Figure(figsize=(PAGE_IN, 3.4 + 1.5 * rows))
    above, below = figure.subfigures(2, 1, height_ratios=(3.4, 1.5 * rows))
    axes = above.subplots(1, 3)
    singles = below.subplots(rows, _ACROSS, sharex=True, sharey=True, squeeze=False).ravel()
    numbers = {name: _numbers(evals[evals.approach == name]) for name in approaches}
    horizon = float(evals.groupby("approach").robot_s.max().min()) / 60
    for name, ax in zip(approaches, singles, strict=False):
        by_evaluation, by_minute, until = numbers[name]
        _curve(axes[0], by_evaluation.evaluation, by_evaluation, look[name], name)
        _curve(axes[1], by_minute.minute, by_minute, look[name], name)
        times, share = survival(until.minutes, until.ended)
        axes[2].step([*times, until.minutes.max()], [*(100 * share), 100 * share[-1]], where="post", **look[name])
        _single(ax, by_minute, numbers[approaches[0]][1], look[name])
        ax.set_title(name)
    for blank in singles[len(approaches) :]:
        blank.set_axis_off()
    axes[0].set(xlabel="evaluation in the world", ylabel="successful runs (%)")
    axes[1].set(xlabel="robot time (min)")
    axes[2].set(xlabel="robot time (min)", ylabel="runs without lasting success (%)")
    for number, title in enumerate(("by evaluation", "by robot time", "until success lasts")):
        axes[number].set_title(lettered(number, 3, title))
    for ax in (*axes, singles[0]):
        ax.set(ylim=(-2, 102))
    below.supxlabel("robot time (min)", fontsize=TEXT_PT)
    below.supylabel("successful runs (%)", fontsize=TEXT_PT)
    above.legend(*axes[0].get_legend_handles_labels(), loc="outside upper center", ncols=3)
    n, least = evals.run_id.nunique(), int(evals.groupby("approach").run_id.nunique().min())
    where = f"{task_title(first.robot, first.task)}, world {first.world}"
    note(
        figure,
        f"{where}; {counted(n, 'run')}, {least} at least of each approach. Curves: mean of the latest {LATEST} evaluations; "
        f"{bands}; grey: {approaches[0]}.",
    )
    shows = (
        f"Task {where}, {first.sweep}. (a, b) Fraction of runs whose fittest controller completes the task after so many "
        f"evaluations, and robot minutes (all drives counted, with the spec's overhead), mean of the latest {LATEST}; "
        f"below, each approach alone with its interval, and {approaches[0]} in grey. (c) Fraction of runs in which {LASTING} "
        "successes in a row have not begun yet (Kaplan-Meier). Mean minutes until lasting success: restricted to the first "
        f"{horizon:.0f} min, which every approach was driven, with 95 % bootstrap intervals over {unit}."
        f"{pooled_over(evals)} n = {n} runs, {least} at least of each approach; {bands}."
    )
    table = pd.DataFrame([_row(name, evals[evals.approach == name], numbers[name], horizon) for name in approaches])
    name = f"{NAME}-{first.sweep}-{first.robot}-{first.task}-{str(first.world).split('/')[-1].removesuffix('.yaml')}"
    return FigureResult(
        name, f"Approaches compared: {where}", figure, shows, n, (str(first.sweep),), data=table, table=table
    )


def _numbers(own: pd.DataFrame) -> tuple[pd.DataFrame, pd.DataFrame, pd.DataFrame]:
    """Success by evaluation and by minute, and minutes until it lasts (with the seed), of one approach."""
    latest = own.assign(success=of_latest(own))
    minutes = np.linspace(0, own.groupby("run_id").robot_s.max().min() / 60, MINUTES)
    by_evaluation, by_minute = _by_evaluation(latest), success_by_minute(latest, minutes)
    if varied(own):
        of_seeds = [one for _, one in latest.groupby("seed")]
        by_evaluation = over_seeds(by_evaluation, [_by_evaluation(one) for one in of_seeds], "evaluation")
        by_minute = over_seeds(by_minute, [success_by_minute(one, minutes) for one in of_seeds], "minute")
    return by_evaluation, by_minute, minutes_until_lasting(own).merge(own[["run_id", "seed"]].drop_duplicates(), on="run_id")


def _by_evaluation(latest: pd.DataFrame) -> pd.DataFrame:
    """Share of successes at each evaluation, with Wilson intervals."""
    counts = latest.groupby("evaluation").success.agg(runs="count", successes="sum").reset_index()
    low, high = wilson(counts.successes, counts.runs)
    return counts.assign(low=low, high=high)


def _curve(ax: Axes, x: pd.Series, rows: pd.DataFrame, look: Look, label: str) -> None:
    ax.plot(x, 100 * rows.successes / rows.runs, label=label, **look)


def _single(ax: Axes, rows: pd.DataFrame, reference: pd.DataFrame, look: Look) -> None:
    """One approach by robot time, with its band, before the reference."""
    ax.plot(reference.minute, 100 * reference.successes / reference.runs, color=GREY, linewidth=0.8)
    ax.fill_between(rows.minute, 100 * rows.low, 100 * rows.high, color=look["color"], alpha=0.2, linewidth=0)
    _curve(ax, rows.minute, rows, look, "")


def _row(
    approach: str, own: pd.DataFrame, numbers: tuple[pd.DataFrame, pd.DataFrame, pd.DataFrame], horizon: float
) -> dict[str, object]:
    """What the table says of an approach; ``horizon``: robot minutes to which the mean until lasting success is restricted."""
    by_evaluation, _, until = numbers
    last = by_evaluation.iloc[-1]
    return {
        "approach": approach,
        "runs": int(last.runs),
        f"success in the last {LATEST} evaluations (%)": round(100 * last.successes / last.runs),
        "low (%)": round(100 * last.low),
        "high (%)": round(100 * last.high),
        "lasting success (runs)": int(until.ended.sum()),
        f"mean minutes until it, within {horizon:.0f}": _minutes(until, horizon),
        "robot minutes of a run": round(float(own.groupby("run_id").robot_s.max().median() / 60), 1),
        "error of fitness of the driven, median (1/m)": round(float(own.evaluated_fitness_error.median()), 3),
        "CPU seconds of a run, median": float(f"{own.groupby('run_id').cpu_s.first().median():.2g}"),
    }


def _minutes(until: pd.DataFrame, horizon: float) -> str:
    """The restricted mean with its interval, from enough seeds on; the runs of a seed are drawn together."""
    at = float(restricted_mean(until.minutes, until.ended, horizon)[0])
    place, seeds = pd.factorize(until.seed)
    if len(seeds) < FEWEST_SEEDS:
        return f"{at:.1f}"
    low, high = band(restricted_mean(until.minutes, until.ended, horizon, resampled(len(seeds))[:, place]))
    return f"{at:.1f} ({low:.1f} to {high:.1f})"
