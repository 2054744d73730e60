"""The kernels run in numba's CUDA simulator; with BNS_TEST_GPU=1 on this machine's GPU."""

import sys
from importlib import import_module

import numba
import pytest

from tests.gpu import ON_GPU

assert "numba.cuda" not in sys.modules, "something has loaded numba's CUDA support before the simulator could be chosen"
if not ON_GPU:
    numba.config.ENABLE_CUDASIM = 1
    import_module("tests.gpu.simulator")


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Kernels are launched with a single block and with arrays of the host here; numba warns of both on a GPU."""
    for item in items if ON_GPU else ():
        item.add_marker(pytest.mark.filterwarnings("ignore:.*Grid size", "ignore:.*Host array used"))
