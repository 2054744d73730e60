"""Trackers by name: each is a module here, or of an installed package, that looks like `TrackerKind`."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any, NamedTuple, Protocol

import numpy as np

from bns.errors import HardwareError, unknown_name
from bns.hardware.clock import Clock
from bns.hardware.tracking.sight import Tracker
from bns.registry import TRACKERS


class Settings(NamedTuple):
    """Names of a kind's settings: those it needs, others that it may have, and which of all these are sizes, numbers above 0."""

    needed: tuple[str, ...]
    others: tuple[str, ...]
    sizes: tuple[str, ...]


class Device(Protocol):
    """An emulated device, which can be taken away again."""

    def close(self) -> None:
        """Take it away."""


class TrackerKind(Protocol):
    """What the module of a tracker has."""

    SETTINGS: Settings
    emulate: Callable[..., tuple[dict[str, Any], Device]] | None
    """``emulate(settings, folder, pose, clock, faults, seed)``: an emulated device in a folder that watches a rigid robot, whose
    pose (3,) ``pose(t_s)`` tells; the tracker's settings with the device's address, and the device. None: it has no emulation."""

    def open_tracker(self, settings: Mapping[str, Any], clock: Clock) -> Tracker:
        """The tracker of a rig, looking; HardwareError if its device cannot be used."""


Pose = Callable[[float], np.ndarray]
DELAY = "delay_s"
"""A setting of every kind: how much older than its time stamp a pose is (`bns calibrate --delay` measures it)."""
_MOST_DELAY_S = 1.0
_MOST_SIZE = {"_m": (20.0, "in metres, not millimetres"), "_rad": (math.pi, "in radians, not degrees")}
"""End of a size's name -> more than it can be, and its unit."""


def delay_of(settings: Mapping[str, Any]) -> float:
    """The delay in a rig's settings, s, 0 without one; HardwareError if it makes no sense."""
    value = settings.get(DELAY, 0.0)
    if isinstance(value, bool) or not isinstance(value, int | float) or not abs(value) <= _MOST_DELAY_S:
        raise HardwareError(f"the tracker's {DELAY} is {value!r}; it is a number of seconds, up to {_MOST_DELAY_S:g}.")
    return float(value)


def open_tracker(settings: Mapping[str, Any], clock: Clock) -> Tracker:
    """The tracker that a rig names, looking; HardwareError if the kind is unknown or its device cannot be used."""
    return kind_of(settings).open_tracker(checked(settings), clock)


def kind_of(settings: Mapping[str, Any]) -> TrackerKind:
    """The kind of tracker that a rig's settings name; HardwareError lists those there are."""
    kind: TrackerKind = TRACKERS.load(str(settings["kind"]))
    return kind


def emulated(
    settings: Mapping[str, Any], folder: Path, pose: Pose, clock: Clock, faults: Any, seed: int
) -> tuple[dict[str, Any], Device]:
    """An emulated device for the tracker of a rig, as `TrackerKind.emulate` says; HardwareError if its kind has none."""
    own = checked(settings)
    emulate = kind_of(settings).emulate
    if emulate is None:
        raise HardwareError(f"the {settings['kind']} tracker has no emulation; name a rig with another tracker, such as wii.")
    kept = {name: settings[name] for name in ("kind", DELAY) if name in settings}
    found, device = emulate(
        {"kind": settings["kind"], **own}, folder, lambda t_s: pose(faults.filmed_s(t_s)), clock, faults, seed
    )
    return {**found, **kept}, device


def checked(settings: Mapping[str, Any]) -> Mapping[str, Any]:
    """The settings of the kind's own; HardwareError names one that is missing, unknown or makes no sense."""
    module, kind = kind_of(settings), settings["kind"]
    delay_of(settings)
    own = {name: value for name, value in settings.items() if name not in {"kind", DELAY}}
    needed, others, sizes = module.SETTINGS
    missing = [name for name in needed if name not in own]
    if missing:
        raise HardwareError(f"the {kind} tracker of the rig lacks {', '.join(missing)}; it needs {', '.join(needed)}.")
    unknown = [name for name in own if name not in {*needed, *others}]
    if unknown:
        raise HardwareError(f"the {kind} tracker: {unknown_name('setting', unknown[0], [*needed, *others, DELAY])}")
    for name in sizes:
        value = own.get(name, 1.0)
        if isinstance(value, bool) or not isinstance(value, int | float) or not 0.0 < value < math.inf:
            raise HardwareError(f"the {kind} tracker: {name} is {value!r}; it must be a number above 0.")
        most, unit = next((limit for end, limit in _MOST_SIZE.items() if name.endswith(end)), (math.inf, ""))
        if value > most:
            raise HardwareError(f"the {kind} tracker: {name} is {value:g}; at most {most:.3g}. It is {unit}.")
    return own
