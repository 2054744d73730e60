"""The inverse of curvatures in numbers of any size."""

from __future__ import annotations

import numpy as np

from bns.diagnose.data.tracks import Array
from bns.diagnose.settings import DEFAULTS

SINGULAR = DEFAULTS.estimate.singular


def pseudo_inverse(curvature: Array) -> Array:
    """Of symmetric matrices (..., p, p), each number in the unit in which its own curvature is 1.

    A rate per second and a time constant in seconds differ by ten orders of magnitude, and their curvatures by twenty: in units
    of their own, the smaller one would be taken for rounding, and its number for one that is fixed.
    """
    size = np.einsum("...pp->...p", curvature)
    scale = np.sqrt(np.where(size > 0, size, 1.0))
    both = scale[..., :, None] * scale[..., None, :]
    return np.asarray(np.linalg.pinv(curvature / both, rcond=SINGULAR, hermitian=True) / both)
