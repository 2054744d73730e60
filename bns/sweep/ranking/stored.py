"""The race as a store has it: what is revealed round by round, in the same order after any interruption."""

from __future__ import annotations

from collections.abc import Container, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from bns.spec import FIELDS, RunSpec
from bns.store.read.reader import finished, query
from bns.sweep.expand.grid import Sweep
from bns.sweep.ranking.race import Aim, Results, next_runs

BEST = 10
"""How many combinations of each task are ranked."""
USUAL = Aim(BEST)


@dataclass
class Race:
    """Of a whole sweep. Its rounds follow from results of earlier rounds alone, so that it goes the same way after any kill."""

    sweep: Sweep
    aim: Aim = USUAL
    tasks: dict[str, list[int]] = field(init=False)
    """Numbers of the combinations of each task, in the order of the file."""
    results: dict[str, Results] = field(init=False)
    _ids: dict[tuple[int, int], str] = field(default_factory=dict)

    def __post_init__(self) -> None:
        self.tasks = {}
        for number, combo in enumerate(self.sweep.combos):
            self.tasks.setdefault(str(combo.get("task", FIELDS["task"].default)), []).append(number)
        self.results = {task: _nothing(len(numbers), self.sweep.seeds) for task, numbers in self.tasks.items()}

    def todo(self, stored: Mapping[str, str], success: Mapping[str, float], again: Container[str] = ()) -> list[tuple[int, int]]:
        """Runs of the first round that is not done, as combination and seed, without those that have a result.

        ``stored``: status of each run that has one; ``success``: of those that went well. Runs ``again`` count as not
        done. Nothing when all rounds are done.
        """
        while batch := self._batch():
            missing = [(n, s) for n, s in batch if self.run_id(n, s) not in stored or self.run_id(n, s) in again]
            if missing:
                return missing
            for number, seed in batch:
                self._reveal(number, seed, success)
        return []

    def run_id(self, number: int, seed: int) -> str:
        """Of combination ``number`` with that seed."""
        if (number, seed) not in self._ids:
            self._ids[number, seed] = RunSpec(robot=self.sweep.robot, seed=seed, **self.sweep.combos[number]).run_id
        return self._ids[number, seed]

    def asked(self) -> tuple[str, ...]:
        """Ids of the runs of all rounds so far."""
        return tuple(self._ids.values())

    def whole(self) -> dict[str, int]:
        """Run id -> combination, of the combinations that have all of their runs."""
        numbers = [own[place] for task, own in self.tasks.items() for place in np.nonzero(self.results[task].whole)[0]]
        return {self.run_id(number, seed): number for number in numbers for seed in self.sweep.all_seeds}

    def _batch(self) -> list[tuple[int, int]]:
        runs = [
            (self.tasks[task][place], self.sweep.first_seed + seed)
            for task, results in self.results.items()
            for place, seed in next_runs(results, self.aim)
        ]
        return sorted(runs, key=lambda run: run[1])

    def _reveal(self, number: int, seed: int, success: Mapping[str, float]) -> None:
        task = next(task for task, numbers in self.tasks.items() if number in numbers)
        place, at = self.tasks[task].index(number), seed - self.sweep.first_seed
        self.results[task].seen[place, at] = True
        self.results[task].success[place, at] = success.get(self.run_id(number, seed), np.nan)


def results_of(folder: Path, name: str) -> tuple[dict[str, str], dict[str, float]]:
    """Status of the runs of a sweep that have one, and the success at the last evaluation of those that went well."""
    stored = finished(folder, name)
    if "ok" not in stored.values():
        return stored, {}
    rows: Any = query(
        folder,
        f"SELECT run_id, success FROM evals WHERE sweep = '{name}' "
        "QUALIFY evaluation = max(evaluation) OVER (PARTITION BY run_id)",
    )
    values = rows["success"].astype("Float64").fillna(0.0).astype(float)
    pairs = zip(rows["run_id"], values.tolist(), strict=True)
    return stored, {run: value for run, value in pairs if stored.get(run) == "ok"}


def _nothing(combinations: int, seeds: int) -> Results:
    shape = combinations, seeds
    return Results(np.full(shape, np.nan), np.zeros(shape, bool))
