"""Every effect there is: the modules of this folder, each with one `EFFECT`. A new effect is a new file."""

from __future__ import annotations

import importlib
import pkgutil
from functools import cache

from bns.errors import ModelError, unknown_name
from bns.physics.effect import Effect


@cache
def all_effects() -> dict[str, Effect]:
    """Name -> effect, in alphabetical order of the names."""
    modules = (importlib.import_module(f"{__name__}.{m.name}") for m in pkgutil.iter_modules(__path__))
    return {effect.name: effect for effect in sorted((m.EFFECT for m in modules), key=lambda e: e.name)}


def effect_named(name: str) -> Effect:
    """The effect of that name; ModelError with the names there are."""
    if name not in all_effects():
        raise ModelError(unknown_name("effect", name, all_effects()))
    return all_effects()[name]
