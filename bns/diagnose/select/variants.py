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
from bns.physics.order import FRICTION, RAMPS

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


def order_of_friction(selection: SelectionResult) -> str:
    """Where friction acts beside ramps, if one of them was accepted, and how much speaks for it; empty without both of them."""
    model = selection.fit.model
    moved = model.with_friction_moved()
    friction, ramps = ([a.effect.name for a in model.effects if a.effect.name in kind] for kind in (FRICTION, RAMPS))
    if moved is None or not {*friction, *ramps}.intersection(selection.accepted):
        return ""
    evidence = float(selection.problem.fit(moved).held_out.sum() - selection.fit.held_out.sum())
    where = "behind" if model.is_friction_last else "before"
    known = (
        "For certain: held-out trials are predicted worse in the other order."
        if evidence > CERTAIN
        else f"Held-out trials are {np.exp(evidence):.0f} times as likely as in the other order, which is evidence, not proof."
        if evidence > EVIDENCE
        else "Held-out trials do not tell this from the other order."
    )
    acts = f"{' and '.join(friction)} {'acts' if len(friction) == 1 else 'act'} {where} {' and '.join(ramps)}"
    return f"{acts}: the order of effects in the model's file. {known}"


def _elsewhere(known: Mapping[str, Effect], name: str, other: str) -> bool:
    """Whether one of two effects does what the other does, at another place in the chain."""
    return any(known[a].extends == b and variant(known, a) for a, b in ((name, other), (other, name)))
