"""Bootstrapped Neuro-Simulation (BNS): networks, population and drives from nothing, all at once.

After the dissertation, figure 3.1 and section 3.3: no data is collected before; what evolution finds promising is driven,
the networks learn from that, and the evolution goes on with them.
"""

from __future__ import annotations

import numpy as np

from bns.approaches.parts.neuro_simulation import NeuroSimulation


class BootstrappedNeuroSimulation(NeuroSimulation):
    """The four steps; driving is the loop's."""

    def pick(self, evaluation: int) -> np.ndarray:
        """Step 1: the winner of the real-world selection tournament."""
        return self.plan(self.evolver.pick(evaluation))

    def advance(self) -> None:
        """Steps 2 and 3: train, copy the training networks over the evolution networks, evolve on those."""
        self.train()
        self.copy()
        self.evolve()


APPROACH = BootstrappedNeuroSimulation
