"""Libraries that only some commands need: each belongs to an extra of the package, and its absence names that extra.

Usage, after a module's other imports::

    with extra("snake"):
        import mujoco
"""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from importlib import import_module
from typing import Any

from bns.errors import BnsError

LIBRARIES = {
    "app": ("panel", "bokeh"),
    "approaches": ("pymoo",),
    "bags": ("rosbags",),
    "cluster": ("dask", "distributed", "submitit"),
    "robot": ("cv2", "dynamixel_sdk", "evdev", "serial"),
    "snake": ("imageio_ffmpeg", "mujoco"),
    "torch": ("torch",),
}
"""Extra of the package -> modules that it brings, as they are imported."""


class MissingExtraError(BnsError, ImportError):
    """A library that is not installed; the message says which extra of the package brings it."""


@contextmanager
def extra(name: str) -> Iterator[None]:
    """Around the import of a library of the extra ``name``.

    Raises:
        MissingExtraError: in place of the ModuleNotFoundError of one of its libraries; other errors pass.
    """
    try:
        yield
    except ModuleNotFoundError as error:
        library = (error.name or "").partition(".")[0]
        if library not in LIBRARIES[name]:
            raise
        raise MissingExtraError(
            f"this needs the library {library}, which is not installed; it comes with an extra of the package. "
            f"Install it with: pip install 'bns[{name}]'",
            name=error.name,
        ) from error


def require(name: str, *libraries: str) -> None:
    """MissingExtraError, before anything is written, if one of these ``libraries`` of the extra ``name`` is not installed."""
    with extra(name):
        for library in libraries:
            import_module(library)


def deferred(name: str, module: str) -> Any:
    """The ``module`` of a library of the extra ``name``, imported when it is first used.

    For modules that are also imported where their library is not needed: the diagnosis of wheels knows of robots on joints.

    Raises:
        MissingExtraError: at the first use, if the library is not installed.
    """
    return _Deferred(name, module)


class _Deferred:
    """Stands for a module; what was asked of it once is kept."""

    def __init__(self, name: str, module: str) -> None:
        self._name, self._module = name, module

    def __getattr__(self, attribute: str) -> Any:
        if attribute.startswith("__"):
            raise AttributeError(attribute)
        with extra(self._name):
            value = getattr(import_module(self._module), attribute)
        setattr(self, attribute, value)
        return value
