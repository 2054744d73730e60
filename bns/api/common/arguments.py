"""Arguments of another type than is meant: said in a sentence before any work, as an error of the package."""

from __future__ import annotations

from collections.abc import Iterable
from os import PathLike, fspath
from pathlib import Path
from typing import Any

from bns.errors import DataError, ModelError
from bns.physics.effect import Effect


def named_model(given: Any) -> str:
    """The name or path of a model that is no `Model`. ModelError for anything else."""
    if not isinstance(given, str | PathLike):
        raise ModelError(
            f"The model is given as {type(given).__name__}; give bns.Model(...), a name such as 'khepera', or the path of a "
            "model file. Measurements come first, the model second."
        )
    return str(fspath(given))


def several(what: str, given: Any) -> tuple[Any, ...]:
    """One name, path or effect, or several of them, as a tuple. ModelError for anything else; ``what`` names the argument."""
    each = (given,) if isinstance(given, str | PathLike | Effect) or not isinstance(given, Iterable) else tuple(given)
    for one in each:
        if not isinstance(one, str | PathLike | Effect):
            raise ModelError(f"{what} has {one!r}; give names of bns.effects(), paths of Python files, or bns.Effect.")
    return each


def as_path(given: Any) -> Path:
    """Where something is to be written. DataError for what is no path."""
    if not isinstance(given, str | PathLike):
        raise DataError(f"The file to write is given as {type(given).__name__}; give its path.")
    return Path(given)


def checked_progress(progress: Any) -> None:
    """DataError unless this can be called, or is None."""
    if progress is not None and not callable(progress):
        raise DataError(
            f"progress is {progress!r}; give a function that takes the fraction done (0 to 1, or None) and a text, or None."
        )
