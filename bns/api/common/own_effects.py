"""An effect of the user's own that fails while it is simulated: said in a sentence, not as a traceback of the library's."""

from __future__ import annotations

import dataclasses
import traceback
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from types import CodeType
from typing import Any

from bns.errors import BnsError, ModelError, unknown_name
from bns.physics.effect import Effect
from bns.physics.signals import Body, Flow, Stamps, View, Wheels

SIGNALS = (Wheels, Body, Flow, Stamps, View)
_OF_FILES = "bns_effect_"
"""What `bns.physics.effects.effect_in_file` begins the name of a file's module with."""


@contextmanager
def own_effects_named() -> Iterator[None]:
    """ModelError for what is raised in the Python of an effect that is not the library's, also as a decorator."""
    try:
        yield
    except (BnsError, MemoryError):
        raise
    except Exception as fault:
        said = _said(fault)
        if said is None:
            raise
        raise ModelError(said) from fault


def _said(fault: Exception) -> str | None:
    """Which effect of which file, and what is wrong with it; None for a fault that is of no such effect."""
    frames = [frame for frame, _ in traceback.walk_tb(fault.__traceback__)]
    own = next((f for f in reversed(frames) if str(f.f_globals.get("__name__", "")).startswith(_OF_FILES)), None)
    of_signal = isinstance(fault, AttributeError) and isinstance(fault.obj, SIGNALS)
    if own is None and of_signal and not str(frames[-1].f_globals.get("__name__", "")).startswith("bns."):
        own = frames[-1]
    if own is None:
        return None
    name, file = _effect_with(own.f_globals, own.f_code), own.f_globals.get("__file__", own.f_code.co_filename)
    line = next(at for frame, at in traceback.walk_tb(fault.__traceback__) if frame is own)
    which = f"The effect {name} in {Path(file)}" if name else f"An effect in {Path(file)}"
    if of_signal:
        return f"{which} (line {line}): {_not_there(fault)}"
    return f"{which} does not run (line {line}): {type(fault).__name__}: {fault}."


def _not_there(fault: Any) -> str:
    """What a signal has in place of an attribute that it has not."""
    kind = type(fault.obj)
    fields = [field.name for field in dataclasses.fields(kind)]
    properties = [name for name, value in vars(kind).items() if isinstance(value, property)]
    hint = " The heading is body.place[..., 2], with needs_place=True in the effect." if "heading" in str(fault.name) else ""
    return unknown_name(f"field of {kind.__name__}", fault.name, [*fields, *properties]) + (hint if kind is Body else "")


def _effect_with(names: dict[str, Any], code: CodeType) -> str:
    """The name of the effect of a module: its EFFECT, or the one that is applied by this code; "" where nobody knows."""
    effects = [value for value in (names.get("EFFECT"), *names.values()) if isinstance(value, Effect)]
    applied = [each for each in effects if getattr(each.apply, "__code__", None) is code]
    return next((each.name for each in (*applied, *effects[:1])), "")
