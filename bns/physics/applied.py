"""Effects at work: those of the package as they are, a user's own with a check of what they return.

Compiled code reads arrays without looking at their shapes, so what an effect from outside returns is looked at here. What is
wrong with it, or raised in it, is told in a sentence with the effect's name, file and line.
"""

from __future__ import annotations

import dataclasses
import inspect
import traceback
from collections.abc import Callable, Mapping
from functools import partial
from numbers import Real
from types import CodeType
from typing import Any, TypeVar

import numpy as np

from bns.errors import BnsError, EffectError, ModelError, unknown_name
from bns.physics.effect import Effect, of_user
from bns.physics.signals import Array, Body, Wheels

S = TypeVar("S")


def applied(effect: Effect, signal: S, values: Mapping[str, Any]) -> S:
    """What an effect makes of its stage's signal.

    Of one that is not the package's: EffectError for what it raises and for another thing than the signal with arrays as they
    were; ModelError where its numbers are not finite, or are divided by 0.
    """
    if not effect.is_own:
        result: S = effect.apply(signal, **values)
        return result
    shown = _read_only(signal)
    try:
        given = effect.apply(shown, **values)
    except (BnsError, MemoryError):
        raise
    except ArithmeticError as fault:  # as of a formula: it may have no value at these numbers alone
        raise ModelError(_does_not_run(effect, effect.apply, fault)) from fault
    except Exception as fault:
        raise EffectError(_raised(effect, signal, values, fault)) from fault
    return _own_arrays(_checked(effect, shown, given, values), shown, signal)


def starts_of(effect: Effect, wheels: Wheels) -> tuple[tuple[float, ...], ...]:
    """What ``starts_from`` finds in commands and poses; nothing if it finds none. EffectError as of `applied`."""
    find = effect.starts_from
    if find is None:
        return ()
    if not of_user(find):
        return find(wheels)
    found = _called(effect, find, wheels)
    names = [p.name for p in effect.parameters]
    try:
        starts = tuple(tuple(float(value) for value in start) for start in (() if found is None else found))
    except (TypeError, ValueError):
        starts = ((),)
    if any(len(start) != len(names) or np.isnan(start).any() for start in starts):
        must = f"it must return a list of tuples, each with one number for {', '.join(names)}, or nothing"
        raise EffectError(_said(effect, find, f"its starts_from returned {found!r}; {must}."))
    return starts


def words_of(effect: Effect, values: Mapping[str, float]) -> str:
    """What ``sized_by`` says of these values; "" where there is none. EffectError as of `applied`."""
    say = effect.sized_by
    if say is None or not of_user(say):
        return say(values) if say is not None else ""
    said = _called(effect, say, values)
    if not isinstance(said, str):
        raise EffectError(_said(effect, say, f'its sized_by returned {_shown(said)}; it must return a text, or "".'))
    return said


def _called(effect: Effect, function: Callable[..., Any], given: Any) -> Any:
    try:
        return function(given)
    except (BnsError, MemoryError):
        raise
    except Exception as fault:
        raise EffectError(_does_not_run(effect, function, fault)) from fault


def _checked(effect: Effect, signal: S, given: Any, values: Mapping[str, Any]) -> S:
    """The signal that an effect returned, if it may take the place of the one before."""
    kind = type(signal)
    if not isinstance(given, kind):
        again = " Is a return missing?" if given is None else ""
        must = f"it must return the {kind.__name__} that it gets, with fields changed by dataclasses.replace"
        raise EffectError(_said(effect, effect.apply, f"its apply returned {_shown(given)}; {must}.{again}"))
    for field in dataclasses.fields(kind):  # type: ignore[arg-type]  # all signals are dataclasses
        before, after = getattr(signal, field.name), getattr(given, field.name)
        if after is before or (after is None and field.default is None):
            continue
        must = _what_it_must_be(signal, before, after)
        if must:
            what = f"its apply returned a {kind.__name__} whose {field.name} is {_shown(after)}; it must be {must}."
            raise EffectError(_said(effect, effect.apply, what))
        if not _finite(before, after):
            what = f"{field.name} is not finite (nan or inf) somewhere on these trials with {dict(values)}"
            write = "Write it so that it is finite for every speed, at rest and in steps of length 0 too."
            raise ModelError(_said(effect, effect.apply, f"{what}. {write}"))
    return given


def _read_only(signal: S) -> S:
    """The signal with views that cannot be written: other effects, in other threads too, start from the same arrays."""
    views = {name: array.view() for name, array in _arrays(signal).items()}
    for view in views.values():
        view.flags.writeable = False
    return dataclasses.replace(signal, **views)  # type: ignore[type-var]  # all signals are dataclasses


def _own_arrays(given: S, shown: S, signal: S) -> S:
    """What an effect returned, with the signal's arrays again in place of their views, and copies of parts of these."""
    views = {id(view): getattr(signal, name) for name, view in _arrays(shown).items()}
    back = {n: views.get(id(a), a) for n, a in _arrays(given).items() if not a.flags.writeable}
    parts = {n: a.copy(order="K") if a is getattr(given, n) else a for n, a in back.items()}
    return dataclasses.replace(given, **parts)  # type: ignore[type-var]  # all signals are dataclasses


