"""A trial as text: a row of the dissertation's tables 4.2 and 5.4, and how well robot and computer kept up."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from datetime import datetime

import numpy as np

from bns.bootstrap.loop import RunResult
from bns.spec import RADII_CM, RunSpec


@dataclass(frozen=True)
class TrialResult:
    """The run, and how this session of it went.

    stops_s: how long each confirmed stop took; ends: why drives ended early; waited_share: of the time, that the robot
    waited for computations; worked_share: of the time, in which training and evolution went on; rounds: of these, while it
    drove; wall_s: how long it took;
    repeats: success of each drive of the final controller, if it was driven more than once; faults: which of the faults that
    were planned for an emulated robot have happened, in words ("" if none was planned); leaps: how many poses the robot cannot
    have reached, in words ("" if there are none).
    """

    run: RunResult
    stops_s: Sequence[float]
    ends: Sequence[str]
    waited_share: float
    worked_share: float
    rounds: int
    started: datetime
    wall_s: float
    repeats: list[bool] = field(default_factory=list)
    faults: str = ""
    leaps: str = ""


def report(spec: RunSpec, result: TrialResult, what: str) -> list[str]:
    """Lines for the terminal; `what` drove: a robot, or its emulator."""
    evals = result.run.tables["evals"]
    numbers = evals["evaluation"]
    firsts = [f"within {cm} cm: {_first(evals[f'evaluated_success_{cm}cm'], numbers)}" for cm in RADII_CM]
    if evals[f"evaluated_success_{RADII_CM[0]}cm"][0] is None:  # goals are regions
        firsts = [_first(evals["evaluated_success"], numbers)]
    driven_min = float(np.sum(evals["driven_ms"])) / 60_000.0
    early = f"drives that ended early: {len(result.ends)}, the last because {result.ends[-1]}" if result.ends else ""
    return [
        f"trial {spec.run_id}: {spec.robot}, {spec.task}, seed {spec.seed}, {what}",
        f"{count_of(len(numbers), 'evaluation')}, {driven_min:.1f} min of driving, {result.wall_s:.0f} s by the wall clock",
        "all goals reached: " + "; ".join(firsts),
        f"the robot waited for computations {result.waited_share:.1%} of the time; training and evolution used "
        f"{result.worked_share:.0%} of it, in {result.rounds} rounds",
        _stops(result.stops_s),
        *filter(None, (early, result.leaps, result.faults)),
        *_repeats(result.repeats),
    ]


def count_of(number: int, what: str) -> str:
    """So many of something; the plural takes an s."""
    return f"{number} {what}{'' if number == 1 else 's'}"


def _repeats(successes: Sequence[bool]) -> list[str]:
    if not successes:
        return []
    return [f"final controller driven {len(successes)} times: all goals reached in {sum(successes)} of them"]


def _stops(seconds: Sequence[float]) -> str:
    if not seconds:
        return "no drive in this session"
    most = f"{_ms(float(np.median(seconds)))} at the median, {_ms(max(seconds))} at most"
    return f"stops: {len(seconds)} confirmed, {most}"


def _ms(seconds: float) -> str:
    return f"{1000 * seconds:.0f} ms"


def _first(success: np.ndarray, numbers: np.ndarray) -> str:
    if not success.any():
        return "never"
    return f"first at evaluation {int(numbers[np.argmax(success)])}, in {success.mean():.0%} of the evaluations"
