"""Figures 4.9 (Khepera) and 5.24 (snake): how many runs succeed after each evaluation, by tournament size."""

from __future__ import annotations

from analysis.curves import success_by
from analysis.drawn import Drawn
from analysis.store import Store

NAME = "success-by-tournament"
PAPER = "figures 4.9 and 5.24"


def draw(store: Store) -> list[Drawn]:
    return success_by(store, "tournament_size", NAME)
