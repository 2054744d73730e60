"""The evaluations of comparable runs in one small table in memory, which nearly all figures are counted from."""

from __future__ import annotations

import hashlib
from collections.abc import Sequence

import pandas as pd

from analysis.labels import CELL
from analysis.results import Results, among, remembered
from analysis.selection import Selection
from bns.store.schema import NEAR_CM

NEAR = tuple(f"success_{cm}cm" for cm in NEAR_CM)
COMBINATIONS, RUNS = 500, 30
"""That the dissertation compared on each task, and of each combination (section 4.5)."""
FEWEST = 5
"""Runs behind a curve or dot; thinner ones jump between 0 and 100 % and are left out."""
FEWEST_PLANNED = 2
"""Runs behind a dot of a sweep that asks for no more: less can never be drawn of it, and the intervals say how little that is."""
FEWEST_OF_ALL = 3
"""Runs behind a dot where all combinations have so many: those of them that have `FEWEST` were chosen by another sweep's plan,
and stand for fewer values of the parameters. Three runs have a majority; two may have none."""
_KEPT = ("success", *NEAR, "ever_success", "diversity", "fitness_error", "fitness_world")


@remembered
def fewest(store: Results, chosen: Selection) -> int:
    """Runs that a combination must have to be drawn and ranked: `FEWEST`, or all that are asked for of it, where that is less.

    It is fewer, down to `FEWEST_OF_ALL`, where every combination of the largest sweep has so many and not all have `FEWEST`.
    """
    plans = [store.plans[sweep] for sweep in chosen.sweeps if sweep in store.plans]
    if not plans:
        return FEWEST
    least = min(FEWEST, max(FEWEST_PLANNED, *(plan.seeds for plan in plans)))
    runs = store.query(f"SELECT count(*) AS n FROM {last_outcomes(store, chosen)} GROUP BY task, {', '.join(CELL)}").n
    of_all = int(runs.min()) if len(runs) and len(runs) >= max(plan.cells for plan in plans) else 0
    return min(least, of_all) if of_all >= FEWEST_OF_ALL else least


def outcomes(store: Results, chosen: Selection) -> str:
    """Name of a table with a row an evaluation: task, the four parameters, seed, root_seed, evaluation, whether it is the
    run's last, successes of the fittest controller, ever_success, diversity, fitness_error, fitness_world."""
    return _kept(store, chosen, "outcomes", "true")


def last_outcomes(store: Results, chosen: Selection) -> str:
    """As `outcomes`, each run's last evaluation alone: much sooner read where a figure needs no more."""
    return _kept(store, chosen, "last_outcomes", "evaluation = evaluations")


def _kept(store: Results, chosen: Selection, name: str, where: str) -> str:
    digest = hashlib.sha256(chosen.sql.encode()).hexdigest()[:12]
    return store.keep(
        f"{name}_{digest}",
        f"""SELECT task, {", ".join(CELL)}, seed, root_seed, evaluation, evaluation = evaluations AS last,
        {", ".join(_KEPT)} FROM evals JOIN ({chosen.sql}) AS chosen USING (run_id, sweep) WHERE {where}""",
    )


@remembered
def radii_cm(store: Results, chosen: Selection) -> tuple[int, ...]:
    """Goal radii that successes of these runs are known at; none where a task has goal regions instead of points."""
    known = store.query(f"SELECT {', '.join(f'count({name}) AS {name}' for name in NEAR)} FROM {last_outcomes(store, chosen)}")
    return tuple(cm for cm, name in zip(NEAR_CM, NEAR, strict=True) if known[name][0])


def criterion(store: Results, chosen: Selection) -> str:
    """What ``success`` means for these runs: ``visits all goals within 7 cm``."""
    near = radii_cm(store, chosen)
    return f"visits all goals within {near[0]} cm" if near else "visits all goals"


def by_value(store: Results, chosen: Selection, parameter: str, success: str = "success") -> pd.DataFrame:
    """Runs and successes (`success` or `ever_success`) of each task, value of ``parameter``, evaluation and seed."""
    return store.query(f"""
        SELECT task, {parameter} AS value, evaluation, root_seed, seed, count({success}) AS runs,
               count(*) FILTER ({success}) AS successes
        FROM {outcomes(store, chosen)} WHERE {success} IS NOT NULL GROUP BY ALL ORDER BY ALL""")


