"""One generator a world and purpose: no draw depends on which worlds were made before."""

from __future__ import annotations

import hashlib

import numpy as np


def luck(seed: int, *words: str) -> np.random.Generator:
    """A Philox generator keyed by the seed and the words."""
    digest = hashlib.sha256("/".join((str(seed), *words)).encode()).digest()
    return np.random.Generator(np.random.Philox(key=int.from_bytes(digest[:16], "little")))
