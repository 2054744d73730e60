"""Words of a command line that the commands which follow it repeat: what was given, so that they ask the same."""

from __future__ import annotations

import math
import shlex
from collections.abc import Iterable, Mapping, Sequence
from os import PathLike, fspath
from pathlib import Path
from typing import Any

from bns.physics.effects import effect_in_file
from bns.physics.model import BASES, Model, load_model, model_names

_Path = str | PathLike[str]
_SIZE = 2
"""Numbers of an arena that is given by its width and height."""


def repeated(
    data: _Path,
    model: _Path,
    wheelbase_m: float | None = None,
    more: Iterable[_Path] = (),
    *,
    robot: str | None = None,
    without: Iterable[str] = (),
    also: Iterable[_Path] = (),
    trust_files: Iterable[_Path] = (),
    without_effects: Iterable[str] = (),
    settings: _Path | None = None,
    trust: bool = False,
    minutes: float | None = None,
    arena: str | None = None,
    start: str | None = None,
    speeds: str | None = None,
) -> dict[str, str]:
    """What further commands repeat, quoted for a shell, by what it is for:

    ``data``; ``model``: the model with all that add takes; ``shared``: the same without the model;
    ``search``: as ``model``, with what diagnose, propose and report take; ``area``, ``limits``: what propose takes in
    addition, ``limits`` with the time and the start; ``effect NAME``: the file of an effect of the user's own. There may be
    ``before`` as well: Python that writes the file ``data`` first.
    """
    own, further, named = ([fspath(file) for file in files] for files in (also, more, trust_files))
    common = [*_options("--more", further), *_options("--robot", [robot]), *_options("--without", [*without])]
    common += [*_options("--trust-file", named), *(["--trust"] if trust else [])]
    shared = [*common, *_options("--trust-file", own)]
    thresholds = [None if settings is None else fspath(settings)]
    tried = [*_options("--without-effect", [*without_effects]), *_options("--settings", thresholds)]
    base = ["--model", fspath(model), *([] if wheelbase_m is None else ["--wheelbase", f"{wheelbase_m:g}"])]
    words = {"model": [*base, *shared], "shared": shared, "search": [*base, *common, *_options("--also", own), *tried]}
    files = {f"effect {name}": shlex.quote(file) for name, file in own_files(own).items()}
    quoted = {key: shlex.join(given) for key, given in words.items()}
    return {"data": shlex.quote(fspath(data)), **quoted, **limits(minutes, arena, start, speeds), **files}


def limits(minutes: float | None, arena: str | None, start: str | None, speeds: str | None) -> dict[str, str]:
    """``area`` and ``limits`` of `repeated`."""
    area = _options("--arena", [arena]) + _options("--speeds", [speeds])
    time = _options("--minutes", [None if minutes is None else f"{minutes:g}"])
    return {"area": shlex.join(area), "limits": shlex.join([*time, *area, *_options("--start", [start])])}


def limits_in_words(
    minutes: float | None,
    arena: Sequence[float] | None,
    start: Sequence[float] | None,
    speeds: Sequence[float] | None,
) -> dict[str, str]:
    """The same of what `bns.propose` was given: m, rad (the start's heading) and m/s."""
    size = None if arena is None else "x".join(map(_short, arena)) if len(arena) == _SIZE else ",".join(map(_short, arena))
    pose = None if start is None else ",".join(map(_short, (*start[:2], math.degrees(start[2]))))
    return limits(minutes, size, pose, None if speeds is None else ",".join(map(_short, speeds)))


def _short(number: float) -> str:
    return f"{number:.6g}"


def noted(text: str, words: Mapping[str, str]) -> str:
    """The text, and where its commands read what is only in memory (``before``), how to write that file first."""
    if "before" not in words or "bns " not in text or words["data"] not in text:
        return text
    return f"{text}\nThe commands read {words['data']}. Write it first, in Python: {words['before']}"


def model_words(model: Model) -> dict[str, Any]:
    """The arguments ``model`` and, where the name alone would give another one, ``wheelbase_m``."""
    if model.name in model_names():
        other = model.wheelbase_m != load_model(model.name).wheelbase_m
        return {"model": model.name, "wheelbase_m": model.wheelbase_m if other else None}
    if model.name in {*BASES, Model.name}:
        return {"model": model.base, "wheelbase_m": model.wheelbase_m}
    return {"model": model.name, "wheelbase_m": None}


def own_files(also: Iterable[_Path]) -> dict[str, str]:
    """The files of a user's own effects by the names of these."""
    return {effect_in_file(Path(file)).name: fspath(file) for file in also}


def _options(name: str, values: Sequence[str | None]) -> list[str]:
    """An option once for each value; one that begins with a hyphen is joined to it, so that it is not taken for an option."""
    given = [value for value in values if value is not None]
    return [word for value in given for word in ([f"{name}={value}"] if value.startswith("-") else [name, value])]
