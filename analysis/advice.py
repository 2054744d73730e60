"""The dissertation's advice as a rule for a newcomer: low mutation and a large population. What does following it cost?

Sections 4.6, 5.9 and 6.2 come to that advice. Its *regret* is how much more the best combination would have brought. The best
of 500 is lucky on the seeds that it was chosen by, so it is chosen on all seeds but one and judged on that one, in turn.
"""

from __future__ import annotations

import numpy as np
import pandas as pd

from analysis.figure_result import FigureResult
from analysis.intervals import FEWEST_SEEDS, band, resampled
from analysis.labels import CELL, task_title
from analysis.outcomes import criterion, successes_by_seed
from analysis.ranking import by_seed_array
from analysis.results import NoDataError, Results
from analysis.selection import Selection, selections

NAME = "advice"
PAPER = "the advice of sections 4.6, 5.9 and 6.2"
LATE = 0.8
"""Evaluations that count: those beyond this share of a run. The last one alone says too little to tell 500 combinations apart."""


def draw(store: Results) -> list[FigureResult]:
    return [_draw(store, chosen) for chosen in selections(store)]


def _draw(store: Results, chosen: Selection) -> FigureResult:
    rows = [row for task in chosen.tasks if (row := regret(*late(store, chosen, task), task)) is not None]
    if not rows:
        needed = f"{FEWEST_SEEDS} seeds of several of both are needed"
        raise NoDataError(f"the advice is about mutation rates and population sizes: {needed}")
    data = pd.DataFrame(rows)
    shows = (
        f"Success in the last fifth of a run (the fittest controller {criterion(store, chosen)}) with the dissertation's advice: "
        "the lowest mutation rate and the largest population, the mean over all values of the other parameters; of a combination "
        "drawn at random; and of the best one, chosen on all seeds but one and judged on that one, in turn. 95 % bootstrap "
        f"intervals over seeds. n = {chosen.n:,} runs."
    )
    title = "What the dissertation's advice costs"
    return FigureResult(
        f"{NAME}-{chosen.robot}", title, None, shows, chosen.n, chosen.sweeps, data=data, table=table(chosen.robot, data)
    )


def late(store: Results, chosen: Selection, task: str) -> tuple[pd.DataFrame, np.ndarray, np.ndarray]:
    """Combinations (rows), and successes and evaluations (seeds, combinations) in the last fifth of a task's runs."""
    length = f"(SELECT max(evaluations) FROM ({chosen.sql}))"
    rows = successes_by_seed(store, chosen, CELL, f"task = '{task}' AND evaluation > {LATE} * {length}")
    cells = rows[list(CELL)].drop_duplicates().sort_values(list(CELL)).reset_index(drop=True)
    numbered = rows.merge(cells.reset_index(names="cell"), on=list(CELL))
    (sums, _), (counts, _) = (by_seed_array(numbered, name, "cell") for name in ("successes", "runs"))
    return cells, sums, counts


def regret(cells: pd.DataFrame, sums: np.ndarray, counts: np.ndarray, task: str) -> dict[str, object] | None:
    """Success in per cent by the advice, at random and of the best, and the advice's regret; None where nothing can be chosen.

    cells: combinations (rows); sums and counts: successes and runs (seeds, combinations). Seeds without all combinations are
    left out.
    """
    whole = (counts > 0).all(axis=1)
    rates = 100 * sums[whole] / counts[whole]
    several = cells.mutation_rate.nunique() > 1 and cells.population_size.nunique() > 1
    if len(rates) < FEWEST_SEEDS or not several:
        return None
    careful, many = cells.mutation_rate == cells.mutation_rate.min(), cells.population_size == cells.population_size.max()
    advised = (careful & many).to_numpy()
    best = np.array([rates[seed, _best(rates, seed)] for seed in range(len(rates))])
    found = {"advice": rates[:, advised].mean(axis=1), "random": rates.mean(axis=1), "best": best}
    found |= {"regret": best - found["advice"], "gain": found["advice"] - found["random"]}
    row: dict[str, object] = {"task": task, "seeds": len(rates), "combinations": len(cells), "advised": int(advised.sum())}
    for name, values in found.items():
        low, high = band(resampled(len(values)) @ values / len(values))
        row |= {name: float(values.mean()), f"{name}_low": float(low), f"{name}_high": float(high)}
    return row


def _best(rates: np.ndarray, judged: int) -> int:
    """The best combination on all seeds but one; of several, the first."""
    return int(np.delete(rates, judged, axis=0).mean(axis=0).argmax())


def table(robot: str, rows: pd.DataFrame) -> pd.DataFrame:
    """In words."""
    titles = {"advice": "as advised (%)", "random": "at random (%)", "best": "the best (%)", "regret": "regret (points)"}
    said = {"task": [task_title(robot, task) for task in rows.task], "seeds": rows.seeds, "combinations": rows.combinations}
    for name, title in titles.items():
        said[title] = [
            f"{value:.0f} ({low:.0f} to {high:.0f})"
            for value, low, high in zip(rows[name], rows[f"{name}_low"], rows[f"{name}_high"], strict=True)
        ]
    return pd.DataFrame(said)
