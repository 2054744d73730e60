"""Warnings of runs in worker processes: they come back with the runs, and each is shown once, with in how many runs it came.

Left to themselves, all workers would print the same lines. A worker that dies takes with it what it heard; so runs that are
tried again in a new process are not listened to, and print what they have to say.
"""

from __future__ import annotations

import threading
import warnings
from collections import Counter
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

from bns.errors import SweepWarning
from bns.spec import RunSpec
from bns.store.record import RunRecord


class _Hearing(threading.local):
    """What a thread has heard since its run began; None while it has none."""

    texts: dict[str, None] | None = None


_hearing = _Hearing()
_lock = threading.Lock()


def listening(job: Callable[[RunSpec], RunRecord], spec: RunSpec) -> RunRecord:
    """What ``job`` makes of a run, with the texts of the warnings that came meanwhile; for worker processes.

    If it raises, the warnings are printed as they would have been.
    """
    _listen()
    with warnings.catch_warnings():
        pass  # Python shows a warning of one place once, and from now on all places are new
    texts: dict[str, None] = {}
    _hearing.texts = texts
    try:
        record = job(spec)
    except BaseException:
        _hearing.texts = None
        for text in texts:
            warnings.warn(text, SweepWarning, stacklevel=2)
        raise
    finally:
        _hearing.texts = None
    return replace(record, heard=(*record.heard, *texts)) if texts else record


def _listen() -> None:
    """From now on warnings go to the run of their thread; those of threads without one are shown as before."""
    with _lock:
        before = warnings.showwarning
        if getattr(before, "listens", False):
            return

        def show(message: Warning | str, category: type[Warning], filename: str, lineno: int, *more: Any, **named: Any) -> None:
            if _hearing.texts is None:
                before(message, category, filename, lineno, *more, **named)
            else:
                _hearing.texts[f"{category.__name__}: {message} ({Path(filename).name}, line {lineno})"] = None

        vars(show)["listens"] = True
        warnings.showwarning = show


class Heard:
    """The warnings of a sweep's runs: each is shown when it comes first, and at the end how often it came."""

    def __init__(self) -> None:
        self._runs: Counter[str] = Counter()

    def add(self, record: RunRecord) -> None:
        """Those of one run."""
        for text in record.heard:
            self._runs[text] += 1
            if self._runs[text] == 1:
                warnings.warn(f"in run {record.spec.run_id}: {text}", SweepWarning, stacklevel=2)

    def sum_up(self) -> None:
        """Say of each that came in several runs in how many."""
        for text, runs in self._runs.items():
            if runs > 1:
                warnings.warn(f"in {runs} runs: {text}", SweepWarning, stacklevel=2)
        self._runs.clear()
