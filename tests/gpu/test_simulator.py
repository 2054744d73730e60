"""What numba's simulator must do as a GPU does it."""

import time

import numpy as np
import pytest
from numba import cuda, float32

from tests.gpu import ON_GPU

WARP = 32


class Slow:
    """The size of an array, which lets other threads run before it is told."""

    def __index__(self):
        time.sleep(0.002)
        return WARP


SIZE = Slow()


@cuda.jit
def turned_around(values):  # type: ignore[no-untyped-def]  # compiled
    """Every thread reads what another one has written."""
    cuda.syncthreads()
    here = cuda.shared.array(SIZE, float32)
    lane = cuda.threadIdx.x
    here[lane] = values[lane]
    cuda.syncthreads()
    values[lane] = here[WARP - 1 - lane]


@pytest.mark.skipif(ON_GPU, reason="a GPU's threads are not Python's")
def test_threads_that_ask_for_a_shared_array_at_the_same_moment_get_the_same():
    values = np.arange(WARP, dtype=np.float32)
    turned_around[1, WARP](values)
    np.testing.assert_array_equal(values, np.arange(WARP)[::-1])
