"""Many runs side by side on one GPU. The rules are those of `bns.engine` and `bns.robots`, compiled for the device.

Nothing here is imported before a GPU is asked for: numba's CUDA support need not be installed.
"""
