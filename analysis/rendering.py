"""Turning figures into files' contents takes as long as drawing them: done beside it, in a process of its own."""

from __future__ import annotations

import os
from collections.abc import Callable
from concurrent.futures import Future
from typing import TYPE_CHECKING, Any, Self

from matplotlib.figure import Figure

from bns.sweep.jobs.cores import cores

if TYPE_CHECKING:
    from joblib.externals.loky.process_executor import ProcessPoolExecutor

Rendering = Callable[[Figure], Any]
"""What makes a file's content of a figure; a function of a module, since another process may call it."""


class Renderer:
    """Renders on a second core where there is one, else at once; the same bytes either way. A context manager.

    Leaving it by an exception, Ctrl-C included, renders no more than what has begun.
    """

    def __init__(self, jobs: int | None = None) -> None:
        """``jobs``: cores to use, all if None."""
        self._beside = cores(jobs) > 1
        self._pool: ProcessPoolExecutor | None = None
        self._asked: list[Future[Any]] = []

    def __enter__(self) -> Self:
        return self

    def __exit__(self, fault: object, *_: object) -> None:
        if fault is not None:
            for future in self._asked:
                future.cancel()  # those that wait; to kill the process under loky would fail in a thread of loky's own
        if self._pool is not None:
            self._pool.shutdown(wait=True)

    def submit(self, render: Rendering, figure: Figure) -> Future[Any]:
        """The content of a figure, or what went wrong with it, once it is ready."""
        if self._beside:
            future = self._process().submit(render, figure)
            self._asked = [*(one for one in self._asked if not one.done()), future]
            return future
        done: Future[Any] = Future()
        try:
            done.set_result(render(figure))
        except Exception as fault:  # as it comes from another process: to whoever asks for the result
            done.set_exception(fault)
        return done

    def _process(self) -> ProcessPoolExecutor:
        if self._pool is None:
            from joblib.externals.loky.process_executor import ProcessPoolExecutor  # noqa: PLC0415  # not for one core

            from bns.sweep.jobs.workers import start_worker  # noqa: PLC0415

            self._pool = ProcessPoolExecutor(max_workers=1, initializer=start_worker, initargs=(os.getpid(),))
        return self._pool
