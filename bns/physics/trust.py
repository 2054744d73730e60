"""Whose Python may run: a model file is data, and the Python files that it names run only if somebody said so.

Trust is kept in the environment variable ``BNS_TRUST`` (paths, or ``all``), so that the workers of a sweep have it, too.
"""

from __future__ import annotations

import os
from collections.abc import Iterable
from pathlib import Path

from bns.errors import ModelError
from bns.physics.effect import Effect
from bns.physics.effects import effect_in_file

VARIABLE = "BNS_TRUST"
_ALL = "all"


def trust(files: Iterable[str | os.PathLike[str]]) -> None:
    """Let these Python files run where a model names them, in this process and those that it starts."""
    known = _trusted()
    known += [name for name in (str(Path(file).resolve()) for file in files) if name not in known]
    if known:
        os.environ[VARIABLE] = os.pathsep.join(known)


def trust_all() -> None:
    """Let every Python file run that a model names."""
    os.environ[VARIABLE] = _ALL


def trusted_effect(path: Path, where: str) -> Effect:
    """The effect in a Python file that a model names; ModelError says how to allow it, if nobody did."""
    if _ALL not in _trusted() and str(path.resolve()) not in _trusted():
        raise ModelError(
            f"{where} names the Python file {path}, which is a program and not only numbers. It is not run. If you know what "
            f"it does, allow it: --trust-file {path}; --trust allows every file that a model names (in Python: {VARIABLE}=all in "
            "the environment, which workers on other machines need as well). A package with the effect needs neither: "
            "docs/extending.md."
        )
    return effect_in_file(path)


def _trusted() -> list[str]:
    return [name for name in os.environ.get(VARIABLE, "").split(os.pathsep) if name]
