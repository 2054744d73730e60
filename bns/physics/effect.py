"""What an effect is: one physical reason why the ideal differential drive is wrong."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Any

from bns.errors import ModelError, unknown_name
from bns.physics.order import ORDER, OTHERS, place

STAGES = ("wheel", "body", "world", "clock", "measure")
"""In the order in which they act; `bns.physics.signals` says what each one passes on."""


@dataclass(frozen=True)
class Parameter:
    """A number of an effect, in SI units. At ``neutral`` the effect changes nothing.

    Outside ``low..high`` the model is refused; ``plausible`` is what a sound robot may show.
    """

    name: str
    unit: str
    low: float
    high: float
    plausible: tuple[float, float]
    neutral: float
    text: str
    column: str = ""
    """The column of measurements this number goes with: known only where that was logged (battery_v)."""
    instead_of: str = ""
    """It stands back where this column was logged."""


@dataclass(frozen=True)
class Effect:
    """One file of `bns.physics.effects`, or one object that a package announces in the group ``bns.effects``.

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
    """What happens, in everyday words, to stand after "the model misses that"; may be empty, as may all that follow."""
    measurement: str = ""
    """What else could be measured that sees this effect alone."""
    beside: Mapping[str, str] = field(default_factory=dict, hash=False)
    """Another effect -> how to tell the two apart, where a verdict names both."""
    explained_by: tuple[str, ...] = ()
    """Columns of measurements of which one should be logged where a verdict names the effect..."""
    caveat: str = ""
    """...and what to beware of where none was."""
    after: str = OTHERS
    """Its place in the chain, unless `bns.physics.order.ORDER` lists it: right after this entry of that tuple."""
    starts: tuple[tuple[float, ...], ...] = ()
    """Values from which a fit may begin; empty where any few values along each number do."""
    needs_place: bool = False
    """Does it look at `Body.place`?"""
    per_trial_allowed: bool = False
    """May its one number have another value in every trial? Only effects of the stage ``clock`` may."""

    def __post_init__(self) -> None:
        for kind, given, valid in (("stage of an effect", self.stage, STAGES), ("place of an effect", self.after, ORDER)):
            if given not in valid:
                raise ModelError(f"effect {self.name}: {unknown_name(kind, given, valid)}")

    @property
    def in_words(self) -> str:
        """Its sentence; its name where nobody wrote one."""
        return self.sentence or f"the effect “{self.name}”"

    @property
    def place(self) -> float:
        """Where it acts, among all effects: lower places first."""
        return place(self.name, self.after)

    @property
    def of_measuring(self) -> bool:
        """Is it a fault of the measuring, not of the robot?"""
        return self.stage in {"clock", "measure"}

    @property
    def neutral(self) -> dict[str, float]:
        """The values at which the effect changes nothing."""
        return {p.name: p.neutral for p in self.parameters}

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
