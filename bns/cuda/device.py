"""The GPU itself: whether there is one, how much memory it has, and its faults in our words."""

from __future__ import annotations

import importlib
import warnings
from collections.abc import Iterator
from contextlib import contextmanager
from functools import cache
from typing import Any

from bns.errors import DeviceError

_ELSE = "or leave --device out: the CPU gives the same study"
_UNTOLD = "the driver sees none, or numba-cuda's compiler (NVVM) is not there."
_OUT_OF_MEMORY = ("OUT_OF_MEMORY", "out of memory")


class OutOfDeviceMemoryError(Exception):
    """What was asked for does not fit into the GPU's memory now."""


@cache
def device_name() -> str:
    """Name of the GPU, found once by a kernel that ran on it and gave what it should.

    Raises:
        DeviceError: there is none, or its driver is missing or too old.
    """
    try:
        cuda = _module()
        reason = "" if cuda.is_available() else " ".join(str(cuda.cuda_error() or _UNTOLD).split())
    except (ValueError, OSError) as error:  # a driver named by NUMBA_CUDA_DRIVER that is none
        reason = f"{_first_line(error)}."
    if reason:
        raise DeviceError(
            f"--device cuda: no GPU can be used: {reason} Install NVIDIA's driver and pip install 'bns[cuda]', {_ELSE}."
        )
    try:
        return _tried(cuda)
    except DeviceError:
        raise
    except Exception as error:  # of many kinds, from the compiler down to the driver
        if _is_full(error):
            raise full(error) from error
        if isinstance(error, AttributeError):
            raise _mismatched(error) from error
        raise DeviceError(
            f"--device cuda: a GPU is there, but a trial kernel failed: {_first_line(error)}. Most often its driver is older "
            f"than the CUDA version of numba-cuda: update the driver, install an older numba-cuda, {_ELSE}."
        ) from error


def _module() -> Any:
    warnings.filterwarnings("ignore", message=".*Grid size .* under-utilization")  # one run alone is allowed, too
    try:
        return importlib.import_module("numba.cuda")
    except ImportError as error:
        raise DeviceError(
            f"--device cuda needs numba-cuda ({_first_line(error)}). Install it with: pip install 'bns[cuda]', {_ELSE}."
        ) from error
    except AttributeError as error:
        raise _mismatched(error) from error


def _mismatched(error: AttributeError) -> DeviceError:
    """As numba-cuda 0.30 with numpy 2.5, which lacks a function that it asks for: on loading, or with the first kernel."""
    return DeviceError(
        f"--device cuda: numba-cuda does not go with the numpy that is installed ({_first_line(error)}). Install those that go "
        f"together with: pip install 'bns[cuda]', {_ELSE}."
    )


def _tried(cuda: Any) -> str:
    if importlib.import_module("bns.cuda.probe").doubled(4) != [0, 2, 4, 6]:
        raise DeviceError(f"--device cuda: the GPU computes wrong results (twice 1, 2 and 3); have it repaired, {_ELSE}.")
    name = getattr(cuda.current_context().device, "name", "simulated GPU")
    return name.decode() if isinstance(name, bytes) else str(name)


@contextmanager
def faults() -> Iterator[None]:
    """Turn what the driver raises into an error of ours.

    Raises:
        OutOfDeviceMemoryError: the GPU's memory is full, or that of the machine where a batch is put together.
        DeviceError: anything else of the GPU.
    """
    try:
        yield
    except Exception as error:
        if _is_full(error):
            raise OutOfDeviceMemoryError(_first_line(error)) from error
        if type(error).__module__.startswith(("numba.cuda", "numba_cuda", "cuda.")):
            raise DeviceError(
                f"the GPU failed: {_first_line(error)}. What was finished is stored. Check with nvidia-smi that it is there; "
                "then repeat the command, which continues from here."
            ) from error
        raise


def full(error: BaseException) -> DeviceError:
    """Not even the smallest run fits into the GPU's memory."""
    return DeviceError(
        f"--device cuda: the GPU's memory is full ({_first_line(error)}). nvidia-smi lists the programs that use it; wait "
        f"until they end, choose another GPU with CUDA_VISIBLE_DEVICES, {_ELSE}."
    )


def _is_full(error: BaseException) -> bool:
    return isinstance(error, MemoryError) or any(text in str(error) for text in _OUT_OF_MEMORY)


def _first_line(error: BaseException) -> str:
    lines = str(error).strip().splitlines()
    return lines[0].rstrip(". ") if lines else type(error).__name__
