"""Approaches two by two: the probability that a run of one does better than a run of another, with tests of all pairs."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from itertools import combinations
from typing import Any

import numpy as np
import pandas as pd
from matplotlib.axes import Axes

from analysis.approach_order import in_order
from analysis.approach_runs import groups, on_the_same_seeds, pooled_over, titled, varied_in_any
from analysis.approach_summary import of_each_run
from analysis.figure_result import FigureResult
from analysis.intervals import FEWEST_SEEDS, band
from analysis.multiple_tests import holm
from analysis.results import NoDataError, Results, among
from analysis.robot_time import LASTING, minutes_until_lasting
from bns.plotting.style import lettered, note, panels, style

NAME = "approach-pairs"
PAPER = "section 2.6, its approaches compared with BNS"
DRAWS = 5000
LEVEL = 0.05
MEASURES = {"late": "more success, late", "minutes": "sooner to lasting success"}
_STREAM = 20260201
"""Seed of bootstrap and permutations: the same results give the same table."""


def draw(store: Results) -> list[FigureResult]:
    runs = of_each_run(store)
    evals = store.query(
        f"""SELECT sweep, run_id, robot_s, success FROM evals
        WHERE {among("sweep", runs.sweep.unique())} ORDER BY sweep, run_id, evaluation"""
    )
    drawn, several = [], groups(runs)
    for own in several:
        alike, sweep = on_the_same_seeds(own), own.sweep.iloc[0]
        drawn.append(_draw(scores(alike, evals[(evals.sweep == sweep) & evals.run_id.isin(alike.run_id)])))
    if not (some := [one for one in drawn if one is not None]):
        names = varied_in_any(several)
        also = f", with every {titled(names)}" if names else ""
        raise NoDataError(
            f"no two approaches have {FEWEST_SEEDS} runs each on the same task and seeds{also}; run bns sweep approaches"
        )
    return some


def scores(runs: pd.DataFrame, evals: pd.DataFrame) -> pd.DataFrame:
    """The runs with ``late`` (share of late evaluations with success) and ``minutes`` (of robot time until success lasts,
    negative, so that more is better; minus infinity if it never does).

    ``runs``: as `of_each_run` gives them; ``evals``: their run_id, robot_s and success, in the order of the evaluations.
    """
    until = minutes_until_lasting(evals).set_index("run_id").reindex(runs.run_id)
    return runs.assign(late=runs.success_late, minutes=-until.minutes.where(until.ended, np.inf).to_numpy())


def improvement(one: np.ndarray, other: np.ndarray) -> float:
    """Probability that a run of ``one`` (n,) is better than a run of ``other`` (m,), ties counted half.

    Times n and m it is the statistic of Mann and Whitney (1947); averaged over tasks it is the probability of improvement
    of Agarwal et al., "Deep Reinforcement Learning at the Edge of the Statistical Precipice" (2021).
    """
    return float(_wins(one, other).mean())


def _wins(one: np.ndarray, other: np.ndarray) -> np.ndarray:
    """1 where the run of the row is better than that of the column, a half where they are equal; (n, m)."""
    return (one[:, None] > other) + (one[:, None] == other) / 2


def _times_drawn(places: np.ndarray) -> np.ndarray:
    """How often each place was drawn, (draws, n), of the places drawn, (draws, n)."""
    draws, n = places.shape
    of_all = (places + n * np.arange(draws)[:, None]).ravel()
    return np.bincount(of_all, minlength=draws * n).reshape(draws, n).astype(float)


def _summed(wins: np.ndarray, one: np.ndarray, other: np.ndarray) -> np.ndarray:
    """Wins of all pairs in each draw, (draws,): ``one`` (draws, n), ``other`` (draws, m) say how often each run is in it."""
    return np.einsum("dm,dm->d", one @ wins, other)


def compared(by_task: Mapping[str, tuple[np.ndarray, np.ndarray]]) -> dict[str, float]:
    """Probability of improvement, averaged over tasks, its interval and p-value.

    Args:
        by_task: scores of both approaches on each task, (runs,) or (settings, runs) each; the same place is the same seed. The
            runs of a seed at all settings are drawn and exchanged together: they share its luck.

    Returns:
        ``probability``; ``low``, ``high``: 95 % percentile bootstrap, runs drawn within tasks, as Agarwal et al. do; ``p``: of
        the two-sided test that exchanges the two runs of a seed at random.
    """
    random = np.random.default_rng(_STREAM)
    settings = {task: list(zip(*map(np.atleast_2d, both), strict=True)) for task, both in by_task.items()}
    at = float(np.mean([np.mean([improvement(a, b) for a, b in own]) for own in settings.values()]))
    boot, exchanged = np.zeros(DRAWS), np.zeros(DRAWS)
    for own in settings.values():
        n = len(own[0][0])
        often = [_times_drawn(random.integers(0, n, (DRAWS, n))) for _ in range(2)]
        swap = (random.random((DRAWS, n)) < 0.5).astype(float)  # a fair coin
        picked = np.hstack([1 - swap, swap])
        for a, b in own:
            both, share = np.concatenate([a, b]), n**2 * len(by_task) * len(own)
            boot += _summed(_wins(a, b), *often) / share
            exchanged += _summed(_wins(both, both), picked, 1 - picked) / share
    extreme = np.count_nonzero(np.abs(exchanged - 0.5) >= abs(at - 0.5) - 1e-12)
    low, high = band(boot)
    return {"probability": at, "low": float(low), "high": float(high), "p": (1 + extreme) / (1 + DRAWS)}


def pairs(runs: pd.DataFrame) -> pd.DataFrame:
    """A row a pair of approaches: one, other, runs (of each), and for each measure the columns of `compared` and ``p_holm``."""
    rows = list(_pairs(runs))
    table = pd.DataFrame(rows)
    for measure in MEASURES if rows else ():
        table[f"{measure}_p_holm"] = holm(table[f"{measure}_p"])
    return table


def _pairs(runs: pd.DataFrame) -> Iterator[dict[str, Any]]:
    for one, other in combinations(in_order(runs.approach), 2):
        on = ["task", "setting", "seed"]
        both = runs[runs.approach == one].merge(runs[runs.approach == other], on=on, suffixes=("", "_other")).drop_duplicates(on)
        place = both.groupby("task").seed.transform(lambda seeds: pd.factorize(seeds)[0])
        both = both.assign(place=place).sort_values(["task", "setting", "place"])
        both = both[both.groupby(["task", "seed"]).setting.transform("size") == both.groupby("task").setting.transform("nunique")]
        least = both.groupby("task").seed.nunique().min() if len(both) else 0
        if least < FEWEST_SEEDS:
            continue
        row: dict[str, Any] = {"one": one, "other": other, "runs": len(both)}
        for measure in MEASURES:
            by_task = {task: _by_setting(own, measure) for task, own in both.groupby("task")}
            row |= {f"{measure}_{name}": value for name, value in compared(by_task).items()}
        yield row


def _by_setting(both: pd.DataFrame, measure: str) -> tuple[np.ndarray, np.ndarray]:
    """Scores of two approaches, each (settings, seeds), of rows in that order."""
    shape = (both.setting.nunique(), -1)
    return both[measure].to_numpy().reshape(shape), both[f"{measure}_other"].to_numpy().reshape(shape)


@style()
def _draw(runs: pd.DataFrame) -> FigureResult | None:
    table = pairs(runs)
    if table.empty:
        return None
    first = runs.iloc[0]
    names = in_order({*table.one, *table.other})
    figure, axes = panels(2, 0.9 + 0.36 * len(names))
    for number, (measure, title) in enumerate(MEASURES.items()):
        _matrix(axes[number, 0], table, names, measure)
        axes[number, 0].set_title(lettered(number, 2, title))
        axes[number, 0].set_yticks(range(len(names)), [f"{i} {name}" for i, name in enumerate(names, 1)] if not number else [])
    n, tasks = len(runs), sorted(set(runs.task))
    each = int(table.runs.min())
    where = f"{first.robot}, tasks {', '.join(tasks)}, world {first.world}"
    means = "Numbers: the probability (%) that a run of the row does better than a run of the column"
    note(figure, f"{where}. {means}; bold: certainly not 50 (adjusted p < {LEVEL}); {each} runs at least on each side.")
    shows = (
        f"{where}, sweep {first.sweep}. {means}, ties counted half, averaged over tasks. (a) Score: share of successes among the "
        f"evaluations of the last third. (b) Score: robot time until the first of {LASTING} successes in a row. Bold: p < "
        f"{LEVEL} when the two runs of a seed are exchanged at random ({DRAWS:,} times), adjusted for all pairs (Holm)."
        f"{pooled_over(runs)} n = {n} runs."
    )
    world = str(first.world).split("/")[-1].removesuffix(".yaml")
    return FigureResult(
        f"{NAME}-{first.sweep}-{first.robot}-{world}", f"Approaches two by two: {where}", figure, shows, n, (str(first.sweep),),
        data=table, table=_in_words(table),
    )  # fmt: skip


def _matrix(ax: Axes, table: pd.DataFrame, names: list[str], measure: str) -> None:
    """A square of percentages, the row against the column."""
    shares = np.full((len(names), len(names)), np.nan)
    for row in table.to_dict("records"):
        i, j, share = names.index(row["one"]), names.index(row["other"]), 100 * row[f"{measure}_probability"]
        shares[i, j], shares[j, i] = share, 100 - share
        bold = {"fontweight": "bold"} if row[f"{measure}_p_holm"] < LEVEL else {}
        for y, x in ((i, j), (j, i)):
            ax.text(x, y, f"{shares[y, x]:.0f}", ha="center", va="center", **bold)
    ax.imshow(np.ma.masked_invalid(shares), cmap="PuOr", vmin=-40, vmax=140, aspect="auto")
    ax.set_xticks(range(len(names)), [str(number) for number in range(1, len(names) + 1)])
    ax.grid(visible=False)


def _in_words(table: pd.DataFrame) -> pd.DataFrame:
    """The pairs as the page shows them."""
    said: dict[str, Any] = {"approach": table.one, "against": table.other, "runs of each": table.runs}
    for measure, title in MEASURES.items():
        ends = zip(*(100 * table[f"{measure}_{name}"] for name in ("probability", "low", "high")), strict=True)
        said[f"{title} (%)"] = [f"{at:.0f} ({low:.0f} to {high:.0f})" for at, low, high in ends]
        said[f"{title}: adjusted p"] = [f"{p:.2g}" for p in table[f"{measure}_p_holm"]]
    return pd.DataFrame(said)
