"""A world that changes for good at an evaluation: a wheel wears out, the floor is another one."""

from __future__ import annotations

import hashlib

import numpy as np

from bns.engine.philox import Key, Purpose
from bns.worlds.base import World


class ChangingWorld:
    """One world, and from an evaluation on another; what is measured beside evaluations is measured in the world of the day."""

    renderable = False

    def __init__(self, before: World, after: World, changes_at: int) -> None:
        """``changes_at``: the first evaluation that is driven in the second world."""
        self._before, self._after, self.changes_at = before, after, changes_at
        self._now = before
        self.repeatable = before.repeatable and after.repeatable
        text = f"{before.digest}/{after.digest}/{changes_at}"
        self.digest = "w" + hashlib.sha256(text.encode()).hexdigest()[:15]

    def drive(self, commands: np.ndarray, key: Key, purpose: Purpose, step: int) -> np.ndarray:
        """As the world of this evaluation, or of the last one where it is driven for measurement alone."""
        if purpose is Purpose.WORLD_EVALUATED:
            self._now = self._after if step >= self.changes_at else self._before
        return self._now.drive(commands, key, purpose, step)
