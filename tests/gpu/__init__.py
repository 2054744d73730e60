"""Kernels against the CPU engine, in numba's CUDA simulator or, with BNS_TEST_GPU=1, on this machine's GPU."""

import os

ON_GPU = os.environ.get("BNS_TEST_GPU") == "1"
