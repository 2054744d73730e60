"""`bns.effects`: the catalogue of what a model can lack."""

from __future__ import annotations

import pandas as pd

from bns.physics.effect import Effect, Parameter
from bns.physics.effects import all_effects


def effects() -> pd.DataFrame:
    """Every listed effect, a row each, by its name.

    Columns: stage (where in the chain it acts: wheel, body, world, clock, measure), meaning (a sentence), equation, parameters
    (name and SI unit), bounds (lowest to highest that a model may have), plausible (what a sound robot may show), residuals (how
    measurements depart from a model without it), lookalikes (effects that depart in nearly the same way).
    """
    listed = all_effects()
    return pd.DataFrame([_row(effect) for effect in listed.values()], index=pd.Index(listed, name="effect"))


def _row(effect: Effect) -> dict[str, str]:
    return {
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
