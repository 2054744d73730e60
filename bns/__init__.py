"""Bootstrapped Neuro-Simulation: run it, sweep it, compare models with measurements, analyse the batch.

    import bns

    run = bns.run(robot="khepera", task="infinity", seed=3)
    found = bns.diagnose("log.csv", bns.Model("khepera"))

Every name of ``__all__`` is imported when it is first used, so that ``import bns`` is quick.
"""

from __future__ import annotations

import importlib
import sys
from types import ModuleType
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from inspect import Signature

    from bns.api.add import AddResult, add
    from bns.api.compare import CompareResult, compare
    from bns.api.diagnose import DiagnoseResult, diagnose
    from bns.api.effects import effects
    from bns.api.measurements import Measurements
    from bns.api.model import Model
    from bns.api.propose import ProposeResult, propose
    from bns.api.report import ReportResult, report
    from bns.api.run import RunResult, run
    from bns.api.sweep import Sweep, SweepResult
    from bns.api.trial import ExperimentResult, TrialResult, trial
    from bns.app.explore import Explorer, explore
    from bns.errors import (
        BnsError,
        ClusterError,
        DataError,
        DeviceError,
        HardwareError,
        ModelError,
        SpecError,
        StopNotConfirmedError,
        StoreError,
        TrialFileError,
        TrialPausedError,
    )
    from bns.physics.effect import Effect, Parameter
    from bns.store.archive.write import archive
    from bns.store.read.reader import load, query

__version__ = "0.2.0"

__all__ = [
    "AddResult",
    "BnsError",
    "ClusterError",
    "CompareResult",
    "DataError",
    "DeviceError",
    "DiagnoseResult",
    "Effect",
    "ExperimentResult",
    "Explorer",
    "HardwareError",
    "Measurements",
    "Model",
    "ModelError",
    "Parameter",
    "ProposeResult",
    "ReportResult",
    "RunResult",
    "SpecError",
    "StopNotConfirmedError",
    "StoreError",
    "Sweep",
    "SweepResult",
    "TrialFileError",
    "TrialPausedError",
    "TrialResult",
    "__version__",
    "add",
    "archive",
    "compare",
    "diagnose",
    "effects",
    "explore",
    "load",
    "propose",
    "query",
    "report",
    "run",
    "trial",
]

_HOMES = {
    "api.add": ("AddResult", "add"),
    "api.compare": ("CompareResult", "compare"),
    "api.diagnose": ("DiagnoseResult", "diagnose"),
    "api.effects": ("effects",),
    "api.measurements": ("Measurements",),
    "api.model": ("Model",),
    "api.propose": ("ProposeResult", "propose"),
    "api.report": ("ReportResult", "report"),
    "api.run": ("RunResult", "run"),
    "api.sweep": ("Sweep", "SweepResult"),
    "api.trial": ("ExperimentResult", "TrialResult", "trial"),
    "app.explore": ("Explorer", "explore"),
    "errors": (
        *("BnsError", "ClusterError", "DataError", "DeviceError", "HardwareError", "ModelError", "SpecError"),
        *("StopNotConfirmedError", "StoreError", "TrialFileError", "TrialPausedError"),
    ),
    "physics.effect": ("Effect", "Parameter"),
    "store.archive.write": ("archive",),
    "store.read.reader": ("load", "query"),
}
_HOME = {name: module for module, names in _HOMES.items() for name in names}
_CALLABLE_ROOMS = ("diagnose", "trial")
"""Folders of the package that share their name with a function: the folder, called, is the function."""


def _named(name: str) -> Any:
    return getattr(importlib.import_module(f"bns.{_HOME[name]}"), name)


class _CallableRoom(ModuleType):
    """The folder ``bns/diagnose`` or ``bns/trial`` as `bns.diagnose(...)`: its modules are reached through it as through any."""

    def __call__(self, *given: Any, **named: Any) -> Any:
        return _named(self.__name__.removeprefix("bns."))(*given, **named)

    @property
    def __signature__(self) -> Signature:
        """What notebooks show."""
        import inspect  # noqa: PLC0415  # takes as long as all else here

        return inspect.signature(_named(self.__name__.removeprefix("bns.")))

    @property
    def __doc__(self) -> str:  # type: ignore[override]  # of each folder, not of this class
        """What `help` and notebooks show: the function's words, and its call, for `help` shows no signature of a folder."""
        import inspect  # noqa: PLC0415  # as above

        signature = self.__signature__
        bare = [p.replace(annotation=p.empty) for p in signature.parameters.values()]
        called = signature.replace(parameters=bare, return_annotation=signature.empty)
        return f"{inspect.getdoc(_named(self.__name__.removeprefix('bns.')))}\n\nCall: {self.__name__}{called}"

    def __reduce__(self) -> tuple[Any, ...]:
        return importlib.import_module, (self.__name__,)


class _Front(ModuleType):
    """The package: a folder that is imported under a function's name stays callable."""

    def __setattr__(self, name: str, value: Any) -> None:
        if name in _CALLABLE_ROOMS and type(value) is ModuleType:
            value.__class__ = _CallableRoom
        super().__setattr__(name, value)


sys.modules[__name__].__class__ = _Front


def __getattr__(name: str) -> Any:
    if name not in _HOME:
        raise AttributeError(f"module 'bns' has no attribute {name!r}")
    if name in _CALLABLE_ROOMS:
        return importlib.import_module(f"bns.{name}")
    value = globals()[name] = _named(name)
    return value


def __dir__() -> list[str]:
    private = {name for name in globals() if name.startswith("_") and not name.startswith("__")}
    return sorted({*globals(), *__all__} - private - {"TYPE_CHECKING", "Any", "ModuleType", "annotations", "importlib", "sys"})
