"""Work shared out over the cores: the kernels and numpy's larger operations let go of the interpreter."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor
from typing import TypeVar

from bns.sweep.cores import cores

S = TypeVar("S")
T = TypeVar("T")

MOST = 8
"""Threads at most: what holds the interpreter keeps more of them waiting."""


def each(work: Callable[[S], T], items: Sequence[S]) -> list[T]:
    """``work`` of every item, in their order; the answers are the same for any number of cores."""
    with ThreadPoolExecutor(min(cores(), MOST)) as pool:
        return list(pool.map(work, items))
