"""Counter-based random numbers: Philox4x32-10 (Salmon et al., SC 2011).

A draw is a pure function of who asks and why: key (run seed, study digest) and counter (slot, individual, step, purpose).
The order of jobs, the worker and the parameter combination cannot change it, and a GPU can compute the same numbers.
"""

from __future__ import annotations

import hashlib
from dataclasses import dataclass
from enum import IntEnum

import numpy as np

from bns.engine.jit import exact, inline

_M0, _M1 = np.uint64(0xD2511F53), np.uint64(0xCD9E8D57)
_W0, _W1 = np.uint64(0x9E3779B9), np.uint64(0xBB67AE85)
_LOW = np.uint64(0xFFFFFFFF)
_SHIFT = np.uint64(32)


class Purpose(IntEnum):
    """What a draw is for: the last word of the counter."""

    INITIAL_LENGTH = 0
    INITIAL_COMMAND = 1
    PARENTS = 2
    CUTS = 3
    MUTATION = 4
    PICK = 5
    SPLIT = 6
    WEIGHTS = 7
    WORLD_EVALUATED = 8
    WORLD_FITTEST = 9
    WORLD_GENERATION = 10
    PROBE = 11
    PRECOMPUTE = 12
    ROLLOUT_NOISE = 13
    APPROACH = 14


@dataclass(frozen=True)
class Key:
    """The two 32-bit words every draw of a run shares."""

    seed: int
    study: int

    @classmethod
    def of_run(cls, seed: int, root_seed: int, robot: str, task: str) -> Key:
        """Key of one run; the parameter combination is left out on purpose (common random numbers)."""
        digest = hashlib.sha256(f"{root_seed}/{robot}/{task}".encode()).digest()
        return cls(seed, int.from_bytes(digest[:4], "little"))

    @property
    def words(self) -> tuple[np.uint32, np.uint32]:
        """(seed, study) as the kernels take them."""
        return np.uint32(self.seed), np.uint32(self.study)


@inline
def philox(c0, c1, c2, c3, k0, k1):  # type: ignore[no-untyped-def]  # compiled: types come from the caller
    """Four independent uint32 for a 128-bit counter and a 64-bit key.

    In 64-bit numbers from begin to end, whose upper halves stay empty: going back and forth takes twice as long when vectorised.
    """
    c0, c1, c2, c3 = np.uint64(c0), np.uint64(c1), np.uint64(c2), np.uint64(c3)
    k0, k1 = np.uint64(k0), np.uint64(k1)
    for _ in range(10):
        p0, p1 = _M0 * c0, _M1 * c2
        c0, c1 = (p1 >> _SHIFT) ^ c1 ^ k0, p1 & _LOW
        c2, c3 = (p0 >> _SHIFT) ^ c3 ^ k1, p0 & _LOW
        k0, k1 = (k0 + _W0) & _LOW, (k1 + _W1) & _LOW
    return np.uint32(c0), np.uint32(c1), np.uint32(c2), np.uint32(c3)


@exact
def _fill_words(out: np.ndarray, k0: np.uint32, k1: np.uint32, step: np.uint32, purpose: np.uint32) -> None:
    for i in range(out.shape[0]):
        for j in range(out.shape[1]):
            a, b, c, d = philox(np.uint32(j), np.uint32(i), step, purpose, k0, k1)
            out[i, j, 0] = a
            out[i, j, 1] = b
            out[i, j, 2] = c
            out[i, j, 3] = d


def words(key: Key, purpose: Purpose, step: int, individuals: int, slots: int) -> np.ndarray:
    """uint32 array (individuals, slots, 4)."""
    out = np.empty((individuals, slots, 4), np.uint32)
    _fill_words(out, *key.words, np.uint32(step), np.uint32(purpose))
    return out


def uniforms(key: Key, purpose: Purpose, step: int, individuals: int, slots: int) -> np.ndarray:
    """Float64 in [0, 1), shape (individuals, slots, 4)."""
    return words(key, purpose, step, individuals, slots) * 2.0**-32


def normals(key: Key, purpose: Purpose, step: int, individuals: int, slots: int) -> np.ndarray:
    """Standard normal float64, shape (individuals, slots, 4), by Box and Muller."""
    bits = words(key, purpose, step, individuals, slots)
    radius = np.sqrt(-2.0 * np.log((bits[..., ::2] + 0.5) * 2.0**-32))
    angle = (bits[..., 1::2] + 0.5) * (2.0**-32 * 2.0 * np.pi)
    return np.concatenate([radius * np.cos(angle), radius * np.sin(angle)], axis=-1)
