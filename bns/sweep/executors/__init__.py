"""Backends that carry out a sweep. Each is a module of this folder, or of an installed package, with two functions.

``placement(request)`` says what would run where (`Placement`); ``carry_out(sweep, request)`` does it and gives a `Summary`.
"""

from __future__ import annotations

from typing import Protocol

from bns.errors import ClusterError
from bns.extras import MissingExtraError
from bns.registry import EXECUTORS
from bns.sweep.expand.grid import Sweep
from bns.sweep.request import Placement, Request
from bns.sweep.runner import Summary


class Backend(Protocol):
    """What every executor has."""

    def placement(self, request: Request) -> Placement:
        """What would run where."""

    def carry_out(self, sweep: Sweep, request: Request) -> Summary:
        """Do it."""


def executor_names() -> tuple[str, ...]:
    """All names; none is imported."""
    return EXECUTORS.names()


def load_executor(name: str) -> Backend:
    """The backend called ``name``; ClusterError if there is none or its libraries are not installed."""
    try:
        backend: Backend = EXECUTORS.load(name)
    except MissingExtraError as error:
        raise ClusterError(f"--executor {name}: {error}") from error
    return backend
