"""Trackers by name: each module of `KINDS` has `SETTINGS` and `open_tracker(settings, clock)`."""

from __future__ import annotations

import math
from collections.abc import Mapping
from importlib import import_module
from types import ModuleType
from typing import Any, NamedTuple

from bns.errors import HardwareError, unknown_name
from bns.hardware.clock import Clock
from bns.hardware.tracking.sight import Tracker


class Settings(NamedTuple):
    """Names of a kind's settings: those it needs, others that it may have, and which of all these are sizes, numbers above 0."""

    needed: tuple[str, ...]
    others: tuple[str, ...]
    sizes: tuple[str, ...]


KINDS = ("aruco", "colour", "wii")


def open_tracker(settings: Mapping[str, Any], clock: Clock) -> Tracker:
    """The tracker that a rig names, looking; HardwareError if the kind is unknown or its device cannot be used."""
    tracker: Tracker = _module(settings).open_tracker(checked(settings), clock)
    return tracker


def checked(settings: Mapping[str, Any]) -> Mapping[str, Any]:
    """The settings without their kind; HardwareError names one that is missing, unknown or makes no sense."""
    module, kind = _module(settings), settings["kind"]
    own = {name: value for name, value in settings.items() if name != "kind"}
    needed, others, sizes = module.SETTINGS
    missing = [name for name in needed if name not in own]
    if missing:
        raise HardwareError(f"the {kind} tracker of the rig lacks {', '.join(missing)}; it needs {', '.join(needed)}.")
    unknown = [name for name in own if name not in {*needed, *others}]
    if unknown:
        raise HardwareError(f"the {kind} tracker: {unknown_name('setting', unknown[0], [*needed, *others])}")
    for name in sizes:
        value = own.get(name, 1.0)
        if isinstance(value, bool) or not isinstance(value, int | float) or not 0.0 < value < math.inf:
            raise HardwareError(f"the {kind} tracker: {name} is {value!r}; it must be a number above 0.")
    return own


def _module(settings: Mapping[str, Any]) -> ModuleType:
    kind = settings["kind"]
    if kind not in KINDS:
        raise HardwareError(unknown_name("kind of tracker", str(kind), KINDS))
    return import_module(f"bns.hardware.tracking.{kind}")
