"""Numbers only: compiled kernels over arrays. `reference` holds their slow twins."""
