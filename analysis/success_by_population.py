"""Figures 4.8 (Khepera) and 5.22 (snake): how many runs succeed after each evaluation, by population size."""

from __future__ import annotations

from analysis.curves import success_by
from analysis.figure_result import FigureResult
from analysis.results import Results

NAME = "success-by-population"
PAPER = "figures 4.8 and 5.22"


def draw(store: Results) -> list[FigureResult]:
    return success_by(store, "population_size", NAME)
