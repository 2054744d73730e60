"""Table 4.2 with many seeds, in two worlds: after how many evaluations the prototype trials (section 4.3) succeed."""

from __future__ import annotations

import numpy as np
import pandas as pd

from analysis.figure_result import FigureResult
from analysis.labels import counted, task_number, task_order, task_title
from analysis.results import NoDataError, Results
from analysis.source import trials_of
from analysis.trials import IN_A_ROW, MARKS, marks_of

NAME = "prototype-worlds"
PAPER = "table 4.2"
SWEEP = "prototype-worlds"


def draw(store: Results) -> list[FigureResult]:
    rows = of_each_run(store)
    if rows.empty:
        raise NoDataError(f"no finished run of the sweep {SWEEP}; run bns sweep {SWEEP}")
    made = []
    for robot, own in rows.groupby("robot"):
        shows = (
            f"Prototype trials of {SWEEP} ({counted(len(own), 'run')}): the median number of evaluations until the fittest "
            f"controller first visits all goals, until it does so {IN_A_ROW} times in succession, and the same within 10 cm. "
            "95 % intervals of the medians from order statistics; a run in which it never happens counts as later than its end."
        )
        title = "Prototype trials in two worlds"
        made.append(FigureResult(
            f"{NAME}-{robot}", title, None, shows, len(own), (SWEEP,), data=own, table=table(str(robot), own)
        ))  # fmt: skip
    return made


def of_each_run(store: Results) -> pd.DataFrame:
    """Of each run: robot, task, world, seed, evaluations, and the evaluation of each of `MARKS`, infinite where it never came."""
    rows = store.query(f"""
        SELECT robot, task, world, root_seed, seed, run_id, evaluation, success, success_10cm
        FROM evals SEMI JOIN (SELECT run_id, sweep FROM runs WHERE status = 'ok' AND sweep = '{SWEEP}') USING (run_id, sweep)
        ORDER BY run_id, evaluation""")
    return pd.DataFrame([_run(one) for _, one in rows.groupby("run_id", sort=False)])


def _run(rows: pd.DataFrame) -> dict[str, object]:
    return {
        **{name: rows[name].iloc[0] for name in ("robot", "task", "world", "root_seed", "seed", "run_id")},
        "evaluations": len(rows),
        **{name: np.inf if mark is None else float(mark) for name, mark in marks_of(rows).items()},
    }


def table(robot: str, rows: pd.DataFrame) -> pd.DataFrame:
    """A row a task and world: what the dissertation's robot took, and medians with 95 % intervals."""
    made = []
    for task in sorted(set(rows.task), key=lambda task: task_order(robot, task)):
        theirs = ", ".join(f"{evaluations:g}" for evaluations, _ in trials_of(robot, task_number(robot, task))) or "–"
        for world in sorted(set(rows.world), key=lambda world: (world != "substitute", world)):
            own = rows[(rows.task == task) & (rows.world == world)]
            if len(own):
                said = {label: median_in_words(own[name], own.evaluations.max()) for name, (label, _, _) in MARKS.items()}
                head = {"task": task_title(robot, task), "the dissertation, by eye": theirs, "world": world, "runs": len(own)}
                made.append(head | said)
    return pd.DataFrame(made)


def median_in_words(values: pd.Series, last: int) -> str:
    """The median, its 95 % interval and how often it never came, of evaluations that are infinite where it never did."""
    def one(value: float) -> str:
        return f"{value:g}" if np.isfinite(value) else f"over {last}"

    ordered, never = np.sort(values.to_numpy(float)), int(np.isinf(values).sum())
    ends = median_interval(ordered)
    between = f" ({one(ends[0])} to {one(ends[1])})" if ends else ""
    middle = ordered[[(len(ordered) - 1) // 2, len(ordered) // 2]].mean()
    return f"{one(middle)}{between}" + (f"; {never} never" if never else "")


def median_interval(ordered: np.ndarray) -> tuple[float, float] | None:
    """The narrowest pair of order statistics that holds the median with a probability of 95 %; None of fewer than six values."""
    from scipy.stats import binom  # noqa: PLC0415  # slow to load

    many = len(ordered)
    below = int(binom.ppf(0.025, many, 0.5))
    # Ranks below + 1 and many - below: coverage is 1 - 2 P(fewer than `below` + 1 values lie below the median).
    while below >= 0 and 2 * binom.cdf(below, many, 0.5) > 0.05:
        below -= 1
    return None if below < 0 else (float(ordered[below]), float(ordered[many - 1 - below]))
