"""Trackers by name: each module of `KINDS` has `open_tracker(settings, clock)`."""

from __future__ import annotations

from collections.abc import Mapping
from importlib import import_module
from typing import Any

from bns.errors import HardwareError, unknown_name
from bns.hardware.clock import Clock
from bns.hardware.tracking.sight import Tracker

KINDS = ("aruco", "colour", "wii")


def open_tracker(settings: Mapping[str, Any], clock: Clock) -> Tracker:
    """The tracker that a rig names, looking; HardwareError if the kind is unknown or its device cannot be used."""
    kind = settings["kind"]
    if kind not in KINDS:
        raise HardwareError(unknown_name("kind of tracker", kind, KINDS))
    own = {name: value for name, value in settings.items() if name != "kind"}
    tracker: Tracker = import_module(f"bns.hardware.tracking.{kind}").open_tracker(own, clock)
    return tracker


def taken(kind: str, settings: Mapping[str, Any], needed: tuple[str, ...], others: tuple[str, ...] = ()) -> Mapping[str, Any]:
    """The settings, if they are those that a kind needs and may have; HardwareError otherwise."""
    missing = [name for name in needed if name not in settings]
    if missing:
        raise HardwareError(f"the {kind} tracker of the rig lacks {', '.join(missing)}; it needs {', '.join(needed)}.")
    unknown = [name for name in settings if name not in {*needed, *others}]
    if unknown:
        raise HardwareError(f"the {kind} tracker: {unknown_name('setting', unknown[0], [*needed, *others])}")
    return settings