def _arrays(signal: Any) -> dict[str, Array]:
    values = {field.name: getattr(signal, field.name) for field in dataclasses.fields(signal)}
    return {name: value for name, value in values.items() if isinstance(value, np.ndarray)}


def _what_it_must_be(signal: Any, before: Any, after: Any) -> str:
    """What a field must be that an effect changed; "" where it is."""
    if before is None or isinstance(before, np.ndarray):
        of = _shape(signal) if before is None else before.shape
        shape = after.shape if type(after) is np.ndarray and after.dtype == np.float64 else None
        if shape is not None and of == (shape[: len(of)] if before is None else shape):
            return ""
        return f"an array of float64 of the shape {of}, as before; write np.full_like(array, number) for a single number"
    if _is_number(before):
        return "" if _is_number(after) else "a number"
    if isinstance(before, tuple):
        alike = isinstance(after, tuple) and (
            not before or not all(map(_is_number, before)) or (len(after) == len(before) and all(map(_is_number, after)))
        )
        return "" if alike else f"a tuple, as before ({before!r})"
    return "" if isinstance(after, type(before)) else f"a {type(before).__name__}, as before"


def _finite(before: Any, after: Any) -> bool:
    """Is a field finite wherever it was so before? Times and poses are NaN where a trial has ended."""
    if not (isinstance(after, np.ndarray) or _is_number(after)):
        return True
    fine = np.isfinite(after)
    return bool(fine.all()) or (before is not None and bool((fine | ~np.isfinite(before)).all()))


def _shape(signal: Any) -> tuple[int, ...]:
    """(batch, steps)."""
    values: Array = getattr(signal, dataclasses.fields(signal)[0].name)
    return values.shape


def _is_number(value: Any) -> bool:
    return isinstance(value, Real) and not isinstance(value, bool)


def _shown(value: Any) -> str:
    """What somebody's function returned, in words."""
    if value is None:
        return "nothing (None)"
    if isinstance(value, np.ndarray):
        return f"an array of {value.dtype} of the shape {value.shape}"
    return f"the number {value}" if _is_number(value) else f"an object of the type {type(value).__name__}"


def _raised(effect: Effect, signal: Any, values: Mapping[str, Any], fault: Exception) -> str:
    """What is wrong with an effect whose ``apply`` raised this."""
    apply, kind = effect.apply, type(signal).__name__
    if isinstance(fault, AttributeError) and isinstance(fault.obj, type(signal)):
        return _said(effect, apply, _not_there(fault), fault)
    if "read-only" in str(fault) or "readonly" in str(fault):
        what = f"its apply writes into the arrays of the {kind} that it gets, and others use these"
        return _said(effect, apply, f"{what}. Let it return dataclasses.replace(...) with new arrays.", fault)
    called = fault.__traceback__ is not None and fault.__traceback__.tb_next is None
    if isinstance(fault, TypeError) and called:  # not raised within it: it was never entered
        must = f"def apply({', '.join([kind.lower(), *values])})"
        return _said(effect, apply, f"its apply cannot be called: {fault}. It must be {must}: the names of its parameters.")
    return _does_not_run(effect, apply, fault)


def _does_not_run(effect: Effect, function: Callable[..., Any], fault: Exception) -> str:
    return _said(effect, function, f"{type(fault).__name__}: {fault}.", fault, " does not run")


def _said(effect: Effect, function: Callable[..., Any], what: str, fault: Exception | None = None, verb: str = "") -> str:
    """The effect, the file and the line of its Python where they are known, and what is wrong."""
    code = _code(function)
    if code is None:
        return f"The effect {effect.name}{verb}: {what}"
    passed = traceback.walk_tb(fault.__traceback__ if fault is not None else None)
    lines = [line for frame, line in passed if frame.f_code.co_filename == code.co_filename]
    line = lines[-1] if lines else code.co_firstlineno
    return f"The effect {effect.name} in {code.co_filename}{verb} (line {line}): {what}"


def _code(function: Any) -> CodeType | None:
    """The Python of a function, also behind `partial`, a decorator or Numba; of an object that is called."""
    while isinstance(function, partial):
        function = function.func
    function = inspect.unwrap(getattr(function, "py_func", function))
    if not hasattr(function, "__code__"):
        function = type(function).__call__
    found: CodeType | None = getattr(function, "__code__", None)
    return found


def _not_there(fault: Any) -> str:
    """What a signal has in place of an attribute that it has not."""
    kind = type(fault.obj)
    fields = [field.name for field in dataclasses.fields(kind)]
    properties = [name for name, value in vars(kind).items() if isinstance(value, property)]
    hint = " The heading is body.place[..., 2], with needs_place=True in the effect." if "heading" in str(fault.name) else ""
    return unknown_name(f"field of {kind.__name__}", fault.name, [*fields, *properties]) + (hint if kind is Body else "")
