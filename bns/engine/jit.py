"""How the kernels are compiled: cached on disk, without the interpreter lock, for whole vector registers."""

from __future__ import annotations

import hashlib
import os
import tempfile
from collections.abc import Callable
from contextlib import suppress
from pathlib import Path
from typing import Any

import llvmlite.binding as llvm
import numba
from numba.core import cgutils, types
from numba.extending import intrinsic

_PACKAGE = Path(__file__).resolve().parent.parent
_WITH_KERNELS = ("engine", "physics", "robots")
# No "nnan" and "ninf": failed arithmetic must stay visible as NaN.
_config: Any = numba.config
_FAST_FLAGS = {"reassoc", "contract", "arcp", "nsz", "afn"}


def cache_folder() -> Path:
    """Where compiled kernels lie: in the package, else in the user's cache, else in the temporary folder.

    Numba looks only at the date of the file a kernel stands in, not at the helpers it inlines from others; so the
    folder is named after the text of all of them, and a change anywhere begins a new one.
    """
    digest = hashlib.sha256()
    for folder in _WITH_KERNELS:
        for file in sorted((_PACKAGE / folder).rglob("*.py")):
            digest.update(file.read_bytes())
    name = f"kernels-{digest.hexdigest()[:12]}"
    home = os.environ.get("XDG_CACHE_HOME") or str(Path("~/.cache").expanduser())
    for place in (_PACKAGE / "__pycache__" / name, Path(home) / "bns" / name):
        try:
            place.parent.mkdir(parents=True, exist_ok=True)
        except OSError:
            continue
        if os.access(place.parent, os.W_OK):
            return place
    user = f"bns-{os.getuid()}" if hasattr(os, "getuid") else "bns"  # on Windows each user has a folder for these
    return Path(tempfile.gettempdir()) / user / name


def _configure() -> None:
    """Left alone where the user has chosen otherwise through numba's environment variables."""
    if not _config.CACHE_DIR:
        _config.CACHE_DIR = str(cache_folder())
    features = llvm.get_host_cpu_features()
    if _config.CPU_FEATURES is None and features.get("avx512f"):
        # LLVM uses half of a 512-bit register unless told otherwise; training is a quarter faster with all of it.
        _config.CPU_FEATURES = features.flatten() + ",-prefer-256-bit"


_configure()


def _mark(robot: str, world: str) -> Path:
    # One for each text of the kernels, numba and kind of processor: what another has compiled is of no use.
    return Path(_config.CACHE_DIR) / f"{cache_folder().name}-{robot}-{world}-{numba.__version__}-{llvm.get_host_cpu_name()}"


def compiled(robot: str, world: str) -> bool:
    """Whether the kernels of this robot in this world, as they now stand, were compiled on this machine and lie on its disk."""
    return _mark(robot, world).exists()


def note_compiled(robot: str, world: str) -> None:
    """To be called when every kernel that this robot needs in this world has been used once."""
    with suppress(OSError):  # where nothing can be kept, the next process compiles again
        _mark(robot, world).touch()


def fast(function: Callable[..., Any]) -> Any:
    """Compile a vector loop; sums may be reordered (same order every time on one kind of CPU)."""
    return numba.njit(nogil=True, cache=True, error_model="numpy", fastmath=_FAST_FLAGS)(function)


def exact(function: Callable[..., Any]) -> Any:
    """Compile with arithmetic as written."""
    return numba.njit(nogil=True, cache=True, error_model="numpy")(function)


def inline(function: Callable[..., Any]) -> Any:
    """A helper that disappears into the kernel that calls it, and takes its arithmetic rules."""
    return numba.njit(inline="always", error_model="numpy")(function)


@intrinsic
def smaller(_typing, a, b):  # type: ignore[no-untyped-def]  # compiled
    """The smaller of two numbers, b where one of them is NaN: one instruction, where ``min`` and ``if`` are branches."""
    return a(a, a), lambda _context, builder, _signature, ab: builder.select(builder.fcmp_ordered("<", *ab), *ab)


@intrinsic
def larger(_typing, a, b):  # type: ignore[no-untyped-def]  # compiled
    """The larger of two numbers, b where one of them is NaN."""
    return a(a, a), lambda _context, builder, _signature, ab: builder.select(builder.fcmp_ordered(">", *ab), *ab)


def _copy_items(_typing, target, at, source, start, count):  # type: ignore[no-untyped-def]  # compiled
    """As ``target[at : at + count] = source[start : start + count]`` of arrays with one axis, by memcpy: numba's own loop takes
    twice as long over a few items. Nothing is checked, as in any kernel.
    """

    def generate(context, builder, signature, arguments):  # type: ignore[no-untyped-def]
        to, at, of, start, count = arguments
        there, here = (context.make_array(kind)(context, builder, a) for kind, a in ((target, to), (source, of)))
        size = context.get_abi_sizeof(context.get_data_type(target.dtype))
        cgutils.raw_memcpy(builder, builder.gep(there.data, [at]), builder.gep(here.data, [start]), count, size)
        return context.get_dummy_value()

    return types.void(target, types.intp, source, types.intp, types.intp), generate


copy_items: Any = intrinsic(_copy_items)
