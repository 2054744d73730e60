"""Controllers that were evolved in one world, driven in another, and what became of them.

Of every run with recorded paths the fittest controller after each evaluation is driven once in the world WORLD, with the luck
that the run's own world had: a sweep that is transferred to its own world gives its own numbers again.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence

import numpy as np
import pandas as pd

from analysis.intervals import band, resampled, wilson
from analysis.results import NoDataError, Results
from bns.engine.philox import Key, Purpose
from bns.robots.base import Robot
from bns.spec import RADII_CM
from bns.tasks import load_task
from bns.worlds.base import World

SUCCESSES = tuple(f"success_{cm}cm" for cm in RADII_CM)
NEEDED_AT = "success_10cm"
"""What "evaluations needed" counts to: the 10 cm at which the dissertation's own figures compare."""
_RUN = ["sweep", "task", "seed"]


def transferred(store: Results, sweeps: Sequence[str], world: World, robot: Robot) -> pd.DataFrame:
    """A row an evaluation of every run: sweep, task, seed, evaluation, fitness_simulation, fitness_world (of the new world),
    fitness_error, and `SUCCESSES` in the new world. NoDataError if a sweep has no runs with paths."""
    return pd.DataFrame([row for sweep in sweeps for row in _drives(store, sweep, world, robot)])


def _drives(store: Results, sweep: str, world: World, robot: Robot) -> Iterator[dict[str, object]]:
    columns = ", ".join(f"p.{name}" for name in robot.command_columns)
    found = store.query(
        f"SELECT p.run_id, e.task, e.seed, e.root_seed, p.evaluation, e.fitness_simulation, {columns} FROM paths p "
        "JOIN evals e USING (sweep, run_id, evaluation) "
        f"WHERE p.sweep = '{_quoted(sweep)}' AND p.who = 'fittest' AND p.step > 0 AND e.robot = '{robot.name}' "
        "ORDER BY e.task, e.seed, p.evaluation, p.step"
    )
    if found.empty:
        raise NoDataError(
            f"The sweep {sweep} has no runs of {robot.name} with paths; put record: paths into its file and run it."
        )
    keys = ["run_id", "task", "seed", "root_seed", "evaluation", "fitness_simulation"]
    for (_, name, seed, root_seed, evaluation, simulated), rows in found.groupby(keys, sort=False):
        task = load_task(robot.name, name)
        commands = rows[list(robot.command_columns)].to_numpy(np.float32)
        key = Key.of_run(int(seed), int(root_seed), robot.name, name)
        poses = world.drive(commands, key, Purpose.WORLD_FITTEST, int(evaluation))
        fitness, _ = robot.evaluate_path(poses, task)
        yield {
            "sweep": sweep,
            "task": name,
            "seed": int(seed),
            "evaluation": int(evaluation),
            "fitness_simulation": simulated,
            "fitness_world": fitness,
            "fitness_error": abs(simulated - fitness),
        } | dict(zip(SUCCESSES, robot.successes(poses, task), strict=True))


def _quoted(name: str) -> str:
    return name.replace("'", "''")


def summary(drives: pd.DataFrame) -> pd.DataFrame:
    """A row a sweep and task: what its runs came to after the last evaluation, with 95 % intervals ``_low`` and ``_high``.

    Shares by Wilson; the fitness error is the mean over runs, the evaluations needed the median over them (infinite where
    fewer than half got there), both with bootstrap intervals over seeds.
    """
    rows = []
    for (sweep, task), runs in drives.groupby(["sweep", "task"], sort=False):
        last = runs[runs.evaluation == runs.evaluation.max()]
        row: dict[str, object] = {"sweep": sweep, "task": task, "runs": len(last)}
        for name in SUCCESSES:
            ends = wilson(int(last[name].sum()), len(last))
            row |= dict(zip(_with_ends(name), (last[name].mean(), *map(float, ends)), strict=True))
        needed = first_success(runs).to_numpy()
        row |= dict(zip(_with_ends("fitness_error"), _over_seeds(last.fitness_error.to_numpy(), np.mean), strict=True))
        row |= dict(zip(_with_ends("evaluations_needed"), _over_seeds(needed, _middle), strict=True))
        rows.append(row | {"never": int(np.isinf(needed).sum())})
    return pd.DataFrame(rows)


def first_success(runs: pd.DataFrame) -> pd.Series:
    """The first evaluation after which the fittest controller succeeds within 10 cm, by seed; infinite where none does."""
    reached = runs.evaluation.where(runs[NEEDED_AT].astype(bool), np.inf)
    return reached.groupby([runs[name] for name in _RUN]).min()


def _with_ends(name: str) -> tuple[str, str, str]:
    return name, f"{name}_low", f"{name}_high"


def _middle(values: np.ndarray) -> float:
    """Median that a run which never succeeds may stand in: the upper of two in the middle."""
    return float(np.sort(values)[len(values) // 2])


def _over_seeds(values: np.ndarray, statistic: Callable[[np.ndarray], float]) -> tuple[float, float, float]:
    drawn = [statistic(np.repeat(values, times.astype(int))) for times in resampled(len(values))]
    if np.isinf(drawn).any():  # quantiles between a number and infinity are none
        ordered = np.sort(drawn)
        return float(statistic(values)), float(ordered[int(0.025 * len(drawn))]), float(ordered[int(0.975 * len(drawn))])
    low, high = band(np.asarray(drawn))
    return float(statistic(values)), float(low), float(high)


def described(table: pd.DataFrame, labels: Mapping[str, str]) -> str:
    """`summary` in words and columns, for a terminal or a page (Markdown)."""
    heads = [f"success, {cm} cm" for cm in RADII_CM]
    lines = [
        "| task | controllers from | runs | " + " | ".join(heads) + " | fitness error | evaluations needed (10 cm) | never |",
        "|---" * (len(heads) + 6) + "|",
    ]
    for row in table.to_dict("records"):
        shares = [f"{row[n]:.0%} ({row[n + '_low']:.0%}–{row[n + '_high']:.0%})" for n in SUCCESSES]
        error = "{fitness_error:.3f} ({fitness_error_low:.3f}–{fitness_error_high:.3f})".format(**row)
        needed = "{} ({}–{})".format(*(_whole(row[name]) for name in _with_ends("evaluations_needed")))
        cells = [str(row["task"]), labels[str(row["sweep"])], str(row["runs"]), *shares, error, needed, str(row["never"])]
        lines.append(f"| {' | '.join(cells)} |")
    return "\n".join(lines)


def _whole(value: float) -> str:
    return "never" if np.isinf(value) else f"{value:.0f}"
