"""Figures 4.8 (Khepera) and 5.22 (snake): how many runs succeed after each evaluation, by population size."""

from __future__ import annotations

from analysis.curves import success_by
from analysis.drawn import Drawn
from analysis.store import Store

NAME = "success-by-population"
PAPER = "figures 4.8 and 5.22"


def draw(store: Store) -> list[Drawn]:
    return success_by(store, "population_size", NAME)
