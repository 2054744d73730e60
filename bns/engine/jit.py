"""How the kernels are compiled: cached on disk, without the interpreter lock, for whole vector registers."""

from __future__ import annotations

import os
from collections.abc import Callable
from typing import Any

import llvmlite.binding as llvm
import numba

# LLVM uses half of a 512-bit register unless told otherwise; training is a quarter faster with all of it.
# Left alone where the user has chosen processor features.
_features = llvm.get_host_cpu_features()
if "NUMBA_CPU_FEATURES" not in os.environ and _features.get("avx512f"):
    numba.config.CPU_FEATURES = _features.flatten() + ",-prefer-256-bit"  # type: ignore[attr-defined]  # set from the environment otherwise

# No "nnan" and "ninf": failed arithmetic must stay visible as NaN.
_FAST_FLAGS = {"reassoc", "contract", "arcp", "nsz", "afn"}


def fast(function: Callable[..., Any]) -> Any:
    """Compile a vector loop; sums may be reordered (same order every time on one kind of CPU)."""
    return numba.njit(nogil=True, cache=True, error_model="numpy", fastmath=_FAST_FLAGS)(function)


def exact(function: Callable[..., Any]) -> Any:
    """Compile with arithmetic as written."""
    return numba.njit(nogil=True, cache=True, error_model="numpy")(function)


def inline(function: Callable[..., Any]) -> Any:
    """A helper that disappears into the kernel that calls it, and takes its arithmetic rules."""
    return numba.njit(inline="always", error_model="numpy")(function)
