"""Every effect there is: the modules of this folder, each with one `EFFECT`, and those of installed packages."""

from __future__ import annotations

import hashlib
import importlib.util
import sys
from functools import cache
from pathlib import Path

from bns.errors import ModelError
from bns.physics.effect import Effect
from bns.physics.order import place
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


def chain_key(effect: Effect, friction_last: bool = False) -> tuple[float, str]:
    """By what effects are sorted into the order in which they act; equals stay as they came."""
    at = place(effect.name, effect.after, friction_last)
    return at, effect.name if EFFECTS.is_plugin(effect.name) else ""


def effect_in_file(path: Path) -> Effect:
    """The ``EFFECT`` of a user's Python file; ModelError if there is no such file, or no effect in it."""
    name = f"bns_effect_{path.stem}_{hashlib.sha256(str(path.resolve()).encode()).hexdigest()[:8]}"
    spec = importlib.util.spec_from_file_location(name, path)
    if spec is None or spec.loader is None or not path.is_file():
        raise ModelError(f"There is no effect file {path}. Give the path of a Python file with an EFFECT in it.")
    module = sys.modules[name] = importlib.util.module_from_spec(spec)  # Numba finds what it has compiled by the module's name
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
