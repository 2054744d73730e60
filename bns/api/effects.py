"""`bns.effects`: the catalogue of what a model can lack."""

from __future__ import annotations

from typing import TYPE_CHECKING

from bns.errors import ModelError, unknown_name
from bns.physics.effect import Effect, Parameter
from bns.physics.effects import all_effects
from bns.registry import JOINT_EFFECTS

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


def joint_names() -> list[str]:
    """Names of the effects of bodies on joints (the snake, or an MJCF model)."""
    return list(JOINT_EFFECTS.names())


def described(name: str) -> list[dict[str, str]]:
    """All that is known of an effect: its row, how to measure it and tell it apart; two if wheels and joints have one each.

    Raises:
        ModelError: there is no such effect.
    """
    wheels, joints = all_effects(), joint_names()
    if name not in {*wheels, *joints}:  # weak-joint-elbow: of one joint, link or point of a robot that is not at hand
        whole = (one for one in joints if name.startswith(f"{one}-") and hasattr(JOINT_EFFECTS.load(one), "anywhere"))
        name = max(whole, key=len, default=name)
    found = [("wheels", wheels[name])] if name in wheels else []
    part = JOINT_EFFECTS.load(name) if name in joints else None  # one for the body, or one for each joint, link or point
    found += [("bodies on joints", getattr(part, "anywhere", part))] if part is not None else []
    if not found:
        raise ModelError(unknown_name("effect", name, sorted({*wheels, *joints})))
    return [
        {
            **_row(effect),
            "of": of,
            "measurement": effect.measurement,
            "told_apart": " ".join(effect.beside.values()),
            "or_of_robot": effect.or_of_robot,
            "assumes": effect.assumes,
            "extends": ", ".join(name for name in (effect.extends, *effect.contains) if name),
        }
        for of, effect in found
    ]


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
