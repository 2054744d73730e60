"""Every effect there is: the modules of this folder, each with one `EFFECT`. A new effect is a new file."""

from __future__ import annotations

import importlib
import importlib.util
import pkgutil
from functools import cache
from pathlib import Path

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


def effect_in_file(path: Path) -> Effect:
    """The ``EFFECT`` of a user's Python file; ModelError if there is no such file, or no effect in it."""
    spec = importlib.util.spec_from_file_location(f"bns_effect_{path.stem}", path)
    if spec is None or spec.loader is None or not path.is_file():
        raise ModelError(f"There is no effect file {path}. Give the path of a Python file with an EFFECT in it.")
    module = importlib.util.module_from_spec(spec)
    try:
        spec.loader.exec_module(module)
    except Exception as fault:
        raise ModelError(f"The effect file {path} does not run: {type(fault).__name__}: {fault}.") from fault
    effect = getattr(module, "EFFECT", None)
    if not isinstance(effect, Effect):
        raise ModelError(f"The effect file {path} has no EFFECT; see any file of bns/physics/effects for how one is made.")
    return effect
