"""The runs of a store as one table, their curves, and their paths: a spec driven again gives the same numbers."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import pandas as pd

from bns.api.run import RunResult, run_spec, spec_of
from bns.app.background import Tell
from bns.errors import StoreError
from bns.spec import parameters_in
from bns.store import query

PARAMETERS = (
    "world",
    "approach",
    "population_size",
    "mutation_rate",
    "tournament_size",
    "real_world_selection_size",
    "generations_per_evaluation",
    "training_iterations_per_evaluation",
    "training_algorithm",
    "evaluations",
)
OUTCOMES = {
    "success": "success at the end (smallest radius)",
    "goals_reached": "goals reached",
    "diversity": "diversity",
    "fitness_error": "fitness error (1/m)",
    "fitness_world": "fitness in the world (1/m)",
    "fittest_commands": "commands of the fittest",
}
"""Columns of a run's last evaluation, in words."""
DIVERSITY = (
    "Diversity: how far, on average, a controller's commands lie from the population's mean commands, summed over its commands, "
    "each number relative to its range; no unit, 0 where all controllers are alike."
)
CURVES = {
    "fitness_error": "fitness error (1/m)",
    "diversity": "diversity",
    "fitness_world": "fitness in the world (1/m)",
    "fitness_simulation": "fitness in simulation (1/m)",
    "training_error": "training error",
    "goals_reached": "goals reached",
}
MOST_RUNS = 200_000
"""More than a table of the page can hold; the study of the dissertation has 45,000."""
_OF_A_RUN = ("run_id", "sweep", "robot", "task", "seed")
_RUN_PARAMETERS = ", ".join(f"r.{name}" for name in (*_OF_A_RUN, *PARAMETERS))
_AT_THE_END = ", ".join(f"e.{name}" for name in OUTCOMES)


def is_store(path: Path) -> bool:
    """Does the folder hold results of bns?"""
    return path.is_dir() and any((path / table).is_dir() for table in ("runs", "journal"))


class Study:
    """``runs``: a row a finished run, with parameters and the outcomes of its last evaluation. StoreError: no such results."""

    def __init__(self, results: Path) -> None:
        if not is_store(results):
            raise StoreError(f"{results} holds no results of bns; give the folder that `bns sweep --results` wrote.")
        self.results = results
        self.runs = self._read()

    def refresh(self) -> bool:
        """Read again; were there other runs than before?"""
        before, self.runs = len(self.runs), self._read()
        return len(self.runs) != before

    def _read(self) -> pd.DataFrame:
        rows = query(
            self.results,
            f"""SELECT {_RUN_PARAMETERS}, {_AT_THE_END}
                FROM runs r JOIN evals e ON e.run_id = r.run_id AND e.sweep = r.sweep AND e.evaluation = r.evaluations
                WHERE r.status = 'ok' ORDER BY r.sweep, r.robot, r.task, r.seed, r.run_id LIMIT {MOST_RUNS}""",
        )
        rows["success"] = rows["success"].fillna(False).astype(bool)
        return rows

    def varied(self, rows: pd.DataFrame) -> list[str]:
        """Parameters of which these runs have more than one value."""
        return [name for name in PARAMETERS if rows[name].nunique(dropna=False) > 1]

    def chosen(self, only: Mapping[str, Sequence[Any]]) -> pd.DataFrame:
        """Runs whose columns have one of the values wanted; a column with none wanted does not filter."""
        rows = self.runs
        for name, values in only.items():
            if values:
                rows = rows[rows[name].isin(list(values))]
        return rows

    def curve(self, run_id: str) -> pd.DataFrame:
        """Every evaluation of a run: evaluation, success, and the columns of `CURVES`."""
        columns = ", ".join(("evaluation", "success", *CURVES))
        return query(
            self.results, f"SELECT DISTINCT {columns} FROM evals WHERE run_id = '{_checked(run_id)}' ORDER BY 1"
        )

    def drive_again(self, run_id: str, tell: Tell) -> RunResult:
        """The run itself, with its path. SpecError where this version no longer takes its spec."""
        rows = query(self.results, f"SELECT spec FROM runs WHERE run_id = '{_checked(run_id)}' LIMIT 1")
        if rows.empty:
            raise StoreError(f"There is no run {run_id} in {self.results}.")
        result = run_spec(spec_of(parameters_in(json.loads(rows["spec"][0]))), progress=tell)
        if result.run_id != run_id:
            raise StoreError(
                f"The run {run_id} is of another version of the engine or of its approach; "
                f"repeated, it would be {result.run_id}, with different results."
            )
        return result


def _checked(run_id: str) -> str:
    if not run_id.isalnum():
        raise StoreError(f"{run_id!r} is no name of a run.")
    return run_id
