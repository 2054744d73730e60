"""What a simulated body answers to many models at a bearable price: simulated at a few nodes, read between them.

A body's simulation costs seconds, and a search asks for hundreds of models. So every number of an effect has a curve: how far all
that is seen moves when this number alone leaves neutral, simulated at a few values when they are first needed, straight in
between. The nodes of a multiple are spaced by ratio. A model is read as the nearest one that was simulated whole (an anchor),
plus what the curves say of the difference.
Wherever noise and numbers are settled (`anchor`), the model itself is simulated: what the curves miss, because effects act on
each other, is then made good.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, replace
from threading import RLock

import numpy as np

from bns.diagnose.data.tracks import Array
from bns.diagnose.settings import DEFAULTS
from bns.physics.effect import Effect, Parameter
from bns.physics.jointed.pieced import Piece, PiecedEffect
from bns.physics.model import ActiveEffect, Model

Number = tuple[str, str]
"""Effect and parameter."""
_BESIDE = DEFAULTS.predict.node_near
_NEAR = DEFAULTS.predict.anchor_near
_CLIPPED_M = DEFAULTS.predict.response_clipped_m


@dataclass(frozen=True)
class _Anchor:
    values: Mapping[Number, float]
    seen: Array


class Responses:
    """``seen(model)`` for models that differ in effects of the stage ``mechanics``.

    ``simulate`` gives what is seen of a model, any shape; ``bare``: the model without effects; ``exactly``: the same simulated
    more finely, to which differences are added. ``shares``: nodes, as shares of the way from neutral to what is plausible.
    ``finely``: simulates anchors finely, too; without it they are as coarse as the nodes, and differ from ``exactly`` as these.
    """

    def __init__(
        self,
        simulate: Callable[[Model], Array],
        bare: Model,
        exactly: Array | None,
        shares: tuple[float, ...],
        finely: Callable[[Model], Array] | None = None,
    ) -> None:
        self._simulate, self._bare, self._shares, self._finely = simulate, bare, shares, finely
        self._sound = simulate(bare)
        self._anchors = [_Anchor({}, self._sound if exactly is None else exactly)]
        self._curves: dict[Number, dict[float, Array]] = {}
        self._known: dict[Number, tuple[Effect, Parameter]] = {}
        self._lock = RLock()

    @property
    def bare(self) -> Array:
        """What is seen without effects."""
        return self._anchors[0].seen

    @property
    def coarse(self) -> Array:
        """The same, simulated as coarsely as what differences are taken of."""
        return self._sound

    def seen(self, model: Model) -> Array:
        """What is seen of a model: an anchor, and along the curves from there."""
        with self._lock:
            wanted = self._values(model)
            anchor = min(self._anchors, key=lambda a: self._distance(a.values, wanted))
            out = anchor.seen.copy()
            for number in {**anchor.values, **wanted}:
                neutral = self._known[number][1].neutral
                there, here = wanted.get(number, neutral), anchor.values.get(number, neutral)
                if there != here:
                    out += self._curve(number, there) - self._curve(number, here)
            return out

    def anchor(self, model: Model, alone: bool = False) -> bool:
        """Simulate this model itself, unless one was that is hardly another, and its numbers' curves close to it.

        ``alone``: not the curves. Returns whether what is answered near it may have changed.
        """
        with self._lock:
            wanted = self._values(model)
            refined = [] if alone else [self._refined(number, value) for number, value in wanted.items()]
            if min(self._distance(a.values, wanted) for a in self._anchors) <= _NEAR:
                return any(refined)
            self._anchors.append(_Anchor(wanted, self._whole(model)))
            return True

    def _whole(self, model: Model) -> Array:
        """What is seen of a model, all its numbers acting on each other."""
        if self._finely is not None:
            return self._finely(model)
        return self._anchors[0].seen + self._simulate(model) - self._sound

    def _refined(self, number: Number, value: float) -> bool:
        """Simulate a curve close to a value, on either side, where it is not known there; not closer: such slopes are chance."""
        effect, p = self._known[number]
        if isinstance(effect, Piece):
            return False
        known = self._curves.setdefault(number, {})
        found = False
        for side in (1.0, -1.0):
            planned = (*self._planned(effect, p, 1.0), *self._planned(effect, p, -1.0))
            nodes = [at for at in (p.neutral, *planned, *known) if side * (at - value) > 0]
            beside = p.beside(value, side * _BESIDE)
            if p.apart(beside, value) < _BESIDE / 2 or any(_BESIDE / 2 <= p.apart(at, value) <= 1.5 * _BESIDE for at in nodes):
                continue
            if (beside - p.neutral) * (value - p.neutral) > 0:
                self._node(number, effect, p, beside)
                found = True
        return found

    def _values(self, model: Model) -> dict[Number, float]:
        """The numbers that are not neutral."""
        out: dict[Number, float] = {}
        for active in model.at("mechanics"):
            for effect, values in _simulated_as(active):
                for p, value in zip(effect.parameters, values, strict=True):
                    self._known.setdefault((effect.name, p.name), (effect, p))
                    if value != p.neutral:
                        out[effect.name, p.name] = out.get((effect.name, p.name), p.neutral) + value - p.neutral
        return out

    def _distance(self, one: Mapping[Number, float], other: Mapping[Number, float]) -> float:
        total = 0.0
        for number in {**one, **other}:
            p = self._known[number][1]
            total += p.apart(one.get(number, p.neutral), other.get(number, p.neutral))
        return total

    def _curve(self, number: Number, value: float) -> Array:
        """What this number alone changes: straight between the nodes on either side, and on beyond the last."""
        effect, p = self._known[number]
        if isinstance(effect, Piece):
            self._curves.setdefault(number, {})
            return self._node(number, effect, p, p.plausible[1]) * (value / p.plausible[1])
        side = 1.0 if value > p.neutral else -1.0
        known = self._curves.setdefault(number, {})
        nodes = sorted({*self._planned(effect, p, side), *known}, key=lambda at: side * (at - p.neutral))
        nodes = [at for at in nodes if side * (at - p.neutral) > 0]
        if not nodes:
            return np.zeros_like(self._sound)
        within = sum(side * (at - value) < 0 for at in nodes)
        outer = min(within, len(nodes) - 1)
        upper = self._node(number, effect, p, nodes[outer])
        if value == nodes[outer]:
            return upper
        if outer == 0:
            return upper * ((value - p.neutral) / (nodes[0] - p.neutral))
        lower = self._node(number, effect, p, nodes[outer - 1])
        share = (value - nodes[outer - 1]) / (nodes[outer] - nodes[outer - 1])
        return lower + share * (upper - lower)

    def _planned(self, effect: Effect, p: Parameter, side: float) -> list[float]:
        """Nodes on one side of neutral that are simulated when they are first needed.

        A start of an effect's only number that is nearer to neutral than the first of them is one, too: an effect is looked for
        over decades. Friction that holds a joint altogether says nothing of a seventh of it, on a straight line from none.
        """
        values = [value for share in self._shares if (value := p.part_way(share, side > 0)) != p.neutral]
        if not values or len(effect.parameters) > 1:
            return values
        first = min(p.apart(value, p.neutral) for value in values)
        starts = [s for (s,) in effect.starts if side * (s - p.neutral) > 0 and not np.isclose(s, values).any()]
        return [*(s for s in starts if p.apart(s, p.neutral) < first), *values]

    def _node(self, number: Number, effect: Effect, p: Parameter, value: float) -> Array:
        known = self._curves[number]
        if value not in known:
            values = tuple(value if q.name == p.name else q.neutral for q in effect.parameters)
            model = replace(self._bare, effects=(ActiveEffect(effect, values),))
            known[value] = np.clip(self._simulate(model) - self._sound, -_CLIPPED_M, _CLIPPED_M)
        return known[value]


def _simulated_as(active: ActiveEffect) -> Iterator[tuple[Effect, tuple[float, ...]]]:
    """The effect itself, or the pieces of one whose numbers act on each other."""
    if isinstance(active.effect, PiecedEffect):
        yield from ((piece, (value,)) for piece, value in active.effect.pieces(**active.by_name))
    else:
        yield active.effect, active.values
