"""Backends that carry out a sweep. Each is a module of this folder, found by its name, with two functions.

``placement(request)`` says what would run where (`Placement`); ``carry_out(sweep, request)`` does it and gives a `Summary`.
"""

from __future__ import annotations

import importlib
import pkgutil
from typing import Protocol

from bns.errors import ClusterError, unknown_name
from bns.sweep.grid import Sweep
from bns.sweep.request import Placement, Request
from bns.sweep.runner import Summary


class Backend(Protocol):
    """What every module here has."""

    def placement(self, request: Request) -> Placement:
        """What would run where."""

    def carry_out(self, sweep: Sweep, request: Request) -> Summary:
        """Do it."""


def executor_names() -> tuple[str, ...]:
    """Names of all modules here."""
    return tuple(sorted(module.name for module in pkgutil.iter_modules(__path__)))


def load_executor(name: str) -> Backend:
    """The backend called ``name``; ClusterError if there is none or its libraries are not installed."""
    if name not in executor_names():
        raise ClusterError(unknown_name("executor", name, executor_names()))
    try:
        return importlib.import_module(f"{__name__}.{name}")
    except ModuleNotFoundError as error:
        if (error.name or "").startswith("bns"):
            raise
        raise ClusterError(
            f"--executor {name} needs the library {error.name}, which is not installed. Install it with: "
            "pip install 'bns[cluster]'"
        ) from error
