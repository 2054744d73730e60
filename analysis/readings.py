"""What hangs on readings of the dissertation: runs of each reading beside those of the default on the same seeds.

`sweeps/readings.yaml` and `sweeps/readings-NAME.yaml` make the runs; an archive of them is in `results/published/`.
"""

from __future__ import annotations

import numpy as np
import pandas as pd

from analysis.figure_result import FigureResult
from analysis.intervals import FEWEST_SEEDS, band, resampled
from analysis.labels import percent, task_title
from analysis.results import NoDataError, Results
from analysis.selection import READINGS

NAME = "readings"
PAPER = "readings of the dissertation, section 4.3"
LATE, EARLY = 0.7, (16, 25)
"""Evaluations that count: beyond this share of a run, and those around the twentieth."""
MEASURES = {
    "early_10cm": "within 10 cm, evaluations 16–25 (%)",
    "late_10cm": "within 10 cm, late (%)",
    "late_7cm": "within 7 cm, late (%)",
    "commands": "commands of the fittest, late",
    "diversity": "diversity, late",
}
_CELL = ["robot", "task", "population_size", "mutation_rate"]
_READING = ["option", "generations", "longest"]
_DEFAULT = ("", 20, 100)


def draw(store: Results) -> list[FigureResult]:
    pairs, rows = compared(store)
    table = pd.DataFrame([in_words(row) for row in rows.to_dict("records")])
    shows = (
        f"Runs of a reading minus those of the default reading on the same seeds, means over pairs with 95 % bootstrap intervals "
        f"over pairs (from {FEWEST_SEEDS} pairs on). Percentages are of evaluations in which the fittest meets all goals; late: "
        f"the last {1 - LATE:.0%} of a run. n = {len(pairs)} pairs."
    )
    return [
        FigureResult(
            NAME, "Readings of the dissertation", None, shows, len(pairs), tuple(sorted(set(pairs.sweep))), data=rows, table=table
        )
    ]


def of_each_run(store: Results) -> pd.DataFrame:
    """A row a finished run: its reading, combination and seed, and `MEASURES`."""
    late, early = f"evaluation > {LATE} * evaluations", f"evaluation BETWEEN {EARLY[0]} AND {EARLY[1]}"
    return store.query(f"""
        SELECT sweep, split_part(robot, '+', 1) AS robot, array_to_string(string_split(robot, '+')[2:], '+') AS option, task,
               population_size, mutation_rate, seed, generations_per_evaluation AS generations, max_commands AS longest,
               100 * avg(success_10cm::INT) FILTER ({early}) AS early_10cm,
               100 * avg(success_10cm::INT) FILTER ({late}) AS late_10cm,
               100 * avg(success_7cm::INT) FILTER ({late}) AS late_7cm,
               avg(fittest_commands) FILTER ({late}) AS commands, avg(diversity) FILTER ({late}) AS diversity
        FROM evals JOIN (SELECT run_id, sweep, any_value(evaluations) AS evaluations FROM runs
                         WHERE status = 'ok' AND starts_with(sweep, '{READINGS}') GROUP BY ALL) AS done USING (run_id, sweep)
        GROUP BY ALL ORDER BY ALL""")


def compared(store: Results) -> tuple[pd.DataFrame, pd.DataFrame]:
    """The pairs, and a row a reading and combination: n, of each measure the default, the other, the difference's interval.

    Raises:
        NoDataError: no reading has a run with a partner.
    """
    runs = of_each_run(store)
    default = (runs[_READING] == list(_DEFAULT)).all(axis=1) if len(runs) else np.zeros(0, bool)
    on = [*_CELL, "seed"]
    pairs = runs[~default].merge(runs.loc[default, [*on, *MEASURES]], on=on, suffixes=("", "_default"))
    if pairs.empty:
        raise NoDataError("no run of a reading has a counterpart of the default reading; run bns sweep readings")
    rows = [_row(key, own) for key, own in pairs.groupby([*_READING, *_CELL])]
    return pairs, pd.DataFrame(rows)


def _row(key: tuple, own: pd.DataFrame) -> dict[str, object]:
    row = dict(zip([*_READING, *_CELL], key, strict=True)) | {"n": len(own)}
    for name in MEASURES:
        difference = (own[name] - own[f"{name}_default"]).to_numpy()
        ends = (np.nan, np.nan)
        if len(own) >= FEWEST_SEEDS:
            ends = tuple(map(float, band(resampled(len(own)) @ difference / len(own))))
        row |= {f"{name}_default": own[f"{name}_default"].mean(), name: own[name].mean()}
        row |= {f"{name}_low": ends[0], f"{name}_high": ends[1]}
    return row


def in_words(row: dict) -> dict[str, object]:
    """One row of the table: reading, combination, pairs, and of each measure both means and the difference's interval."""
    said = {
        "reading": reading(row), "task": task_title(row["robot"], row["task"]), "population": row["population_size"],
        "mutation": percent(row["mutation_rate"]), "pairs": row["n"],
    }  # fmt: skip
    for name, title in MEASURES.items():
        form = ".1f" if name == "diversity" else ".0f"
        known = np.isfinite(row[f"{name}_low"])
        ends = f" ({row[f'{name}_low']:+{form}} to {row[f'{name}_high']:+{form}})" if known else ""
        said[title] = f"{row[f'{name}_default']:{form}} → {row[name]:{form}}{ends}"
    return said


def reading(row: dict) -> str:
    """What a reading changes, in words."""
    parts = [f"`{row['option']}`"] if row["option"] else []
    if row["generations"] != _DEFAULT[1]:
        parts.append(f"{row['generations']} generations")
    if row["longest"] != _DEFAULT[2]:
        parts.append(f"lists of at most {row['longest']}")
    return ", ".join(parts)
