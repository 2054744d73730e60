"""Which runs may stand in one curve: finished ones of sweeps that compare, all at one setting."""

from __future__ import annotations

from collections.abc import Hashable, Iterator, Sequence
from dataclasses import dataclass
from typing import Any

import pandas as pd

from analysis.approach_order import in_order
from analysis.labels import CELL, TITLES, counted, task_order
from analysis.results import BEGIN, NoDataError, Results, among, remembered
from bns.spec import FIELDS
from bns.sweep.confirm import confirmed_name

CONFIRMING = confirmed_name("")
"""Ending of the sweeps that rerun the best combinations of another on fresh seeds: they confirm, and compare nothing."""
READINGS = "readings"
"""Names of the sweeps that compare readings of the dissertation begin so: at settings of their own, whatever else they vary."""
WORLDS = "worlds"
"""Names of the sweeps that run the same combinations in several worlds begin so."""
SETTING = (
    *("approach", "world", "world_digest", "training_algorithm", "evaluations", "min_commands", "max_commands"),
    *("generations_per_evaluation", "training_iterations_per_evaluation", "engine"),
)
"""What must agree before runs of a robot and task are counted together: columns of `RUNS`."""
RUNS = """(SELECT *, regexp_extract(spec, '"engine_version":([0-9]+)', 1) AS engine FROM runs)"""
"""The runs with the version of the engine, whose numbers differ from those of another, out of their specs."""


@dataclass(frozen=True)
class Selection:
    """Runs of one robot that may be counted together: all finished ones of ``sweeps`` at one setting a task.

    Of a sweep with several files, those that the newest one describes.
    """

    robot: str
    tasks: tuple[str, ...]
    sweeps: tuple[str, ...]
    setting: str
    n: int
    left_out: tuple[str, ...]
    approach: str = ""
    """What is counted, in words, where finished runs of ``sweeps`` have several approaches."""

    @property
    def source(self) -> str:
        """Where the runs come from, for captions."""
        return ", ".join(self.sweeps) + (f" ({self.approach})" if self.approach else "")

    @property
    def sql(self) -> str:
        """SELECT of run_id, sweep and number of evaluations. The same run in two sweeps counts once."""
        return self.of(self.sweeps)

    def of(self, sweeps: Sequence[str]) -> str:
        """The same of other sweeps, at the same setting."""
        return (
            f"SELECT run_id, min(sweep) AS sweep, any_value(evaluations) AS evaluations FROM {RUNS} "
            f"WHERE status = 'ok' AND {among('sweep', sweeps)} AND ({self.setting}) GROUP BY run_id"
        )


@remembered
def selections(store: Results, parameter: str | None = None) -> list[Selection]:
    """One selection a robot, of the sweeps that compare ``parameter`` (by default any of the dissertation's four).

    Raises:
        NoDataError: there is none; the message says why and what would feed it.
    """
    sweeps = comparing(store, parameter)
    groups = store.query(f"""
        SELECT robot, task, {", ".join(SETTING)}, count(DISTINCT run_id) AS n FROM {RUNS}
        WHERE status = 'ok' AND {among("sweep", sweeps)} AND {of_newest_files(store)} GROUP BY ALL
        ORDER BY n DESC, robot, task, {", ".join(SETTING)}""")
    if groups.empty:
        raise NoDataError(f"{_why_none(store, sweeps, parameter)}; run {BEGIN}")
    return [_selection(store, robot, own, sweeps) for robot, own in groups.groupby("robot")]


def comparing(store: Results, parameter: str | None = None) -> list[str]:
    """Sweeps that compare values of ``parameter`` (of any of the four), by their plan or by their runs."""
    names = CELL if parameter is None else (parameter,)
    several = " OR ".join(f"count(DISTINCT {name}) > 1" for name in names)
    rows = store.query(
        f"SELECT sweep, {several} AS several FROM runs WHERE {of_newest_files(store)} GROUP BY sweep ORDER BY sweep"
    )
    return [
        row.sweep
        for row in rows.itertuples()
        if not row.sweep.endswith(CONFIRMING)
        and not row.sweep.startswith((READINGS, WORLDS))
        and (row.several or (row.sweep in store.plans and store.plans[row.sweep].varied & {*names}))
    ]


def _selection(store: Results, robot: str, groups: pd.DataFrame, sweeps: Sequence[str]) -> Selection:
    chosen = groups.drop_duplicates("task")
    alike = " OR ".join(f"({_equals(row)})" for row in chosen[["robot", "task", *SETTING]].to_dict("records"))
    setting = f"({alike}) AND {of_newest_files(store)}"
    drawn = {str(row["task"]): row for row in chosen.to_dict("records")}
    others = groups.drop(chosen.index).to_dict("records")
    left_out = (
        *(text for task, row in drawn.items() for text in _left_out(row, [one for one in others if one["task"] == task])),
        *of_earlier_files(store, robot, sweeps),
    )
    tasks = tuple(sorted(chosen.task, key=lambda task: task_order(robot, task)))
    rows = store.query(f"SELECT DISTINCT sweep FROM {RUNS} WHERE {among('sweep', sweeps)} AND status = 'ok' AND ({setting})")
    own = tuple(sweep for sweep in sweeps if sweep in set(rows.sweep))
    several = groups.approach.nunique() > 1
    approach = _approach_drawn({task: str(row["approach"]) for task, row in drawn.items()}) if several else ""
    return Selection(robot, tasks, own, setting, int(chosen.n.sum()), left_out, approach)


