"""`bns.propose`: the next experiment, commands that tell rival explanations apart."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from functools import cached_property
from numbers import Real
from os import PathLike
from pathlib import Path
from typing import TYPE_CHECKING, Any

import pandas as pd

from bns.api.common.arguments import as_path, checked_progress
from bns.api.common.next_command import limits_in_words, noted
from bns.api.common.progress import Meter, Progress, part
from bns.api.common.provenance import provenance
from bns.api.common.shown import Shown, counted
from bns.api.diagnose import DiagnoseResult, diagnose
from bns.api.measurements import Log
from bns.api.model import Given
from bns.diagnose.data.mapping import refuse_to_replace
from bns.diagnose.design.limits import arena_of, bounds_of
from bns.diagnose.design.proposal import Proposal
from bns.diagnose.design.proposal import propose as search
from bns.diagnose.design.search import GENERATIONS
from bns.diagnose.design.sequences import Arena, Bounds
from bns.diagnose.report.proposal_text import proposal_text
from bns.diagnose.settings.chosen import in_force
from bns.errors import DataError, in_both
from bns.physics.effect import Effect
from bns.physics.jointed.model import JointedModel
from bns.store.disk.files import publish
from bns.targets import obstacle

if TYPE_CHECKING:
    from matplotlib.axes import Axes

MOST_MINUTES = 600.0
PHASES = {"competing models": 0.0, "random trials": 0.15, "random commands, for comparison": 0.75, "power": 0.9}
"""What share of the planning is done when it tells so."""


@dataclass(frozen=True, repr=False)
class ProposeResult(Shown):
    """An experiment. ``proposal`` holds the complete result, ``diagnosis`` the diagnosis that it is based on."""

    diagnosis: DiagnoseResult
    proposal: Proposal
    limits: Mapping[str, str] = field(default_factory=dict)
    """What a command line would repeat of minutes, arena, start and speeds."""

    @cached_property
    def commands(self) -> pd.DataFrame:
        """The trial file, one row per command: trial, left_m_s, right_m_s (m/s), duration_s (s), start_x_m, start_y_m (m),
        start_heading_rad (rad). Empty where no commands would decide anything."""
        return self.proposal.commands()

    @property
    def model_pairs(self) -> pd.DataFrame:
        """One row per pair of explanations: first, second, power (probability of a decision), minutes (for one of 90 %),
        times_faster (than plain random commands), indistinguishable (no commands tell them apart), already_decided (so far),
        standard_errors (expected difference; 2 decide), independent_measurements."""
        return pd.DataFrame([vars(pair) for pair in self.proposal.model_pairs])

    @property
    def power(self) -> float:
        """Probability that all pairs that commands can decide are decided."""
        return self.proposal.power

    def summary(self, written: str = "", command: Mapping[str, str] | None = None) -> str:
        """The explanations that are compared, and what the experiment would decide.

        ``written``: the file with the commands; ``command``: words (data, model) that further commands repeat.
        """
        words = command or self.command
        return noted(proposal_text(self.proposal, written, words), words)

    @property
    def command(self) -> dict[str, str]:
        """Words (data, model and what else was given) for the commands that follow."""
        return {**self.diagnosis.command, **self.limits}

    def to_csv(self, path: str | PathLike[str]) -> Path:
        """Write the commands as a file that `bns trial --commands` drives; its path. DataError where there are none."""
        target = checked_output(as_path(path), "The commands", ".csv")
        refuse_to_replace(target, self.diagnosis.ready.log.files)
        if not len(self.proposal.plan):
            raise DataError(f"{target} is not written: no commands would decide anything.")
        publish(self.commands.to_csv(index=False).encode(), target.with_name(f".{target.name}.part"), target)
        return target

    def to_json(self) -> dict[str, Any]:
        """One object of plain values, the same that `bns propose --json` prints."""
        ready = self.diagnosis.ready
        return {**self.proposal.as_json(), "provenance": provenance(ready.model, ready.log.sha256, self.diagnosis.settings)}

    def plot(self, ax: Axes | None = None, trial: int = 0) -> Axes:
        """One proposed trial (by its number from 0) in the arena, as each explanation predicts it. DataError if there is none."""
        from bns.api.common.axes import drawn  # noqa: PLC0415  # matplotlib is slow to load
        from bns.diagnose.report.proposal_figure import trial_axes  # noqa: PLC0415  # matplotlib is slow to load

        if not 0 <= trial < len(self.proposal.plan):
            raise DataError(f"There is no trial {trial}; {len(self.proposal.plan)} are proposed.")
        return drawn(ax, lambda axes: trial_axes(axes, self.proposal, trial))

    def _line(self) -> str:
        minutes = float(self.proposal.plan.lasting_s.sum() / 60)
        models = " / ".join(model.title for model in self.proposal.competing_models)
        trials = counted(len(self.proposal.plan), "trial")
        return f"{trials}, {minutes:.1f} min, decide with a chance of {self.power:.0%} between {models}"


def propose(
    log: Log,
    model: Given,
    *,
    minutes: float = 10.0,
    arena: tuple[float, ...] | None = None,
    start: tuple[float, float, float] | None = None,
    speeds: tuple[float, float] | None = None,
    also: Iterable[Effect | str | PathLike[str]] = (),
    fresh: bool = False,
    progress: Progress | None = None,
) -> ProposeResult:
    """Diagnose, then find the experiment that tells the remaining explanations apart.

    Args:
        log: a file, a table, or `bns.Measurements`.
        model: `bns.Model`, or the name or file of one.
        minutes: of driving, above 0 and at most 600; the last trial is driven to its end.
        arena: where the robot may be: (width, height) in m around the start, or (lowest x, highest x, lowest y, highest y) in m;
            by default where it was seen.
        start: x_m, y_m (m) and heading_rad (rad, counter-clockwise from x) of the start of every trial; by default as before.
        speeds: lowest and highest of a wheel (m/s); by default the robot's own and those seen.
        also: effects of your own, tried in addition to the listed ones.
        fresh: compute the diagnosis again instead of taking it from the cache.
        progress: called with the fraction done (0 to 1) and a text.

    Raises:
        DataError: as `bns.diagnose`; limits that make no sense; or there are no two explanations to tell apart.
    """
    checked_minutes(minutes)
    checked_progress(progress)
    found = diagnose(log, model, also=also, fresh=fresh, progress=part(progress, 0.0, 0.5))
    rest = part(progress, 0.5, 1.0)
    return proposed(found, minutes=minutes, arena=arena, start=start, speeds=speeds, progress=rest)


def proposed(
    found: DiagnoseResult,
    *,
    minutes: float = 10.0,
    arena: tuple[float, ...] | None = None,
    start: tuple[float, float, float] | None = None,
    speeds: tuple[float, float] | None = None,
    progress: Progress | None = None,
) -> ProposeResult:
    """The experiment for a diagnosis that is there."""
    checked_minutes(minutes)
    inside, bounds = _limits(found, arena, start, speeds)
    meter = Meter(progress, PHASES, pace=GENERATIONS)
    with in_force(found.settings):
        result = ProposeResult(
            found,
            search(found.diagnosis, inside, bounds, minutes, tick=meter),
            limits_in_words(minutes, arena, start, speeds),
        )
    meter.done()
    return result


def _limits(
    found: DiagnoseResult,
    arena: tuple[float, ...] | None,
    start: tuple[float, float, float] | None,
    speeds: tuple[float, float] | None,
) -> tuple[Arena | None, Bounds | None]:
    """Where a robot on wheels may be and how fast; nothing for one on joints, which repeats what it drove."""
    tracks, model = found.ready.predictor.tracks, found.ready.model
    if not isinstance(model, JointedModel):
        return arena_of(tracks, arena, start), bounds_of(tracks, model, speeds)
    if (arena, start, speeds) != (None, None, None):
        raise DataError(
            f"arena, start and speeds are for wheels, and {model.name} is a body on joints: its experiment repeats cycles "
            f"that were driven. Leave out {in_both('--arena, --start and --speeds', 'arena, start, speeds')}."
        )
    return None, None


def checked_minutes(minutes: float) -> None:
    """DataError unless an experiment can last so long."""
    if not isinstance(minutes, Real):
        raise DataError(f"minutes is {minutes!r}; it must be a number above 0 and at most {MOST_MINUTES:g}.")
    if not (math.isfinite(minutes) and 0 < minutes <= MOST_MINUTES):
        raise DataError(f"minutes is {minutes:g}; it must be above 0 and at most {MOST_MINUTES:g}.")


def checked_output(path: Path, what: str, ending: str) -> Path:
    """The path; DataError unless a file of that ending can be written there."""
    if path.suffix != ending:
        raise DataError(f"{what} cannot be written to {path}; give a name that ends in {ending}.")
    if found := obstacle(path):
        raise DataError(f"{what} cannot be written to {path}: {found}; choose another place.")
    return path
