"""How the kernels are compiled: cached on disk, without the interpreter lock, for whole vector registers."""

from __future__ import annotations

import atexit
import hashlib
import os
import shutil
import stat
import tempfile
import warnings
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
    name = _text_name()
    home = os.environ.get("XDG_CACHE_HOME") or str(Path("~/.cache").expanduser())
    for place in (_PACKAGE / "__pycache__" / name, Path(home) / "bns" / name):
        try:
            place.parent.mkdir(parents=True, exist_ok=True)
        except OSError:
            continue
        if os.access(place.parent, os.W_OK):
            return place
    return _in_temporary_folder(name)


def _text_name() -> str:
    digest = hashlib.sha256()
    for folder in _WITH_KERNELS:
        for file in sorted((_PACKAGE / folder).rglob("*.py")):
            digest.update(file.read_bytes())
    return f"kernels-{digest.hexdigest()[:12]}"


def _in_temporary_folder(name: str) -> Path:
    """A folder that nobody else can write into: what lies in a cache of kernels is run.

    Everybody knows the name of the lasting one. One that is somebody else's is not used: a new one is made, which the processes
    started from here share through the environment, and the kernels are compiled again next time.
    """
    shared = Path(tempfile.gettempdir())
    if not hasattr(os, "getuid"):  # on Windows each user has a temporary folder
        return shared / "bns" / name
    place = shared / f"bns-{os.getuid()}"
    with suppress(OSError):
        place.mkdir(mode=0o700, exist_ok=True)
        if is_private(place):
            return place / name
    warnings.warn(
        f"{place} is not this user's own folder: compiled kernels are not taken from there but compiled for this process alone. "
        "Remove it, or set XDG_CACHE_HOME to a folder of yours.",
        stacklevel=2,
    )
    place = Path(tempfile.mkdtemp(prefix="bns-"))
    atexit.register(shutil.rmtree, place, ignore_errors=True)
    os.environ["NUMBA_CACHE_DIR"] = str(place / name)
    return place / name


def is_private(folder: Path) -> bool:
    """Whether a folder (not a link to one) belongs to this user, and nobody else may write into it. POSIX only."""
    found = folder.lstat()
    return stat.S_ISDIR(found.st_mode) and found.st_uid == os.getuid() and not found.st_mode & 0o022


MANY_REGISTERS = bool(llvm.get_host_cpu_features().get("avx512f"))
"""Whether the processor has 32 vector registers rather than 16: where that matters, a kernel comes in two forms."""


def _configure() -> None:
    """Left alone where the user has chosen otherwise through numba's environment variables."""
    if not _config.CACHE_DIR:
        _config.CACHE_DIR = str(cache_folder())
    if _config.CPU_FEATURES is None and MANY_REGISTERS:
        # LLVM uses half of a 512-bit register unless told otherwise; training is a quarter faster with all of it.
        _config.CPU_FEATURES = llvm.get_host_cpu_features().flatten() + ",-prefer-256-bit"


_configure()


def _mark(robot: str, world: str) -> Path:
    # One for each text of the kernels, numba and kind of processor: what another has compiled is of no use.
    return Path(_config.CACHE_DIR) / f"{_text_name()}-{robot}-{world}-{numba.__version__}-{llvm.get_host_cpu_name()}"


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
    """Compile with arithmetic as written, also for a kernel compiled with `fast`: numba hands flags on to what is called."""
    return numba.njit(nogil=True, cache=True, error_model="numpy", fastmath=False)(function)


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
