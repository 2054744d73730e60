"""Sweeps in words and tables, for the command line."""

from __future__ import annotations

import math
import shlex
from collections.abc import Sequence
from pathlib import Path

from bns.sweep.forecast.plan import Plan
from bns.sweep.progress import in_words
from bns.sweep.request import Placement
from bns.sweep.runner import Summary
from bns.sweep.status import SweepRow

_WHY = {
    "budget": "the time is used up",
    "limit": "the limit is reached",
    "interrupt": "interrupted",
    "terminated": "terminated",
}


def planned(plan: Plan, place: Placement) -> str:
    """What a sweep would take, and where it would run."""
    time = "unknown" if math.isnan(plan.seconds_estimate) else in_words(plan.seconds_estimate)
    return (
        f"{plan.sweep}: {_runs(plan.total)}, {plan.done} done, {plan.remaining} to do; about {time} (h:mm:ss) with "
        f"{place.where}, {plan.bytes_estimate / 2**20:.0f} MiB more on disk (from {plan.basis})"
    )


def summed_up(summary: Summary, results: Path) -> str:
    """Where a sweep stands, and how to go on."""
    text = f"{summary.sweep}: {_runs(summary.new)} now, {summary.done} of {summary.total} done, in {results}"
    if summary.failed or summary.quarantined:
        text += (
            f"; {summary.failed} failed, {summary.quarantined} quarantined (why: bns query "
            f"--results {shlex.quote(str(results))} "
            f"\"SELECT run_id, error FROM runs WHERE sweep = '{summary.sweep}' AND status <> 'ok'\"; "
            "again: --retry-failed)"
        )
    if summary.stopped_by == "submitted":
        text += "; the rest is queued: see squeue --me, and bns status for what is done"
    elif summary.stopped_by == "ranking":
        text += "; the rest cannot change the ranking"
    elif summary.stopped_by:
        text += f"; stopped: {_WHY[summary.stopped_by]}; the same command continues from here"
    return text


def _runs(number: int) -> str:
    return f"{number} run{'' if number == 1 else 's'}"


def status_table(rows: Sequence[SweepRow]) -> str:
    """One line a sweep and task."""
    head = ("sweep", "task", "done", "of", "failed", "quarantined", "other", "mean s per run", "last run began (UTC)")
    archives = any(row.archived for row in rows)  # a column that most stores do not need
    lines = [(*head, "archived") if archives else head] + [
        (
            row.sweep,
            row.task,
            str(row.done),
            "?" if row.total is None else str(row.total),
            str(row.failed),
            str(row.quarantined),
            str(row.other),
            "-" if math.isnan(row.mean_wall_s) else f"{row.mean_wall_s:.2f}",
            "-" if row.last is None else row.last.strftime("%Y-%m-%d %H:%M:%S"),
            *([str(row.archived)] if archives else []),
        )
        for row in rows
    ]
    widths = [max(len(line[i]) for line in lines) for i in range(len(lines[0]))]
    return "\n".join(
        "  ".join(cell.ljust(width) for cell, width in zip(line, widths, strict=True)).rstrip() for line in lines
    )
