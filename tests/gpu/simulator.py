"""Numba's CUDA simulator, made fit for these kernels: Python threads, no GPU, no driver.

It lacks four things. Warps cannot exchange values there; its arrays cannot be handed to the compiled functions that kernels
share with the CPU engine: here kernels see plain numpy arrays; its threads wait for each other in a busy loop; and two threads
that come to a shared array at the same moment are given one each.
"""

import sys
import threading

import numpy as np
from numba.cuda.simulator import kernel, kernelapi
from numba.np.numpy_support import as_dtype

_ALLOCATING = threading.Lock()


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


def _run(self, place, *arguments):
    """A block: its own threads, which wait for each other at a barrier; the simulator's way is a busy loop."""
    size = self._block_dim[0] * self._block_dim[1] * self._block_dim[2]
    self.barrier, faults = threading.Barrier(size), []

    def work():
        try:
            self._f(*arguments)
        except threading.BrokenBarrierError:
            pass  # another thread has told why
        except Exception as fault:
            faults.append(fault)
            self.barrier.abort()

    threads = [kernel.BlockThread(work, self, place, point, False) for point in np.ndindex(*self._block_dim)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    if faults:
        raise faults[0]


kernel.BlockManager.run = _run
kernel.BlockThread.syncthreads = lambda thread: thread._manager.barrier.wait()


def _array(self, shape, dtype):
    """One array for each line of a kernel, whichever of its threads comes there first. Kernels here ask for no dynamic memory."""
    caller = sys._getframe(1)
    where = (caller.f_code, caller.f_lineno)
    with _ALLOCATING:
        if where not in self._allocations:
            self._allocations[where] = np.empty(shape, as_dtype(dtype))
        return self._allocations[where]


kernelapi.FakeCUDAShared.array = _array
