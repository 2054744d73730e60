"""What one evaluation on a robot left: in the hardware log, and for the loop."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np


@dataclass(frozen=True)
class Evaluation:
    """The controller picked (n, c), what was carried out (k, c) and tracked poses (k + 1, columns).

    rounds: how many rounds of training and evolution went on meanwhile (None: not known, the trial was cut off);
    unstable: numbers, from 1, of the commands that a person called unstable.
    """

    picked: np.ndarray
    commands: np.ndarray
    poses: np.ndarray
    rounds: int | None = None
    unstable: tuple[int, ...] = ()
    skipped: bool = False
    """The operator passed over it: nothing of it counts."""
