"""Which runs a GPU can carry out."""

from __future__ import annotations

from collections.abc import Iterable
from importlib.util import find_spec

from bns.errors import SpecError
from bns.spec import RunSpec

LARGEST_POPULATION = 4096
"""Ranking compares everybody with everybody, which is nothing for hundreds and too much beyond this."""


def check_supported(specs: Iterable[RunSpec]) -> None:
    """SpecError, naming the first parameter that only the CPU can do."""
    for spec in specs:
        reason = _reason(spec)
        if reason:
            raise SpecError(f"--device cuda: {reason}; leave --device out for such runs.")


def _reason(spec: RunSpec) -> str:
    if find_spec(f"bns.cuda.robots.{spec.robot}") is None:
        return f"there are no kernels for the robot {spec.robot}"
    if spec.approach != "bns":
        return f"approach is {spec.approach!r}, and a GPU has only 'bns'"
    if spec.world != "substitute":
        return f"world is {spec.world!r}, and a GPU has only 'substitute'"
    if spec.record != "evals":
        return f"record is {spec.record!r}, and a GPU keeps only 'evals'"
    if spec.population_size > LARGEST_POPULATION:
        return f"population_size is {spec.population_size}; at most {LARGEST_POPULATION} controllers fit a block"
    return ""
