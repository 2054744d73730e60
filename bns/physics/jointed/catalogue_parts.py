"""Effects that sit at one joint, link or tracked point: one file, as many effects as there are places."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import partial
from typing import Any

from bns.physics.effect import Effect


@dataclass(frozen=True)
class _Placed:
    """``effect``: its ``apply`` also takes where it sits; its sentences may name that in braces."""

    effect: Effect

    @property
    def name(self) -> str:
        """Of the family; each member's name ends in its place."""
        return self.effect.name

    @property
    def stage(self) -> str:
        """As of any effect."""
        return self.effect.stage

    @property
    def apply(self) -> Callable[..., Any]:
        """As of any effect, and where."""
        return self.effect.apply

    @property
    def anywhere(self) -> Effect:
        """The effect at any of its places; its sentences say "a joint", "a link" or "a marker"."""
        sentence, measurement = (
            text.replace("the marker {site}", "a marker").format(joint="a joint", link="a link", site="a marker")
            for text in (self.effect.sentence, self.effect.measurement)
        )
        return replace(self.effect, sentence=sentence, measurement=measurement)

    def _at(self, name: str, words: dict[str, str], place: dict[str, Any]) -> Effect:
        return replace(
            self.effect,
            name=f"{self.effect.name}-{name}",
            apply=partial(self.effect.apply, **place),
            extends=self.effect.extends and f"{self.effect.extends}-{name}",
            sentence=self.effect.sentence.format(**words),
            measurement=self.effect.measurement.format(**words),
        )


@dataclass(frozen=True)
class PerJoint(_Placed):
    """One for every joint with a servo, or for every one whose servo has a torque limit."""

    limited: bool = False

    def of(self, joint: str) -> Effect:
        """The effect at that joint."""
        return self._at(joint, {"joint": joint}, {"joint": joint})


@dataclass(frozen=True)
class PerSite(_Placed):
    """One for every tracked point, or for every one to which a load may be fixed."""

    carries: bool = False

    def of(self, site: str, number: int) -> Effect:
        """The effect at that point, the ``number``-th."""
        return self._at(site, {"site": site}, {"site": number})


@dataclass(frozen=True)
class PerLink(_Placed):
    """One for every link that may touch the floor, or for every link that has mass."""

    on_floor: bool = True

    def of(self, link: str, number: int) -> Effect:
        """The effect at that link, the ``number``-th of the body."""
        return self._at(link, {"link": link}, {"link": number})