def _left_out(drawn: dict[Hashable, Any], others: Sequence[dict[Hashable, Any]]) -> Iterator[str]:
    """What is left out of one task, and why: rows of numbers of runs, each at another setting than ``drawn``."""
    alike = [row for row in others if all(row[name] == drawn[name] for name in SETTING if name != "approach")]
    if alike:
        names = in_order(row["approach"] for row in alike)
        which = f"another approach, {names[0]}," if len(names) == 1 else f"other approaches, {', '.join(names)},"
        yield f"{counted(sum(row['n'] for row in alike), 'run')} of {drawn['task']} with {which} left out"
    for row in others:
        if row not in alike:
            approach = f"another approach ({row['approach']}), " if row["approach"] != drawn["approach"] else ""
            yield (
                f"{counted(row['n'], 'run')} of {row['task']} with {row['evaluations']} evaluations, "
                f"{row['generations_per_evaluation']} generations and {row['training_iterations_per_evaluation']} iterations "
                f"each, or of {approach}another world, engine or other bounds, left out"
            )


@remembered
def of_newest_files(store: Results) -> str:
    """SQL, of `runs`: the newest file of the sweep describes the run, where its name stands for several files.

    Sweeps that confirm, or compare readings or worlds, grow file by file: theirs all count. So does a run that is drawn alone.
    """
    if store.run is not None:
        return "true"
    several = store.query("SELECT sweep FROM specs GROUP BY sweep HAVING count(DISTINCT spec_hash) > 1 ORDER BY sweep").sweep
    sweeps = [name for name in several if not name.endswith(CONFIRMING) and not name.startswith((READINGS, WORLDS))]
    earlier = [run for name in sweeps if store.plans[name].asked for run in _not_described(store, name)]
    return f"NOT ({among('concat(sweep, chr(10), run_id)', earlier)})" if earlier else "true"


def _not_described(store: Results, sweep: str) -> list[str]:
    """Runs of ``sweep`` that its newest file does not ask for, whatever the engine: sweep and run_id in two lines."""
    there = set(store.query("SELECT column_name FROM (DESCRIBE runs)").column_name)  # an archive keeps fewer columns
    fields = [field for name, field in FIELDS.items() if name not in {"robot", "seed"}]
    kept = [number for number, field in enumerate(fields) if field.name in there]
    plan = store.plans[sweep]
    asked = {(one[0], *(one[1 + number] for number in kept)) for one in plan.asked}
    names = ", ".join(fields[number].name for number in kept)
    rows = store.query(f"SELECT run_id, seed, robot, {names} FROM runs WHERE {among('sweep', [sweep])}")
    return [
        f"{sweep}\n{run_id}"
        for run_id, seed, *combination in rows.itertuples(index=False, name=None)
        if seed not in plan.numbers or tuple(combination) not in asked
    ]


def of_earlier_files(store: Results, robot: str, sweeps: Sequence[str]) -> Iterator[str]:
    """How many finished runs of a robot are left out for an earlier file, a sentence a sweep."""
    rows = store.query(f"""SELECT sweep, count(DISTINCT run_id) AS n FROM runs WHERE status = 'ok' AND {among("robot", [robot])}
        AND {among("sweep", sweeps)} AND NOT ({of_newest_files(store)}) GROUP BY sweep ORDER BY sweep""")
    for row in rows.itertuples():
        yield f"{counted(row.n, 'run')} of an earlier file of the name {row.sweep} left out"


def _approach_drawn(by_task: dict[str, str]) -> str:
    """The approach of each task's runs, in words."""
    if len(set(by_task.values())) == 1:
        return f"approach {next(iter(by_task.values()))}"
    return "approaches " + ", ".join(f"{approach} for {task}" for task, approach in by_task.items())


def _why_none(store: Results, sweeps: Sequence[str], parameter: str | None) -> str:
    """Why none of ``sweeps``, or of all if there are none to choose from, has a run to count."""
    among_these = sweeps or store.query("SELECT DISTINCT sweep FROM runs").sweep.tolist()
    done, failed = finished(store, among_these), failures(store, among_these)
    if not done:
        return f"{counted(failed, 'run')} failed and none finished"
    but = f", {failed:,} failed" if failed else ""
    what = f"{TITLES[parameter]}s" if parameter else "combinations of parameters"
    return f"no sweep compares {what} ({counted(done, 'finished run')}{but})"


def _equals(values: dict[str, Any]) -> str:
    return " AND ".join(
        among(name, [value]) if isinstance(value, str) else f"{name} = {value}" for name, value in values.items()
    )


def finished(store: Results, sweeps: Sequence[str]) -> int:
    """How many different runs of ``sweeps`` are finished."""
    rows = store.query(
        f"SELECT count(DISTINCT run_id) AS n FROM runs "
        f"WHERE status = 'ok' AND {among('sweep', sweeps)} AND {of_newest_files(store)}"
    )
    return int(rows.n[0])


def failures(store: Results, sweeps: Sequence[str]) -> int:
    """How many runs of ``sweeps`` broke and were not carried out again with success."""
    return int(
        store.query(f"""SELECT count(*) AS n FROM (SELECT run_id FROM runs WHERE {among("sweep", sweeps)}
        AND {of_newest_files(store)} GROUP BY run_id HAVING count(*) FILTER (status = 'ok') = 0)""").n[0]
    )
