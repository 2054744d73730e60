"""Figures 4.10 (Khepera) and 5.25 (snake): how many runs succeed after each evaluation, by real-world selection size."""

from __future__ import annotations

from analysis.curves import success_by
from analysis.figure_result import FigureResult
from analysis.results import Results

NAME = "success-by-real-world-selection"
PAPER = "figures 4.10 and 5.25"


def draw(store: Results) -> list[FigureResult]:
    return success_by(store, "real_world_selection_size", NAME)
