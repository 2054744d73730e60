"""Accepted effects that could as well act at another place in the chain: how much speaks for the place that was chosen."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from bns.diagnose.select.extending import variant
from bns.diagnose.select.known_effects import known_effects
from bns.diagnose.select.result import SelectionResult
from bns.diagnose.settings import DEFAULTS
from bns.physics.effect import Effect

CERTAIN = DEFAULTS.select.variant_certain
EVIDENCE = DEFAULTS.select.variant_evidence
SAME = DEFAULTS.select.variant_same


@dataclass(frozen=True)
class Variant:
    """``name`` was accepted, ``other`` has the same parameters; ``evidence``: log-likelihood of held-out trials for ``name``."""

    name: str
    other: str
    evidence: float
    measurement: str

    @property
    def in_words(self) -> str:
        """How uncertain the place in the chain is, and what would tell."""
        same = f"{self.other} has the same parameters as {self.name} and acts at another place in the chain. "
        odds = f"Held-out trials are {np.exp(self.evidence):.0f} times as likely with {self.name}, which is evidence, not proof. "
        undecided = "Held-out trials do not tell them apart. "
        return f"{same}{odds if self.evidence > EVIDENCE else undecided}To decide: {self.measurement}."


def uncertain_variants(selection: SelectionResult) -> list[Variant]:
    """Those of the accepted effects whose place in the chain is not certain; without those for which it makes no difference."""
    known, there = known_effects(selection), {active.effect.name for active in selection.fit.model.effects}
    others = [name for name in known if name not in there]
    pairs = [(name, other) for name in selection.accepted for other in others if _elsewhere(known, name, other)]
    if not pairs or selection.problem.predictor.screening is not None:  # a fit takes too long
        return []
    fit, found = selection.fit, []
    for name, other in pairs:
        values = tuple(fit.model.values_of(name)[p.name] for p in known[other].parameters)
        moved = selection.problem.fit(fit.model.without(name).with_active(known[other], values))
        evidence = float(moved.held_out.sum() - fit.held_out.sum())
        if SAME < abs(evidence) < CERTAIN:
            found.append(Variant(name, other, evidence, known[name].measurement))
    return found


def _elsewhere(known: Mapping[str, Effect], name: str, other: str) -> bool:
    """Whether one of two effects does what the other does, at another place in the chain."""
    return any(known[a].extends == b and variant(known, a) for a, b in ((name, other), (other, name)))
