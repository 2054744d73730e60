"""What the dissertation found (sections 4.6 and 5.9) beside what these results say: agrees, differs, undecided yet."""

from __future__ import annotations

from collections import Counter
from dataclasses import replace
from typing import Any

import pandas as pd

from analysis import checks
from analysis.coverage import coverage
from analysis.figure_result import FigureResult
from analysis.labels import TITLES, task_number, task_title, valued
from analysis.outcomes import COMBINATIONS, fewest
from analysis.results import NoDataError, Results
from analysis.scatter import combinations
from analysis.selection import Selection, selections
from analysis.source import source
from analysis.verdicts import AGREES, DIFFERS, UNDECIDED, Checked

NAME = "findings"
PAPER = "sections 4.6 and 5.9"
OF_EXTREMES = frozenset((
    "best_combination", "best_have_at_most", "worst_have_at_least", "best_in_range", "best_have_a_range", "worst_never_succeed",
    "diversity_of_best_is_steady", "diversity_of_best_moves", "diversity_of_worst_grows", "diversity_of_worst_saturates",
    "half_by",
))  # fmt: skip
"""Checks that speak of the best or the worst combinations."""
_NOWHERE = ""
"""Where the findings of a task with too few runs stand."""


def draw(store: Results) -> list[FigureResult]:
    found = [(chosen, table) for chosen in selections(store) if not (table := checked(store, chosen)).empty]
    if not found:
        raise NoDataError("no finished run is of a robot and task of the dissertation; run bns sweep khepera-small")
    return [_drawn(store, chosen, table) for chosen, table in found]


def checked(store: Results, chosen: Selection, *, early: bool = False) -> pd.DataFrame:
    """One row a finding and task: the dissertation's words, ours, verdict, section; one row a task with too few runs.

    ``early``: findings of such a task have a row each as well, with the estimates that there are. What is said of the best and
    the worst combinations is undecided then while not all of the dissertation's have enough runs: others may be better or worse.
    """
    ready = set(chosen.tasks) if early else _with_enough_runs(store, chosen)
    numbers = {task_number(chosen.robot, task): task for task in chosen.tasks}
    made, waiting = [], Counter[int]()
    for finding in (one for one in source()["findings"] if one["robot"] == chosen.robot):
        for number, arguments in _each_task(finding):
            if number in numbers and numbers[number] not in ready:
                waiting[number] += 1
            elif number in numbers:
                result = _check(store, chosen, finding["check"], numbers[number], arguments)
                if early and finding["check"] in OF_EXTREMES:
                    result = _among_all(result, _ranked(store, chosen, numbers[number]))
                title = f"{number}, {task_title(chosen.robot, numbers[number])}"
                row = {"task": title, "the dissertation": result.claim, "these results": result.ours, "verdict": result.verdict}
                made.append(row | {"where": finding["where"], "runs": float("nan") if result.runs is None else result.runs})
    for number, findings in waiting.items():
        title = f"{number}, {task_title(chosen.robot, numbers[number])}"
        few = f"no combination of parameters has {fewest(store, chosen)} finished runs yet"
        row = {"task": title, "the dissertation": f"all {findings} findings", "these results": few, "verdict": UNDECIDED}
        made.append(row | {"where": _NOWHERE, "runs": float("nan")})
    return pd.DataFrame(made)


def _with_enough_runs(store: Results, chosen: Selection) -> set[str]:
    """Tasks of which at least one combination has enough runs."""
    try:
        return set(combinations(store, chosen)[0].task)
    except NoDataError:
        return set()


def _ranked(store: Results, chosen: Selection, task: str) -> int:
    """Combinations of a task with enough runs."""
    try:
        return int((combinations(store, chosen)[0].task == task).sum())
    except NoDataError:
        return 0


def _among_all(result: Checked, ranked: int) -> Checked:
    if result.verdict == UNDECIDED or ranked >= COMBINATIONS:
        return result
    return replace(result, ours=f"{result.ours}; among {ranked} of {COMBINATIONS} combinations", verdict=UNDECIDED)


def _each_task(finding: dict[str, Any]) -> list[tuple[int, dict[str, Any]]]:
    """Task numbers of a finding with the arguments of its check: what depends on the task is a mapping in source.yaml."""
    given = {name: value for name, value in finding.items() if name not in ("robot", "check", "where", "tasks")}
    by_task = [name for name, value in given.items() if isinstance(value, dict)]
    numbers = list(given[by_task[0]]) if by_task else finding["tasks"]
    return [(n, {name: value[n] if name in by_task else value for name, value in given.items()}) for n in numbers]


def _check(store: Results, chosen: Selection, name: str, task: str, arguments: dict[str, Any]) -> Checked:
    try:
        result: Checked = getattr(checks, name)(store, chosen, task, **arguments)
    except NoDataError as reason:
        return Checked(_in_words(name, arguments), str(reason).partition(";")[0], UNDECIDED)
    return result


def _in_words(name: str, arguments: dict[str, Any]) -> str:
    """What the dissertation says, where nothing can be measured that says it."""
    parameter = arguments.get("parameter", "")
    given = arguments | {"parameter": TITLES.get(parameter, "")}
    given |= {key: valued(parameter, arguments[key]) for key in ("value",) if key in arguments}
    given |= {"range": " to ".join(f"{end:g}" for end in arguments.get("range", ()))}
    return str(source()["in_words"][name]).format(**given)


def _drawn(store: Results, chosen: Selection, table: pd.DataFrame) -> FigureResult:
    said, counts = coverage(store, chosen.sweeps, chosen.n), Counter(table.verdict)
    waiting = table[table["where"] == _NOWHERE]
    see = f"{counts[AGREES]} agree, {counts[DIFFERS]} differ, {counts[UNDECIDED] - len(waiting)} are undecided"
    if len(waiting):
        see += f"; too few runs yet of {' and '.join(task.partition(', ')[2] for task in waiting.task)}"
    shows = (
        f"Each finding of the dissertation that has a number, with the same measure of these results and its 95 % "
        f"interval (bootstrap over seeds, or Wilson). Agrees: the interval is within 5, or 20 % of the dissertation's value, of "
        f"it; differs: it lies outside; undecided: neither yet. Orders agree if they hold in 95 % of the bootstrap samples, and "
        f"differ if in 5 %. The dissertation's numbers come from 500 combinations of 30 runs; these from n = {chosen.n:,} runs "
        f"of {chosen.source}."
    )
    return FigureResult(
        f"{NAME}-{chosen.robot}", "What the dissertation found, and these results", None, shows, chosen.n, chosen.sweeps,
        (*said.missing, *chosen.left_out), see=f"{see}.", data=table, table=table.drop(columns="runs"),
    )  # fmt: skip
