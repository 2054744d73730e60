"""The order of a sweep's runs: breadth first, so that a sweep stopped anywhere has all combinations alike."""

from __future__ import annotations

import json
from collections.abc import Mapping
from hashlib import blake2b
from typing import Any

from bns.spec import RunSpec
from bns.sweep.expand.grid import Sweep


def ordered_specs(sweep: Sweep) -> list[RunSpec]:
    """All runs: the first seed of every combination, then the second, ...; shuffled within a seed, alike on all machines.

    The shuffle keeps neighbours in the grid (equally long runs, one task) apart, which evens out progress
    and estimates. It sorts by a hash, so combinations added later leave the others in their order. Of a sweep with chosen runs
    these, as they are.
    """
    if sweep.chosen is not None:
        return [_spec(sweep, sweep.combos[number], seed) for number, seed in sweep.chosen]
    texts = [(json.dumps(combo, sort_keys=True), combo) for combo in sweep.combos]
    specs = []
    for seed in sweep.all_seeds:
        for _text, combo in sorted(texts, key=lambda pair: _place(sweep.name, seed, pair[0])):
            specs.append(_spec(sweep, combo, seed))
    return specs


def _place(name: str, seed: int, text: str) -> bytes:
    return blake2b(f"{name}\n{seed}\n{text}".encode(), digest_size=16).digest()


def _spec(sweep: Sweep, combo: Mapping[str, Any], seed: int) -> RunSpec:
    return RunSpec(robot=sweep.robot, seed=seed, **combo)
