"""`bns.effects`: the catalogue of what a model can lack."""

from __future__ import annotations

from typing import TYPE_CHECKING

from bns.physics.effect import Effect, Parameter
from bns.physics.effects import all_effects

if TYPE_CHECKING:  # a quarter of a second to load, and the command needs no table
    import pandas as pd


def effects() -> pd.DataFrame:
    """Every listed effect, a row each, by its name.

    Columns: stage (where in the chain it acts: wheel, body, world, clock, measure), meaning (a sentence), equation, parameters
    (name and SI unit), bounds (lowest to highest that a model may have), plausible (what a sound robot may show), residuals (how
    measurements depart from a model without it), lookalikes (effects that depart in nearly the same way).
    """
    import pandas as pd  # noqa: PLC0415  # as above

    return pd.DataFrame(rows()).set_index("effect")


def rows() -> list[dict[str, str]]:
    """The same, a dictionary an effect, with its name as ``effect``."""
    return [_row(effect) for effect in all_effects().values()]


def _row(effect: Effect) -> dict[str, str]:
    return {
        "effect": effect.name,
        "stage": effect.stage,
        "meaning": effect.in_words,
        "equation": effect.equation,
        "parameters": "; ".join(f"{p.name} ({p.unit}): {p.text}" for p in effect.parameters),
        "bounds": "; ".join(_range(p, p.low, p.high) for p in effect.parameters),
        "plausible": "; ".join(_range(p, *p.plausible) for p in effect.parameters),
        "residuals": effect.residuals,
        "lookalikes": ", ".join(effect.lookalikes),
    }


def _range(p: Parameter, low: float, high: float) -> str:
    return f"{p.name} {low:g} to {high:g}"
