"""Approaches in one table for each world: success late and early in a run, robot time and CPU time."""

from __future__ import annotations

import numpy as np
import pandas as pd

from analysis.approach_order import in_order
from analysis.approach_runs import OTHERS, done, groups, none_alike, on_the_same_seeds, pooled_over, with_settings
from analysis.figure_result import FigureResult
from analysis.intervals import bootstrap
from analysis.results import Results

NAME = "approach-summary"
PAPER = "section 2.6, its approaches compared with BNS"
_EVALUATIONS = {"late": "3 * evaluation > 2 * evaluations", "early": "3 * evaluation <= evaluations"}


def draw(store: Results) -> list[FigureResult]:
    several = groups(of_each_run(store))
    tables = [_table(alike) for own in several if len(alike := on_the_same_seeds(own))]
    if not tables:
        raise none_alike(several)
    return tables


def of_each_run(store: Results) -> pd.DataFrame:
    """A row a finished run of a sweep with several approaches: what it is, `OTHERS`, ``setting`` (their combination),
    ``success_late`` ..., ``near_early`` (share of successes, by the task's own criterion and within 10 cm), ``robot_min`` and
    ``cpu_s``."""
    shares = ", ".join(
        f"avg(evals.{column}::INT) FILTER ({when}) AS {name}_{part}"
        for name, column in (("success", "success"), ("near", "success_10cm"))
        for part, when in _EVALUATIONS.items()
    )
    others = ", ".join(f"done.{name}" for name in OTHERS)
    return with_settings(
        store.query(f"""
        SELECT sweep, run_id, robot, task, world, approach, seed, {others}, {shares},
               max(robot_s) / 60 AS robot_min, any_value(cpu_s) AS cpu_s
        FROM evals JOIN {done(store)} AS done USING (run_id, sweep)
        GROUP BY ALL ORDER BY ALL""")
    )


def summarized(runs: pd.DataFrame) -> pd.DataFrame:
    """A row an approach: runs, seeds, means over tasks of the shares of `of_each_run` with the ends of their interval over seeds
    (per cent), ``robot_min`` and ``cpu_s`` (medians)."""
    rows = []
    for approach in in_order(runs.approach):
        own = runs[runs.approach == approach]
        row: dict[str, object] = {"approach": approach, "runs": len(own), "seeds": own.seed.nunique()}
        for name in [f"{what}_{part}" for what in ("success", "near") for part in _EVALUATIONS]:
            by_seed = own.groupby("seed")[name].agg(["sum", "count"])
            low, high = bootstrap(by_seed["sum"].to_numpy(float), by_seed["count"].to_numpy(float))
            row |= {name: 100 * own[name].mean(), f"{name}_low": 100 * float(low), f"{name}_high": 100 * float(high)}
        rows.append(row | {"robot_min": own.robot_min.median(), "cpu_s": own.cpu_s.median()})
    return pd.DataFrame(rows)


def in_words(table: pd.DataFrame) -> pd.DataFrame:
    """The table as pages show it."""
    titles = {"success_late": "within 7 cm, late", "near_late": "within 10 cm, late", "near_early": "within 10 cm, early"}
    if table.near_late.isna().all():
        titles = {"success_late": "success, late", "success_early": "success, early"}
    said: dict[str, list[str]] = {"approach": list(table.approach)}
    for name, title in titles.items():
        said[title] = [_share(row[name], row[f"{name}_low"], row[f"{name}_high"]) for row in table.to_dict("records")]
    said["robot min"] = [f"{minutes:.0f}" for minutes in table.robot_min]
    said["CPU s"] = [f"{seconds:.2g}" for seconds in table.cpu_s]
    return pd.DataFrame(said)


def _share(at: float, low: float, high: float) -> str:
    return f"{at:.0f} %" + (f" ({low:.0f}–{high:.0f})" if np.isfinite(low) else "")


def _table(runs: pd.DataFrame) -> FigureResult:
    first, table = runs.iloc[0], summarized(runs)
    tasks, n = sorted(set(runs.task)), len(runs)
    where = f"{first.robot}, world {first.world}"
    shows = (
        f"{where}, sweep {first.sweep}. Success of the fittest controller, mean over the tasks {', '.join(tasks)}; late: the "
        "last third of a run's evaluations, early: the first. Intervals: 95 %, bootstrap over seeds. Robot and CPU time: "
        f"medians.{pooled_over(runs)} n = {n} runs, {int(table.seeds.min())} seeds at least of each approach."
    )
    world = str(first.world).split("/")[-1].removesuffix(".yaml")
    name, title = f"{NAME}-{first.sweep}-{first.robot}-{world}", f"Approaches in one table: {where}"
    return FigureResult(name, title, None, shows, n, (str(first.sweep),), data=table, table=in_words(table))
