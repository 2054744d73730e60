"""Every effect that a selection can name: the catalogue, and what was tried beside it."""

from __future__ import annotations

from bns.diagnose.select.stepwise import SelectionResult
from bns.physics.effect import Effect


def known_effects(selection: SelectionResult) -> dict[str, Effect]:
    """Name -> effect: of the catalogue, of the model, and of everything that was tried (a user's own, decoys)."""
    tried = [a.effect for step in selection.steps for c in step.ranking for a in c.fit.model.effects]
    own = [a.effect for a in selection.fit.model.effects]
    return {**selection.fit.model.catalogue(), **{effect.name: effect for effect in (*own, *tried)}}
