"""What approaches have in common: a population that evolves on a simulator, and what is told of both."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from time import thread_time
from typing import Any, ClassVar, Self

import numpy as np

from bns.approaches.parts.base import Options, Setting
from bns.bootstrap.evolver import Evolver, Generation
from bns.bootstrap.simulators import Simulator
from bns.engine.snn import INPUTS


class Evolving:
    """A population on a simulator. Derived classes say what is picked, what is learned and what goes on between drives."""

    options: ClassVar[Options] = {}
    networked: ClassVar[bool] = False
    weights: np.ndarray = np.empty((0, 0), np.float32)

    def __init__(self, setting: Setting, simulator: Simulator) -> None:
        """A random population, scored on a first simulator."""
        self.setting, self.simulator = setting, simulator
        self.evolver = Evolver.start(setting.robot, setting.task, setting.key, setting.spec, simulator)
        self._cpu_s = {"training_cpu_s": 0.0, "evolution_cpu_s": 0.0}

    @classmethod
    def start(cls, setting: Setting) -> Self:
        """Derived classes say with which simulator."""
        raise NotImplementedError

    def fittest(self) -> np.ndarray:
        """The best controller in simulation."""
        return self.evolver.fittest()

    def plan(self, controller: np.ndarray, generation: int | None = None) -> np.ndarray:
        """What is driven of a controller of this generation, or of an earlier one of this round."""
        return self.evolver.plan(controller, self.simulator, generation)

    def evolve(self) -> None:
        """As many generations as the spec has for an evaluation."""
        with self.timed("evolution_cpu_s"):
            self.evolver.evolve(self.simulator)

    @contextmanager
    def timed(self, what: str) -> Iterator[None]:
        """Around work whose CPU seconds are to be told: ``training_cpu_s`` or ``evolution_cpu_s``."""
        began = thread_time()
        try:
            yield
        finally:
            self._cpu_s[what] += thread_time() - began

    def measures(self) -> dict[str, Any]:
        """Columns of evals that only the approach knows; CPU seconds since this was asked last."""
        evolver, spent = self.evolver, dict(self._cpu_s)
        self._cpu_s = dict.fromkeys(spent, 0.0)
        return {
            "diversity": evolver.diversity(),
            "best_fitness": evolver.best_fitness,
            "mean_fitness": evolver.mean_fitness,
            "training_error": float("nan"),
            "validation_error": float("nan"),
            "training_patterns": 0,
            "validation_patterns": 0,
            "mean_commands": float(evolver.population.lengths.mean()),
            "generations": evolver.generations,
            "bound_hits": evolver.bound_hits,
            "arithmetic_failures": evolver.failures,
            **spent,
        }

    @property
    def history(self) -> Sequence[Generation]:
        """The generations of the last round, where the spec records them."""
        return self.evolver.history

    @property
    def learned_from(self) -> np.ndarray:
        """No networks, no patterns."""
        return np.empty((INPUTS, 0), np.float32)
