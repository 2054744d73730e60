"""Section 6.4: is a simulator that develops with its controllers worse on random behaviour than a pre-computed one?

`python -m analysis.random_behaviour` writes down what the page of what replicates shows of it. `sweeps/random-behaviour.yaml`
makes the runs: BNS, and networks that are trained once on as many random drives. Both are asked
where ten random controllers of five commands end (as in figure 4.17b). The same seeds have the same ten controllers.
"""

from __future__ import annotations

import argparse
from pathlib import Path

import numpy as np
import pandas as pd

from analysis.figure_result import FigureResult
from analysis.intervals import FEWEST_SEEDS, band, resampled
from analysis.labels import task_title
from analysis.results import NoDataError, Results

NAME = "random-behaviour"
PAPER = "section 6.4"


def draw(store: Results) -> list[FigureResult]:
    runs = of_each_run(store)
    data = compared(runs)
    shows = (
        "Distance between where ten random controllers of five commands end in the simulator at the end of a run and in the "
        "world, mean of the ten, then over runs: networks of Bootstrapped Neuro-Simulation, and networks trained once on as many "
        f"random drives. 95 % bootstrap intervals over seeds, from {FEWEST_SEEDS} on; the difference is paired by seed. "
        f"n = {len(runs)} runs."
    )
    title = "Simulators on random behaviour"
    return [FigureResult(NAME, title, None, shows, len(runs), (NAME,), data=data, table=table(data))]


def of_each_run(store: Results) -> pd.DataFrame:
    """A row a finished run: task, whether its simulator is pre-computed, seed, evaluations, distance_m at the last of them.

    Raises:
        NoDataError: there is none.
    """
    runs = store.query(f"""
        SELECT task, starts_with(approach, 'precomputed') AS precomputed, seed, any_value(evaluations) AS evaluations,
               avg(distance_m) AS distance_m
        FROM probes JOIN (SELECT run_id, sweep, seed, approach, evaluations FROM runs WHERE status = 'ok') USING (run_id, sweep)
        WHERE sweep = '{NAME}' AND evaluation = evaluations GROUP BY task, precomputed, seed ORDER BY ALL""")
    if runs.empty:
        raise NoDataError(f"no run of the sweep {NAME} is finished; run bns sweep {NAME}")
    return runs


def compared(runs: pd.DataFrame) -> pd.DataFrame:
    """A row a task: drives, seeds, distance of either simulator and the difference, m, each with its interval."""
    rows = []
    for task, own in runs.groupby("task"):
        pairs = own.pivot_table(index="seed", columns="precomputed", values="distance_m").dropna()
        if pairs.shape[1] < 2 or pairs.empty:
            continue
        found = {"bns": pairs[False], "precomputed": pairs[True], "difference": pairs[False] - pairs[True]}
        row: dict[str, object] = {"task": task, "drives": int(own.evaluations.iloc[0]), "seeds": len(pairs)}
        for name, values in found.items():
            ends = (np.nan, np.nan)
            if len(pairs) >= FEWEST_SEEDS:
                ends = tuple(map(float, band(resampled(len(pairs)) @ values.to_numpy() / len(pairs))))
            row |= {name: float(values.mean()), f"{name}_low": ends[0], f"{name}_high": ends[1]}
        rows.append(row)
    if not rows:
        raise NoDataError(f"no seed of the sweep {NAME} has both simulators yet")
    return pd.DataFrame(rows)


def table(rows: pd.DataFrame) -> pd.DataFrame:
    """In words."""
    titles = {"bns": "BNS (cm)", "precomputed": "pre-computed (cm)", "difference": "difference (cm)"}
    said = {"task": [task_title("khepera", task) for task in rows.task], "drives": rows.drives, "seeds": rows.seeds}
    for name, title in titles.items():
        said[title] = [
            f"{100 * value:.1f}" + ("" if np.isnan(low) else f" ({100 * low:.1f} to {100 * high:.1f})")
            for value, low, high in zip(rows[name], rows[f"{name}_low"], rows[f"{name}_high"], strict=True)
        ]
    return pd.DataFrame(said)


def main() -> None:
    """A row a run, distances to a tenth of a millimetre."""
    parser = argparse.ArgumentParser(prog="python -m analysis.random_behaviour", description=__doc__)
    parser.add_argument("--results", type=Path, default=Path("results"))
    parser.add_argument("--out", type=Path, default=Path("results/published/random-behaviour.csv"))
    wanted = parser.parse_args()
    of_each_run(Results(wanted.results)).round({"distance_m": 4}).to_csv(wanted.out, index=False)


if __name__ == "__main__":
    main()
