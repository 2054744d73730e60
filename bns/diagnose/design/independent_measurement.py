"""What else could be measured: where no command tells two effects apart, something beside commands and poses does."""

from __future__ import annotations

from collections.abc import Iterable

from bns.physics.effect import Effect


def independent_measurements(first: Iterable[Effect], second: Iterable[Effect]) -> list[str]:
    """Measurements that would tell two explanations apart, from the effects that only one of them has."""
    one, other = ({effect.name: effect for effect in effects} for effects in (first, second))
    only = sorted(one.keys() ^ other.keys())
    effects = one | other
    return [f"{effects[name].measurement} ({name})" for name in only if effects[name].measurement]
