"""The kernels run in numba's CUDA simulator: Python threads, no GPU, no driver.

It lacks two things. Warps cannot exchange values there, and its arrays cannot be handed to the compiled functions that kernels
share with the CPU engine: here kernels see plain numpy arrays.
"""

import sys
import threading

import numba
import pytest

assert "numba.cuda" not in sys.modules, "something has loaded numba's CUDA support before the simulator could be chosen"
numba.config.ENABLE_CUDASIM = 1

from numba import cuda  # noqa: E402
from numba.cuda.simulator import kernel, kernelapi  # noqa: E402

from bns.spec import RunSpec  # noqa: E402


def _shfl_xor_sync(self, mask, value, apart):
    """All threads of a block must come here together; blocks are one warp wherever values are exchanged."""
    assert mask == 0xFFFFFFFF
    thread = threading.current_thread()
    here = self.__dict__.setdefault("_exchanged", {})
    here[thread.thread_id] = value
    thread.syncthreads()
    got = here[thread.thread_id ^ apart]
    thread.syncthreads()
    return got


kernel.FakeWithinKernelCUDAArray = lambda fake: fake._ary
kernelapi.FakeCUDAModule.shfl_xor_sync = _shfl_xor_sync

TINY = RunSpec(
    population_size=8,
    evaluations=2,
    generations_per_evaluation=2,
    training_iterations_per_evaluation=3,
    max_commands=6,
    min_commands=2,
)


@pytest.fixture
def device():
    """numba.cuda, simulated."""
    return cuda