def at_the_end(store: Results, chosen: Selection) -> pd.DataFrame:
    """Of each task and combination at its last evaluation: runs, successes, means of diversity, error and fitness."""
    counts = ", ".join(f"count(*) FILTER ({name}) AS {name}" for name in ("success", *NEAR))
    return store.query(f"""
        SELECT task, {", ".join(CELL)}, count(*) AS runs, {counts},
               {_mean("diversity")}, {_mean("fitness_error")}, {_spread("fitness_error")}, {_mean("fitness_world")}
        FROM {last_outcomes(store, chosen)} GROUP BY ALL ORDER BY ALL""")


def successes_by_seed(store: Results, chosen: Selection, columns: Sequence[str], where: str) -> pd.DataFrame:
    """Runs and successes of each seed and group of ``columns``: what a bootstrap over seeds draws from."""
    return _by_seed(store, chosen, columns, where, ())


def by_seed(store: Results, chosen: Selection, columns: Sequence[str], where: str) -> pd.DataFrame:
    """As `successes_by_seed`, with successes within 20 cm and summed diversity."""
    more = (
        "sum(success_20cm::INT) AS successes_20cm",
        "sum(diversity) FILTER (isfinite(diversity)) AS diversity",
        "count(*) FILTER (isfinite(diversity)) AS diversities",
    )
    return _by_seed(store, chosen, columns, where, more)


def within_by_seed(store: Results, chosen: Selection, columns: Sequence[str], where: str, column: str) -> pd.DataFrame:
    """As `successes_by_seed`, with ``within``: how often ``column`` (success_10cm, say) holds."""
    return _by_seed(store, chosen, columns, where, (f"count(*) FILTER ({column}) AS within",))


def ever_by_seed(store: Results, chosen: Selection, task: str) -> pd.DataFrame:
    """As `successes_by_seed` by evaluation, of success so far."""
    return store.query(f"""SELECT evaluation, root_seed, seed, count(*) AS runs, count(*) FILTER (ever_success) AS successes
        FROM {outcomes(store, chosen)} WHERE {among("task", [task])} GROUP BY ALL ORDER BY ALL""")


def lost_and_regained(store: Results, chosen: Selection, task: str) -> tuple[int, int]:
    """In how many runs of a task the fittest succeeds (at the widest radius), later misses and succeeds again; all its runs."""
    near, run = radii_cm(store, chosen), f"{', '.join(CELL)}, root_seed, seed"
    good = f"success_{near[-1]}cm" if near else "success"
    found = store.query(f"""
        WITH known AS (SELECT {run}, evaluation, {good} AS good,
                              min(evaluation) FILTER ({good}) OVER (PARTITION BY {run}) AS began
                       FROM {outcomes(store, chosen)} WHERE {among("task", [task])}),
             runs AS (SELECT min(evaluation) FILTER (NOT good AND evaluation > began) AS lost,
                             max(evaluation) FILTER (good) AS last FROM known GROUP BY {run})
        SELECT count(*) FILTER (last > lost) AS regained, count(*) AS runs FROM runs""")
    return int(found.regained[0]), int(found.runs[0])


def _by_seed(store: Results, chosen: Selection, columns: Sequence[str], where: str, more: Sequence[str]) -> pd.DataFrame:
    groups = ", ".join(("task", *columns, "root_seed", "seed"))
    sums = ", ".join(("count(success) AS runs", "count(*) FILTER (success) AS successes", *more))
    return store.query(f"SELECT {groups}, {sums} FROM {outcomes(store, chosen)} WHERE {where} GROUP BY ALL ORDER BY ALL")


def _mean(name: str) -> str:
    return f"avg({name}) FILTER (isfinite({name})) AS {name}"


def _spread(name: str) -> str:
    return f"stddev_samp({name}) FILTER (isfinite({name})) AS {name}_sd"
