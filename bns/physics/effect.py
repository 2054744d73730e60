"""What an effect is: one physical reason why the ideal differential drive is wrong."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from functools import cached_property, partial
from typing import Any

import numpy as np

from bns.errors import ModelError, unknown_name
from bns.physics.order import ORDER, OTHERS, place
from bns.physics.signals import Array, Wheels

STAGES = ("wheel", "body", "world", "clock", "measure")
"""In the order in which they act; `bns.physics.signals` says what each one passes on."""
JOINTED_STAGES = ("mechanics", "sight")
"""Of bodies on joints: what they are, and what a camera makes of them (`bns.physics.jointed.plant`)."""


NEEDS = ("", "track", "motions")
"""What data an effect is about: any; tracks in one frame, with a start and times; or single relative motions alone."""
REFERENCE_WHEELBASE_M = 0.0884
"""Of the Khepera III, for which ranges and starts are written down."""


@dataclass(frozen=True)
class Parameter:
    """A parameter of an effect, in SI units. At ``neutral`` the effect changes nothing.

    A value outside ``low..high`` is refused; ``plausible`` is the range of a robot without a defect.
    """

    name: str
    unit: str
    low: float
    high: float
    plausible: tuple[float, float]
    neutral: float
    text: str
    column: str = ""
    """A column of the measurements that the parameter needs (battery_v): it is fitted only if that was logged."""
    instead_of: str = ""
    """A column of the measurements: if it was logged, another parameter is fitted in place of this one."""
    size_power: float = 0.0
    """The plausible range and the start values grow with this power of the wheelbase: 1 for lengths and speeds."""
    floor_share: float = 0.0
    """Upper bound of a length, in diagonals of the area where the robot was seen; 0: no such bound. Of a place (`floor_axis`):
    how far from that area it may be, on either side."""
    floor_axis: str = ""
    """x or y: a place, plausible as far from the area where the robot was seen as that is long (its diagonal)."""
    trial_share: float = 0.0
    """Upper bound of a time, as a fraction of the longest trial; 0: no such bound."""
    reached: tuple[float, ...] = ()
    """Bounds at which a fit may end, because real robots reach them: the strength of a servo without torque."""
    resolution: float = 0.0
    """A small change that is still visible in data; 0: a thousandth of the plausible range."""
    of_any_size: bool = False
    """Is its size not known before it is fitted, as of a number in a formula? Steps for differences go by what they change."""
    jagged: bool = False
    """Whether the likelihood has steps or kinks along it, at commands, ticks or poses: its interval needs a search."""

    @property
    def is_multiple(self) -> bool:
        """Does it multiply something, neutral at 1? Then a half and a double are equal changes."""
        return self.neutral == 1.0 and self.unit == "1" and self.plausible[0] > 0

    def part_way(self, share: float, upwards: bool) -> float:
        """A value so far from neutral to an end of the plausible range, as a share; of a multiple by ratio. Not beyond a bound.

        Where the range ends at neutral on that side, a quarter of the whole range takes the end's place.
        """
        end, bound = (self.plausible[1], self.high) if upwards else (self.plausible[0], self.low)
        if end == self.neutral:
            end += (0.25 if upwards else -0.25) * (self.plausible[1] - self.plausible[0])
        by_ratio = self.is_multiple and end > 0
        value = float(end**share) if by_ratio else self.neutral + share * (end - self.neutral)
        return min(value, bound) if upwards else max(value, bound)

    def apart(self, one: float, other: float) -> float:
        """How far two values are from one another, as a share of the plausible range; of a multiple by ratio."""
        low, high = self.plausible
        if self.is_multiple and min(one, other) > 0:
            return float(abs(np.log(one / other)) / np.log(high / low))
        return abs(one - other) / (high - low)

    def beside(self, value: float, share: float) -> float:
        """The value so far from another, up or (negative) down, in the unit of `apart`. Not beyond a bound."""
        low, high = self.plausible
        by_ratio = self.is_multiple and value > 0
        moved = value * (high / low) ** share if by_ratio else value + share * (high - low)
        return float(np.clip(moved, self.low, self.high))

    def within(self, low_m: Array, high_m: Array) -> Parameter:
        """The parameter for a robot that was seen between these corners (x, y): its `floor_share`, its `floor_axis`."""
        diagonal_m = float(np.hypot(*(high_m - low_m)))
        if self.floor_axis:
            axis, far_m = "xy".index(self.floor_axis), diagonal_m * (self.floor_share or 1.0)
            ends = float(low_m[axis]) - far_m, float(high_m[axis]) + far_m
            if not self.floor_share:
                return replace(self, plausible=ends)
            return replace(self, low=ends[0], high=ends[1], plausible=ends, neutral=float(np.clip(self.neutral, *ends)))
        if not self.floor_share:
            return self
        high = max(self.floor_share * diagonal_m, 4.0 * self.low)
        neutral = min(self.neutral, high) if np.isfinite(self.neutral) else self.neutral
        return replace(self, high=high, plausible=(min(self.plausible[0], high / 2.0), high), neutral=neutral)

    def lasting(self, longest_s: float) -> Parameter:
        """The parameter, bounded to its `trial_share` of trials of which the longest takes so long."""
        if not self.trial_share:
            return self
        high = min(self.high, max(self.trial_share * longest_s, 4.0 * self.low))
        low, most = (min(end, high) for end in self.plausible)
        return replace(self, high=high, plausible=(low, most), neutral=min(self.neutral, high))

    def scaled(self, ratio: float) -> Parameter:
        """The parameter for a robot whose wheelbase is ``ratio`` times that of the reference; its bounds stay."""
        factor = ratio**self.size_power
        if factor == 1.0:
            return self
        low, high = (float(np.clip(v * factor, self.low, self.high)) for v in self.plausible)
        return replace(self, plausible=(low, high), resolution=self.resolution * factor)


@dataclass(frozen=True)
class Effect:
    """One physical effect: a file of `bns.physics.effects`, or an object that a package announces as ``bns.effects``.

    ``apply(signal, **values)`` returns the stage's signal (`Wheels`, `Body`, `Flow`, `Stamps`, `View`) with the effect
    added; its keywords are the parameters' names. ``residuals`` says how measurements depart from a model
    without the effect, ``lookalikes`` which other effects depart in nearly the same way.
    """

    name: str
    stage: str
    parameters: tuple[Parameter, ...]
    equation: str
    residuals: str
    lookalikes: tuple[str, ...]
    apply: Callable[..., Any] = field(repr=False)
    sentence: str = ""
    """What happens, as a clause after "Missing from the model:"; may be empty, like all fields below."""
    sized: str = ""
    """The sentence with fitted numbers, a format string: ``{tau_s}`` is a number with its unit, ``{gain:faster|slower}`` how far
    it is from neutral and the word for above or below ("7 % slower"), ``{gain:faster|slower|}`` that word alone. A plus
    before the words, ``{left_m:+to its left|to its right}``, says the side even of a number that may be neutral."""
    sized_by: Callable[[Mapping[str, float]], str] | None = field(default=None, repr=False)
    """Instead of ``sized``, from all its numbers together; "" where the general sentence is to stand."""
    measurement: str = ""
    """A measurement on the bench that shows this effect alone."""
    or_of_robot: str = ""
    """Of a fault of the measuring: what the robot itself may do to leave the same log, as a clause."""
    beside: Mapping[str, str] = field(default_factory=dict, hash=False)
    """Name of another effect -> how to tell the two apart, if a verdict names both."""
    explained_by: tuple[str, ...] = ()
    """Columns of measurements; one of them should be logged if a verdict names the effect."""
    caveat: str = ""
    """The warning that is given if none of them was logged."""
    assumes: str = ""
    """What it takes for granted of a log that no column could tell, and what its numbers are where that does not hold."""
    after: str = OTHERS
    """Its place in the order of effects, unless `bns.physics.order.ORDER` lists it: right after this entry."""
    starts: tuple[tuple[float, ...], ...] = ()
    """Start values of a fit; empty if a few values along each parameter are enough."""
    starts_from: Callable[[Wheels], tuple[tuple[float, ...], ...]] | None = field(default=None, repr=False)
    """Instead of ``starts``: from commands and tracked poses (`Conditions.seen`), for effects with a place or a period."""
    needs: str = ""
    """One of `NEEDS`."""
    needs_place: bool = False
    """Whether it depends on the position of the robot (`Body.place`, or the place in a `View`)."""
    revision: int = 1
    """Raised whenever the same values would give other numbers; part of the digest of models that have the effect."""
    per_trial_allowed: bool = False
    """Whether its one parameter may have another value in each trial. Only effects of the stage ``clock`` may."""
    extends: str = ""
    """Name of a simpler effect that this one equals at neutral values of the parameters that only this one has.

    A search tries it in the place of that effect, once that one is accepted or where the model has it.
    """
    contains: tuple[str, ...] = ()
    """Names of other effects that this one equals at neutral values of what only it has; they extend the same one, or it extends
    what extends them.
    """

    def __post_init__(self) -> None:
        for kind, given, valid in (
            ("stage of an effect", self.stage, (*STAGES, *JOINTED_STAGES)),
            ("place of an effect", self.after, ORDER),
            ("need of an effect", self.needs, NEEDS),
        ):
            if given not in valid:
                raise ModelError(f"effect {self.name}: {unknown_name(kind, given, valid)}")

    def __hash__(self) -> int:
        """By its name alone: effects are keys of caches that a search asks thousands of times."""
        return hash(self.name)

    def scaled(self, wheelbase_m: float) -> Effect:
        """The effect with ranges and start values for a robot with this wheelbase, m."""
        ratio = wheelbase_m / REFERENCE_WHEELBASE_M
        if ratio == 1.0 or not any(p.size_power for p in self.parameters):
            return self
        factors = [ratio**p.size_power for p in self.parameters]
        return replace(
            self,
            parameters=tuple(p.scaled(ratio) for p in self.parameters),
            starts=tuple(tuple(v * f for v, f in zip(start, factors, strict=True)) for start in self.starts),
        )

    def within(self, low_m: Array, high_m: Array) -> Effect:
        """The effect with ranges for a robot that was seen between these corners (x, y), m."""
        if not any(p.floor_share or p.floor_axis for p in self.parameters):
            return self
        return replace(self, parameters=tuple(p.within(low_m, high_m) for p in self.parameters))

    def lasting(self, longest_s: float) -> Effect:
        """The effect with ranges and start values for trials of which the longest takes so long, s."""
        if not any(p.trial_share for p in self.parameters):
            return self
        bounded = tuple(p.lasting(longest_s) for p in self.parameters)
        starts = [tuple(min(v, p.high) for v, p in zip(start, bounded, strict=True)) for start in self.starts]
        return replace(self, parameters=bounded, starts=tuple(dict.fromkeys(starts)))

    @property
    def parts(self) -> tuple[str, ...]:
        """Names of the effects in whose place it may come: those that it contains, and what it extends."""
        return (*self.contains, self.extends) if self.extends else self.contains

    @property
    def in_words(self) -> str:
        """Its sentence; without one, its name."""
        return self.sentence or f"the effect “{self.name}”"

    @property
    def place(self) -> float:
        """Where it acts, among all effects: lower places first."""
        return place(self.name, self.after)

    @property
    def of_measuring(self) -> bool:
        """Is it a fault of the measuring, not of the robot?"""
        return self.stage in {"clock", "sight", "measure"}

    @property
    def neutral(self) -> dict[str, float]:
        """The values at which the effect changes nothing."""
        return {p.name: p.neutral for p in self.parameters}

    @cached_property
    def is_own(self) -> bool:
        """Is what it does written by a user, not in this package? Then it is watched (`bns.physics.applied`)."""
        return of_user(self.apply)

    def checked(self, values: Mapping[str, object]) -> tuple[float, ...]:
        """All values in the order of `parameters`; ModelError if one is missing, unknown or out of bounds."""
        names = [p.name for p in self.parameters]
        for name in values:
            if name not in names:
                raise ModelError(unknown_name(f"parameter of {self.name}", name, names))
        missing = [name for name in names if name not in values]
        if missing:
            raise ModelError(
                f"{self.name} lacks {', '.join(missing)}; it needs a value for each of {', '.join(names)}."
            )
        return tuple(number(f"{self.name}: {p.name}", values[p.name], p.low, p.high) for p in self.parameters)


def of_user(function: Callable[..., Any]) -> bool:
    """Is it written outside this package?"""
    while isinstance(function, partial):
        function = function.func
    return not str(getattr(function, "__module__", "")).startswith("bns.")


def number(where: str, value: object, low: float, high: float) -> float:
    """``value`` as a float; ModelError unless it is a number from ``low`` to ``high``."""
    if isinstance(value, int | float) and not isinstance(value, bool) and low <= value <= high:
        return float(value)
    allowed = f"a number from {low:g} to {high:g}"
    raise ModelError(f"{where} is {value!r}; it must be {allowed}.{_yaml_hint(value)}")


def _yaml_hint(value: object) -> str:
    """YAML 1.1 reads 1e-3 as a text, which nobody expects."""
    if not isinstance(value, str):
        return ""
    try:
        float(value)
    except ValueError:
        return ""
    return " It is a text: write it without quotes, and an exponent with a point before it (1.0e-3)."
