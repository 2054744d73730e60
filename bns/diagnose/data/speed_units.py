"""Speeds in another unit: how far a robot goes, beside how far it was commanded to, stands out where it is a factor between two.

All speeds too large or too small by one factor make ways and turns wrong by it. That looks like wheels of another size and a
wheelbase of another length at once, and no effect of the list should be believed before the unit is right.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache

import numpy as np
from numpy.typing import NDArray

from bns.diagnose.data.mapping import SIZES
from bns.diagnose.settings import DEFAULTS

Array = NDArray[np.float64]
_BAND = DEFAULTS.data.speed_unit_band
_ALIKE, _MOST = DEFAULTS.data.speed_unit_trials
_ONE_WAY = DEFAULTS.data.speed_one_way
_LARGEST_TURN_RAD = DEFAULTS.data.speed_turn_rad
_FEWEST = DEFAULTS.predict.robot_fewest
_LEAST_M = DEFAULTS.predict.robot_clear_m


@dataclass(frozen=True)
class Mistake:
    """A robot that goes ``ratio`` times as far as commanded, what the speeds look like then, and what to write in a mapping."""

    ratio: float
    looks: str
    cure: str

    def __str__(self) -> str:
        return f"left_m_s and right_m_s look like {self.looks}. In the mapping LOG.import.yaml (`bns import`), {self.cure}."


def _entry(unit: str) -> str:
    return f"give left_m_s and right_m_s `{{from: COLUMN, unit: {unit}}}`"


def _converted(unit: str, size: float) -> str:
    kept = f"where there is none, give `scale: {1 / size:.5g}`"
    return f"leave out their conversion (`unit: {unit}`, or `scale: {size:.4g}`); {kept}"


@cache
def mistakes() -> tuple[Mistake, ...]:
    """Each lies far from 1, where a robot's own gain is."""
    rpm, a_minute = float(np.pi / 30), 1.0 / 60.0
    return (
        Mistake(SIZES["km/h"], "km/h", _entry("km/h")),
        Mistake(1 / SIZES["km/h"], "m/s that were taken for km/h", _converted("km/h", SIZES["km/h"])),
        Mistake(
            rpm,
            "turns per minute (rpm) taken for rad/s, or mm/s taken for cm/s",
            f"multiply `scale` (the wheel's radius) by {rpm:.5f}, or give `unit: mm/s`",
        ),
        Mistake(
            1 / rpm,
            "rad/s that were taken for turns per minute (rpm), or cm/s taken for mm/s",
            f"divide `scale` by {rpm:.5f}, or give `unit: cm/s`",
        ),
        Mistake(SIZES["in/s"], "in/s", _entry("in/s")),
        Mistake(a_minute, "metres per minute, or turns per minute taken for turns per second", "multiply `scale` by 0.016667"),
        Mistake(1 / a_minute, "speeds per second that were taken for speeds per minute", "multiply `scale` by 60"),
        Mistake(SIZES["cm/s"], "cm/s", _entry("cm/s")),
        Mistake(1 / SIZES["cm/s"], "m/s that were taken for cm/s", _converted("cm/s", SIZES["cm/s"])),
        Mistake(SIZES["mm/s"], "mm/s", _entry("mm/s")),
        Mistake(1 / SIZES["mm/s"], "m/s that were taken for mm/s", _converted("mm/s", SIZES["mm/s"])),
    )


def mistake_of(ratio: float, within: float | None = None) -> Mistake | None:
    """The mistake by which a robot goes ``ratio`` times as far as commanded, ``within`` a factor; None if there is none such.

    Without a factor: within the narrow band of the setting.
    """
    within = _BAND if within is None else within
    if not np.isfinite(ratio) or ratio <= 0:
        return None
    nearest = min(mistakes(), key=lambda one: abs(np.log(one.ratio / ratio)))
    return nearest if 1 / within < nearest.ratio / ratio < within else None


@dataclass(frozen=True)
class Ways:
    """Windows of about a second, (windows,) each: way commanded forwards (m, negative: backwards) and in all, straight distance
    seen (m), turn seen (rad), number of the trial."""

    forward_m: Array
    commanded_m: Array
    went_m: Array
    turned_rad: Array
    trial: NDArray[np.int64]

    @property
    def ratios(self) -> tuple[Array, NDArray[np.int64]]:
        """How many times as far as commanded the robot went along its arc, and the trials.

        Of windows with much way and neither a reversal nor a large turn.
        """
        half = np.abs(self.turned_rad) / 2
        went = self.went_m / np.sinc(half / np.pi)
        usual = np.median(self.commanded_m) if len(self.commanded_m) else 0.0
        good = (self.commanded_m >= 0.5 * usual) & (self.commanded_m > 0) & (half < _LARGEST_TURN_RAD / 2)
        good &= np.abs(self.forward_m) > _ONE_WAY * self.commanded_m
        return went[good] / self.commanded_m[good], self.trial[good]

    @property
    def ratio(self) -> float:
        """The typical one; not a number where too few windows tell, or the robot hardly moves."""
        ratios, _ = self.ratios
        return float(np.median(ratios)) if len(ratios) >= _FEWEST and np.median(self.went_m) > _LEAST_M else float("nan")


def speed_note(ways: Ways) -> str:
    """What to say of speeds that look like another unit in nearly all trials; "" where they do not."""
    mistake = mistake_of(ways.ratio)
    if mistake is None:
        return ""
    ratios, trial = ways.ratios
    each = np.array([np.median(ratios[trial == one]) for one in np.unique(trial)])
    alike = int((np.abs(np.log(each / mistake.ratio)) < np.log(_ALIKE)).sum())
    trials = len(np.unique(ways.trial))
    if alike < _MOST * trials:
        return ""
    return (
        f"in {alike} of {trials} trials the robot goes about {ways.ratio:.2g} times as far as commanded: {mistake} Correct "
        "that before any effect or wheelbase is believed; if the unit is right, the robot has this gain"
    )
