"""Many drives that do not depend on one another, on as many cores as there are."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np

from bns.engine.philox import Key, Purpose
from bns.worlds.base import World

_EACH = 10
"""Drives that a worker is handed at once."""


def drive_all(
    world: World,
    drives: Sequence[np.ndarray],
    key: Key,
    purpose: Purpose,
    first_step: int,
    jobs: int = 1,
    tick: Callable[[int], None] = lambda done: None,
) -> list[np.ndarray]:
    """Measured poses of each drive (n, components), drive i with the draws of step ``first_step + i``: the same for any jobs.

    ``tick`` is told how many are done. With more than one job the world is sent to the workers, so it must pickle.
    """
    begins = range(0, len(drives), _EACH)
    seen: list[np.ndarray] = []
    if jobs == 1 or len(drives) <= _EACH:
        for i, commands in enumerate(drives):
            seen.append(world.drive(commands, key, purpose, first_step + i))
            tick(len(seen))
        return seen
    from joblib import Parallel, delayed, parallel_config  # noqa: PLC0415  # half a second, and one job needs it not

    with parallel_config(backend="loky", inner_max_num_threads=1):
        parts = Parallel(n_jobs=jobs, return_as="generator")(
            delayed(drive_all)(world, drives[at : at + _EACH], key, purpose, first_step + at) for at in begins
        )
        for part in parts:
            seen += part
            tick(len(seen))
    return seen
