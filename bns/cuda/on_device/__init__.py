"""Functions that run on the GPU: networks, lists, drives, evolution, training."""
