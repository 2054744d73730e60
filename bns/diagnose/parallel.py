"""Work shared out over the cores: the kernels and numpy's larger operations let go of the interpreter."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager
from typing import TypeVar

from threadpoolctl import threadpool_limits

from bns.sweep.jobs.cores import cores

S = TypeVar("S")
T = TypeVar("T")

MOST = 8
"""Threads at most: what holds the interpreter keeps more of them waiting."""


def each(work: Callable[[S], T], items: Sequence[S]) -> list[T]:
    """``work`` of every item, in their order; the answers are the same for any number of cores."""
    if cores() == 1 or len(items) == 1:
        return [work(item) for item in items]
    with ThreadPoolExecutor(min(cores(), MOST)) as pool:
        return list(pool.map(work, items))


@contextmanager
def one_thread_each() -> Iterator[None]:
    """Matrix products without threads of their own, also as a decorator.

    These would wait for each other on cores that `each` has filled already, and sum in another order on another number of cores.
    """
    with threadpool_limits(1, user_api="blas"):
        yield
