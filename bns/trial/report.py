"""A trial in words: a row of the source's tables 4.2 and 5.4, and how well robot and computer kept up."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from bns.spec import RADII_CM, RunSpec
from bns.trial.driver import TrialDriver
from bns.trial.loop import TrialResult


def report(
    spec: RunSpec, result: TrialResult, driver: TrialDriver, wall_s: float, how: Any, folder: Path, figure: Path
) -> str:
    """Lines for the terminal."""
    evals = result.run.tables["evals"]
    firsts = [f"within {cm} cm {_first(evals[f'evaluated_success_{cm}cm'])}" for cm in RADII_CM]
    if evals[f"evaluated_success_{RADII_CM[0]}cm"][0] is None:  # goals are regions
        firsts = [_first(evals["evaluated_success"])]
    driven_min = float(np.sum(evals["driven_ms"])) / 60_000.0
    what = f"emulated, at {how.speed:g} times its speed" if how.emulated else "robot"
    return "\n".join(
        [
            f"trial {spec.run_id}: {spec.robot}, {spec.task}, seed {spec.seed}, {what}",
            f"{len(evals['evaluation'])} evaluations, {driven_min:.1f} min of driving, {wall_s:.0f} s by the clock on the wall",
            "all goals reached: " + "; ".join(firsts),
            f"the robot waited for computations {result.waited_share:.1%} of the time; {result.rounds} rounds of training and "
            "evolution went on while it drove",
            _stops(driver.stops_s),
            *(
                [f"drives that ended early: {len(driver.ends)}, the last because {driver.ends[-1]}"]
                if driver.ends
                else []
            ),
            f"measurements and journal: {folder}",
            f"path: {figure}",
        ]
    )


def _stops(seconds: list[float]) -> str:
    if not seconds:
        return "nothing was driven in this session"
    return (
        f"stops: {len(seconds)} confirmed, {_ms(float(np.median(seconds)))} at the median, {_ms(max(seconds))} at most"
    )


def _ms(seconds: float) -> str:
    return f"{1000 * seconds:.0f} ms"


def _first(success: np.ndarray) -> str:
    return (
        f"first at evaluation {int(np.argmax(success)) + 1}, {success.mean():.0%} of them" if success.any() else "never"
    )
