"""What a fitted model leaves unexplained, seen in five ways: along variables, along time, in moments, at changes of command, and
at lines on the floor.

Each sees faults that the others miss, and each has a least size, since honest robots are not alike from trial to trial either.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

from bns.diagnose.estimate.fit import Fit
from bns.diagnose.estimate.fitting import Problem
from bns.diagnose.residuals.along_variables import ResidualDependence, significant_dependence
from bns.diagnose.residuals.autocorrelation import Autocorrelation, autocorrelations
from bns.diagnose.residuals.command_times import CommandTimes, command_times
from bns.diagnose.residuals.floor_lines import FloorLines, floor_lines
from bns.diagnose.residuals.moments_share import SharedCause, shared_cause
from bns.diagnose.residuals.outliers import Outlier, judged_windows, outliers
from bns.diagnose.residuals.shared_place import SharedPlace, shared_place
from bns.physics.jointed.model import JointedModel


@dataclass(frozen=True)
class Unexplained:
    """Dependences and outliers that cannot be luck, best and worst first; the largest autocorrelation if significant."""

    residual_dependence: tuple[ResidualDependence, ...]
    autocorrelation: Autocorrelation | None
    outliers: tuple[Outlier, ...]
    command_times: CommandTimes | None = None
    """The scatter of the times at which commands take effect: no model predicts it."""
    shared: SharedCause | None = None
    """What the changes of command share that such moments follow."""
    place: SharedPlace | None = None
    """Where, or when in their trials, such moments begin."""
    lines: tuple[FloorLines, ...] = ()
    """Lines on the floor at which wheels lose way."""

    @property
    def any(self) -> bool:
        """Something is."""
        return bool(self.residual_dependence or self.autocorrelation or self.outliers or self.command_times or self.lines)


NOTHING = Unexplained((), None, ())
"""Nothing is left."""


def unexplained(problem: Problem, fit: Fit, seen: Sequence[ResidualDependence], far: bool = False) -> Unexplained:
    """Of the patterns ``seen`` in a fitted model, and of its innovations, what is too large and too certain to be luck.

    ``far``: errors are far above tracking noise, so that lines on the floor are looked for as well.

    On a floor a body that touched it a little otherwise goes on otherwise: there only what swings counts as alike over time.
    """
    largest = autocorrelations(problem, fit)[0]
    drifts = isinstance(fit.model, JointedModel) and fit.model.free and largest.period_s is None
    moments, shared, place = _moments(problem, fit)
    return Unexplained(
        tuple(significant_dependence(list(seen))),
        largest if largest.significant and not drifts else None,
        moments,
        command_times(problem, fit),
        shared,
        place,
        floor_lines(problem, fit) if far else (),
    )


def without_moments_explained(rest: Unexplained, problem: Problem, fit: Fit) -> Unexplained:
    """The same, with those moments that stand out beside a larger model of the same tracks as well; others are not looked for."""
    if not rest.outliers:
        return rest
    trials = {moment.trial for moment in rest.outliers}
    moments, shared, place = _moments(problem, fit)
    left = tuple(moment for moment in moments if moment.trial in trials)
    return replace(rest, outliers=left, shared=shared if left else None, place=place if left else None)


def _moments(problem: Problem, fit: Fit) -> tuple[tuple[Outlier, ...], SharedCause | None, SharedPlace | None]:
    windows = judged_windows(problem, fit)
    moments = tuple(outliers(problem, fit, windows))
    return (moments, shared_cause(problem, windows), shared_place(problem, windows)) if moments else ((), None, None)
