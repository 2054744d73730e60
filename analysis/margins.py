"""How near to the edges of the goals final controllers pass, and how often they succeed with and without the world's noise.

`python -m analysis.margins --results DIR [--sweep NAME] [--out FILE.csv] [--rows FILE.csv]`: of runs with paths in the
substitute world, the fittest controller of the last evaluation is driven by the static simulator as it is, and under its noise
many times.
"""

from __future__ import annotations

import argparse
import sys
from collections.abc import Iterator, Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np
import pandas as pd

from analysis.intervals import FEWEST_SEEDS, band, resampled
from analysis.results import NoDataError, Results, among
from analysis.selection import READINGS
from bns.engine.philox import Key, Purpose
from bns.errors import BnsError
from bns.robots import load_robot
from bns.robots.simulator import load_static_simulator
from bns.tasks import Task, load_task
from bns.worlds.substitute import SubstituteWorld

DRIVES = 40
"""Of each controller under noise."""
_SETTING = ["task", "approach", "mutation_rate", "population_size", "generations", "longest"]
_SNN = ["snn_x_m", "snn_y_m"]


def margins(store: Results, sweep: str = READINGS) -> pd.DataFrame:
    """A row a run: task, approach, mutation_rate, population_size, generations, longest, seed, whether the networks see success
    (``simulated``), share of successes without (``quiet``) and with noise (``noisy``), and the distance in simulation at which
    each goal counts as reached, ``goal_1`` ... (m).

    Raises:
        NoDataError: no run of the sweep has paths.
    """
    found = store.query(f"""
        SELECT r.run_id, r.robot, r.task, r.approach, r.mutation_rate, r.population_size,
               r.generations_per_evaluation AS generations, r.max_commands AS longest, r.seed, r.root_seed,
               p.step, p.left_units, p.right_units, p.duration_ms, p.snn_x_m, p.snn_y_m
        FROM paths AS p JOIN runs AS r USING (run_id, sweep)
        WHERE {among('sweep', [sweep])} AND r.status = 'ok' AND p.who = 'fittest' AND p.step > 0 AND p.evaluation = r.evaluations
        ORDER BY r.task, r.approach, r.mutation_rate, r.population_size, r.seed, r.run_id, p.step""")
    if found.empty:
        raise NoDataError(f"no run of the sweep {sweep} has paths; run one with record: paths, as bns sweep {READINGS}")
    return pd.DataFrame(list(_rows(found)))


def _rows(found: pd.DataFrame) -> Iterator[dict[str, object]]:
    robot = load_robot("khepera")
    noisy, quiet = SubstituteWorld(robot), SubstituteWorld(robot)
    still = load_static_simulator(robot.name)
    quiet._simulator = replace(still, noise_sd=np.zeros_like(still.noise_sd))
    columns = [*_SETTING, "seed"]
    for _, run in found.groupby("run_id", sort=False):
        head, task = run.iloc[0], load_task("khepera", run.task.iloc[0])
        commands = run[list(robot.command_columns)].to_numpy(np.float32)
        key = Key.of_run(int(head.seed), int(head.root_seed), robot.name, task.name)
        drives = [noisy.drive(commands, key, Purpose.PROBE, 1000 + number) for number in range(DRIVES)]
        passed = passing(run[_SNN].to_numpy(), task, robot.radii_m[0])
        yield {name: head[name] for name in columns} | {
            "simulated": len(passed) == len(task.goals_m),
            "quiet": float(robot.succeeded(quiet.drive(commands, key, Purpose.PROBE, 0), task)),
            "noisy": float(np.mean([robot.succeeded(poses, task) for poses in drives])),
        } | {f"goal_{number}": distance for number, distance in enumerate(passed, start=1)}


def passing(places_m: np.ndarray, task: Task, radius_m: float) -> list[float]:
    """Distance (m) from each goal that a path (n, 2) reaches in order, where it counts as reached."""
    found: list[float] = []
    for place in places_m:
        distance = float(np.linalg.norm(place - task.goals_m[len(found)])) if len(found) < len(task.goals_m) else np.inf
        if distance <= radius_m:
            found.append(distance)
    return found


def summary(rows: pd.DataFrame) -> pd.DataFrame:
    """By task, approach, mutation rate and setting: runs, distances of all goals but the last and of the last in cm (medians),
    and per cent of success in simulation, without and with noise, with 95 % bootstrap intervals over runs."""
    return pd.DataFrame([dict(zip(_SETTING, key, strict=True)) | _summed(own) for key, own in rows.groupby(_SETTING, sort=True)])


def _summed(own: pd.DataFrame) -> dict[str, object]:
    goals = own[[name for name in own if name.startswith("goal_")]].dropna(axis=1, how="all").to_numpy()
    row: dict[str, object] = {
        "runs": len(own),
        "first_goals_cm": _median_cm(goals[:, :-1]),
        "last_goal_cm": _median_cm(goals[:, -1:]),
    }
    for name in ("simulated", "quiet", "noisy"):
        values = own[name].to_numpy(float)
        row[name] = round(100 * values.mean())
        if len(own) >= FEWEST_SEEDS:
            low, high = band(resampled(len(own)) @ values / len(own))
            row |= {f"{name}_low": round(100 * float(low)), f"{name}_high": round(100 * float(high))}
    return row


def _median_cm(distances: np.ndarray) -> float:
    """NaN where no goal was reached."""
    known = distances[np.isfinite(distances)]
    return round(100 * float(np.median(known)), 1) if len(known) else float("nan")


def main(arguments: Sequence[str] | None = None) -> int:
    """Print the summary, and write it where it is asked for; 0, or 2 with one line on stderr."""
    parser = argparse.ArgumentParser(prog="python -m analysis.margins", description=__doc__.split("\n\n", maxsplit=1)[0])
    parser.add_argument("--results", type=Path, default=Path("results"), help="folder of the results (results)")
    parser.add_argument("--sweep", default=READINGS, help=f"name of the sweep ({READINGS})")
    parser.add_argument("--out", type=Path, help="CSV file to write the summary into")
    parser.add_argument("--rows", type=Path, help="CSV file to write a row for each run into")
    wanted = parser.parse_args(arguments)
    try:
        rows = margins(Results(wanted.results), wanted.sweep)
    except BnsError as fault:
        print(f"analysis.margins: {fault}", file=sys.stderr)
        return fault.exit_code
    table = summary(rows)
    print(table.to_string(index=False))
    if wanted.rows is not None:
        rows.round(4).to_csv(wanted.rows, index=False)
    if wanted.out is not None:
        table.to_csv(wanted.out, index=False)
    return 0


if __name__ == "__main__":
    sys.exit(main())
