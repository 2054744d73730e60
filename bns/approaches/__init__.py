"""Approaches, one file each: what learns from a drive and picks the next. Bootstrapped Neuro-Simulation is one of them."""

from __future__ import annotations

from bns.approaches.parts.base import Approach, Setting
from bns.approaches.parts.hybrid import NO_MODEL
from bns.engine.philox import Key
from bns.errors import SpecError
from bns.options import OPTION_MARK, parsed_options
from bns.registry import APPROACHES
from bns.robots.base import Robot
from bns.spec import RunSpec
from bns.tasks import Task


def approach_named(name: str) -> type[Approach]:
    """The approach of a name such as ``precomputed+data=0.5``, without its options; SpecError if there is none."""
    found: type[Approach] = APPROACHES.load(name.split(OPTION_MARK, maxsplit=1)[0])
    return found


def start_approach(robot: Robot, task: Task, key: Key, spec: RunSpec) -> Approach:
    """The spec's approach at the beginning of a run; SpecError for an option that it has not, or a robot that it cannot take."""
    kind = approach_named(spec.approach)
    return kind.start(Setting(robot, task, key, spec, parsed_options(spec.approach, kind.options)))


def check_networked(spec: RunSpec) -> None:
    """SpecError if the approach has no networks that could be kept."""
    kind = approach_named(spec.approach)
    if not kind.networked:
        raise SpecError(f"the approach {spec.approach} has no networks to write; leave --save-snn out.")
    if parsed_options(spec.approach, kind.options).get("model", NO_MODEL) != NO_MODEL:
        raise SpecError(
            f"the approach {spec.approach} has networks that learn only the error of its model; leave --save-snn out."
        )
