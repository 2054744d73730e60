"""The smallest kernel: whether compiler, driver and GPU work together."""

from __future__ import annotations

import numpy as np
from numba import cuda


@cuda.jit
def _double(array):  # type: ignore[no-untyped-def]  # compiled
    array[cuda.grid(1)] *= 2


def doubled(count: int) -> list[int]:
    """0, 2, 4, ... by ``count`` threads."""
    numbers = cuda.to_device(np.arange(count, dtype=np.int32))
    _double[1, count](numbers)
    return [int(number) for number in numbers.copy_to_host()]
