"""The best combinations of a sweep, run again on seeds that had no part in choosing them.

The best of many combinations looks better than it is, because luck helped to choose it; runs on fresh seeds say how good it is.
"""

from __future__ import annotations

import warnings
from collections.abc import Iterable, Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Any

import yaml

from bns.errors import StoreError, SweepWarning
from bns.spec import FIELDS, RunSpec
from bns.store.read.reader import finished, query
from bns.sweep.expand.grid import Sweep, parse_sweep

if TYPE_CHECKING:  # a third of a second to load, and a sweep needs no table
    import pandas as pd

RANKED_BY = ("success", "success_10cm", "success_14cm", "success_20cm", "fitness_world")
"""Means over the runs of a combination at their last evaluation, the first that differs decides (section 4.5). ``success`` is
that of the robot's smallest goal; robots without goal points have no successes by distance, and their fitness decides next."""


def confirmed_name(name: str) -> str:
    """Name of the sweep that confirms the sweep ``name``."""
    return f"{name}-confirm"


def confirmation(sweep: Sweep, results: Path, top: int) -> Sweep | None:
    """The ``top`` best combinations of each task with as many fresh seeds; None while the sweep has runs to do.

    Its file is text like any other, so it is stored, resumed and shown like any other.

    Raises:
        StoreError: no run of the sweep went well, so nothing is best.
        SpecError: the name or the seeds go beyond what a sweep file may have.
    """
    runs = _combination_of_runs(sweep)
    if runs.keys() - finished(results, sweep.name).keys():
        return None
    text = yaml.safe_dump(
        {
            "name": confirmed_name(sweep.name),
            "robot": sweep.robot,
            "seeds": sweep.seeds,
            "first_seed": sweep.first_seed + sweep.seeds,
            "include": best(sweep, results, top, runs),
        },
        sort_keys=False,
    )
    return parse_sweep(f"# The {top} best of each task of {sweep.name}, on fresh seeds.\n{text}", sweep.path)


def in_turn(sweeps: Iterable[Sweep], results: Path, top: int | None) -> Iterator[Sweep]:
    """Each sweep and, if ``top`` is given, what confirms it, provided that the sweep is done when its turn is over."""
    for sweep in sweeps:
        yield sweep
        more = confirmation(sweep, results, top) if top else None
        if more is not None:
            yield more
        elif top:
            warnings.warn(f"{sweep.name} is confirmed when all of its runs are done", SweepWarning, stacklevel=2)


def best(sweep: Sweep, results: Path, top: int, runs: dict[str, int] | None = None) -> list[dict[str, Any]]:
    """The ``top`` best combinations of each task, best first; ``runs``: run id -> number of its combination."""
    means = _means(results, sweep.name, _combination_of_runs(sweep) if runs is None else runs)
    if means.empty:
        raise StoreError(
            f"no run of sweep {sweep.name!r} in {results} went well, so none of its combinations is best. See why with "
            f"bns query \"SELECT error FROM runs WHERE sweep = '{sweep.name}'\", fix the cause, and sweep with --retry-failed."
        )
    # The order of the file decides between equals, so that asking twice gives the same.
    ranking = means.sort_index().sort_values(list(RANKED_BY), ascending=False, kind="stable")
    chosen = [dict(sweep.combos[int(number)]) for number in ranking.index]
    return [combo for task in _tasks(sweep) for combo in [c for c in chosen if _task(c) == task][:top]]


def _means(results: Path, name: str, runs: dict[str, int]) -> pd.DataFrame:
    last = query(
        results,
        f"SELECT run_id, {', '.join(RANKED_BY)} FROM evals SEMI JOIN "
        f"(SELECT run_id, sweep FROM runs WHERE status = 'ok') USING (run_id, sweep) WHERE sweep = '{name}' "
        "QUALIFY evaluation = max(evaluation) OVER (PARTITION BY run_id)",
    )
    numbers = last["run_id"].map(runs)  # runs of an earlier file of that name have none
    values = last[list(RANKED_BY)].astype("Float64").fillna(0.0).astype(float)
    return values[numbers.notna()].groupby(numbers.dropna().astype(int)).mean()


def _combination_of_runs(sweep: Sweep) -> dict[str, int]:
    return {
        RunSpec(robot=sweep.robot, seed=seed, **combo).run_id: number
        for number, combo in enumerate(sweep.combos)
        for seed in sweep.all_seeds
    }


def _tasks(sweep: Sweep) -> list[str]:
    return list(dict.fromkeys(map(_task, sweep.combos)))


def _task(combo: dict[str, Any]) -> str:
    return str(combo.get("task", FIELDS["task"].default))
