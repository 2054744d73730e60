"""Figures 4.7 (Khepera) and 5.23 (snake): how many runs succeed after each evaluation, by mutation rate."""

from __future__ import annotations

from analysis.curves import success_by
from analysis.figure_result import FigureResult
from analysis.results import Results

NAME = "success-by-mutation"
PAPER = "figures 4.7 and 5.23"


def draw(store: Results) -> list[FigureResult]:
    return success_by(store, "mutation_rate", NAME)
