"""Figures 4.9 (Khepera) and 5.24 (snake): how many runs succeed after each evaluation, by tournament size."""

from __future__ import annotations

from analysis.curves import success_by
from analysis.figure_result import FigureResult
from analysis.results import Results

NAME = "success-by-tournament"
PAPER = "figures 4.9 and 5.24"


def draw(store: Results) -> list[FigureResult]:
    return success_by(store, "tournament_size", NAME)
