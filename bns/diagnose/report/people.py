"""Units for people: milliseconds, millimetres, degrees."""

from __future__ import annotations

from bns.diagnose.settings import DEFAULTS

_UNITS = {"s": (1e3, "ms"), "m": (1e3, "mm"), "m/s": (1e3, "mm/s"), "rad": (57.29578, "°"), "rad/s": (57.29578, "°/s")}
"""SI unit -> factor and unit for people."""
_LARGE = DEFAULTS.report.large


def unit_for_people(value: float, unit: str) -> tuple[float, str]:
    """By what to multiply a number in SI units that is about so large, and the unit then."""
    if unit in {"s", "m"} and abs(value) >= _LARGE:
        return 1.0, unit
    return _UNITS.get(unit, (1.0, "" if unit == "1" else unit))


def for_people(value: float, unit: str) -> tuple[float, str]:
    """A number in SI units as people say it, and its unit then."""
    factor, shown = unit_for_people(value, unit)
    return factor * value, shown
