"""A fitted model: its numbers, how well they are known, and what each trial loses."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np
from scipy.special import ndtri, stdtrit

from bns.diagnose.data.tracks import Array
from bns.diagnose.estimate.parameters import FreeParameter
from bns.diagnose.settings import DEFAULTS
from bns.physics.model import Model

_NO_WIDTH, _FINEST = DEFAULTS.report.no_width


@dataclass(frozen=True)
class Fit:
    """A fitted model. ``losses`` (trials,) as fitted; ``held_out`` (trials,) each trial judged by a fit without it.

    ``values``, ``covariance`` of the free numbers; ``gradients`` (trials, p), ``curvature`` (p, p) at the optimum.
    """

    model: Model
    free: tuple[FreeParameter, ...]
    values: Array
    covariance: Array
    losses: Array
    held_out: Array
    whitened: Array
    jacobian: Array
    spans: Mapping[int, tuple[float, float]] = field(default_factory=dict)
    """Intervals of numbers along which the loss has steps (`jagged`), by their place among ``free``."""

    @property
    def loss(self) -> float:
        """Sum over the trials, as fitted."""
        return float(self.losses.sum())

    @property
    def jacobian_by_parameter(self) -> dict[FreeParameter, Array]:
        """Jacobian of the innovations, one column of (frames, 3) a fitted number."""
        return dict(zip(self.free, np.moveaxis(self.jacobian, 2, 0), strict=True))

    def se(self, index: int) -> float:
        """Standard error of a number; of one along which the loss has steps, as if its interval were normal."""
        if index in self.spans:
            low, high = self.spans[index]
            return (high - low) / 2.0 / float(ndtri(0.975))
        return float(np.sqrt(max(self.covariance[index, index], 0.0)))

    def interval(self, index: int, share: float = 0.95) -> tuple[float, float]:
        """Student's interval with as many degrees of freedom as there are trials to spare, within the number's bounds.

        All that is allowed where no pose depends on the number; one that is jagged may do nothing only nearby.
        """
        if index in self.spans:
            return self.spans[index]
        value, p = float(self.values[index]), self.free[index].parameter
        if len(self.jacobian) and not p.jagged and not self.jacobian[..., index].any():
            return p.low, p.high
        freedom = max(len(self.losses) - len(self.free), 1)
        half = float(stdtrit(freedom, (1 + share) / 2)) * self.se(index)
        return max(value - half, min(p.low, value)), min(value + half, max(p.high, value))


@dataclass(frozen=True)
class StartingPoint:
    """Where a fit may begin: a model, its loss, and the Jacobian's columns nearby, (frames, 3) each.

    ``promised``: the loss to which a step of least squares leads to first order.
    """

    model: Model
    loss: float
    promised: float
    jacobian_by_parameter: Mapping[FreeParameter, Array]


def without_width(low: float, high: float) -> bool:
    """Does an interval say nothing? Its number is at a bound, or no small change of it changes the loss.

    By share; of numbers above 1 by the difference and a finer share: a place that lies 900 m from the origin may be known to
    millimetres.
    """
    size, width = max(abs(low), abs(high)), abs(high - low)
    return low == high or width <= max(_NO_WIDTH * min(size, 1.0), _FINEST * size)
