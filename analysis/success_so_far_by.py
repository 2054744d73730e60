"""Figures 4.7 to 4.10 and 5.22 to 5.25 by their other reading: runs that have developed a controller that completes the task."""

from __future__ import annotations

from analysis.curves import success_by
from analysis.figure_result import FigureResult
from analysis.labels import SHORT
from analysis.results import NoDataError, Results

NAME = "success-so-far-by"
PAPER = "another reading of figures 4.7 to 4.10 and 5.22 to 5.25"


def draw(store: Results) -> list[FigureResult]:
    found, lacking = [], []
    for parameter, short in SHORT.items():
        try:
            found += success_by(store, parameter, f"{NAME}-{short.replace(' ', '-')}", "ever_success")
        except NoDataError as none:
            lacking.append(none)
    if not found:
        raise lacking[0]
    return found
