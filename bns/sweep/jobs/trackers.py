"""The processes that tidy up what killed workers leave in shared memory.

One that is killed itself is started again by the library, knows nothing of what the first had noted, and prints a KeyError
for each name that is given back. Nothing is lost by that: what stays behind are names of semaphores, until the next start of
the computer. So it is started without an error stream.
"""

from __future__ import annotations

import os
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from functools import partial
from multiprocessing import resource_tracker as of_python
from typing import Any

from joblib.externals.loky.backend import resource_tracker as of_loky

_STDERR = 2


def without_complaints() -> None:
    """From now on both trackers, Python's and loky's, are started with nowhere to complain to."""
    for tracker in (of_python._resource_tracker, of_loky._resource_tracker):
        if "_launch" in dir(tracker):  # Python 3.12 and later, and loky
            _wrap(tracker, "_launch", lambda: True)
            _wrap(tracker, "_teardown_dead_process", lambda: True)
        else:
            _wrap(tracker, "ensure_running", partial(_is_dead, tracker))


def _is_dead(tracker: Any) -> bool:
    return tracker._fd is None or not tracker._check_alive()


def _wrap(tracker: Any, name: str, starts: Callable[[], bool]) -> None:
    """Let a tracker's method be silent whenever it starts something."""
    method = getattr(tracker, name)

    def quiet() -> None:
        if starts():
            with _no_errors():
                method()

    if name not in vars(tracker):
        setattr(tracker, name, quiet)


@contextmanager
def _no_errors() -> Iterator[None]:
    """A process that is started inside has the null device as its error stream; so has this one meanwhile, a few milliseconds."""
    try:
        kept = os.dup(_STDERR)
    except OSError:  # closed by whoever called: there is none to inherit
        yield
        return
    nowhere = os.open(os.devnull, os.O_WRONLY)
    try:
        os.dup2(nowhere, _STDERR)
        yield
    finally:
        os.dup2(kept, _STDERR)
        os.close(kept)
        os.close(nowhere)
