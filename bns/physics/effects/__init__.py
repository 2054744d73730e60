"""Every effect there is: the modules of this folder, each with one `EFFECT`, and those of installed packages."""

from __future__ import annotations

import importlib.util
from functools import cache
from pathlib import Path

from bns.errors import ModelError
from bns.physics.effect import Effect
from bns.registry import EFFECTS


def effect_names() -> tuple[str, ...]:
    """All names, ours in alphabetical order, then those of packages; no effect is imported."""
    return EFFECTS.names()


@cache
def all_effects() -> dict[str, Effect]:
    """Name -> effect, in the order of `effect_names`; ModelError names a package whose effect cannot be used."""
    return {name: effect_named(name) for name in effect_names()}


def effect_named(name: str) -> Effect:
    """The effect of that name; ModelError with the names there are."""
    effect: Effect = EFFECTS.load(name)
    return effect


def chain_key(effect: Effect) -> tuple[float, str]:
    """By what effects are sorted into the order in which they act; equals stay as they came."""
    return effect.place, effect.name if EFFECTS.is_plugin(effect.name) else ""


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
        raise ModelError(
            f"The effect file {path} has no EFFECT; see any file of bns/physics/effects for how one is made."
        )
    return effect
