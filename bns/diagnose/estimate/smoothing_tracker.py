"""Do the motors lag, or does the tracker smooth its poses? On straight lines the two are the same.

A first-order low-pass filter of the poses delays all motion as a lag of both wheels does, and shortens curves besides: by half of
the squared product of turn rate and time constant, so that turns tell the two apart. No effect of the catalogue is a filter of
the tracker's, so it is compared here with a lag that was found, or with what stands in its place.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import reduce

import numpy as np
from scipy.optimize import minimize_scalar

from bns.diagnose.data.tracks import Array
from bns.diagnose.estimate.fit import Fit
from bns.diagnose.estimate.fitting import Problem
from bns.diagnose.estimate.noise import huber
from bns.diagnose.estimate.significance import MIN_Z, paired_elpd_diff
from bns.diagnose.predict.wheels import WheelPredictor
from bns.diagnose.settings import DEFAULTS
from bns.physics.model import Model

LAG = "motor-lag"
LATE = {LAG: "tau_s", "controller-overshoot": "swing_s", "command-delay": "delay_s", "clock-offset": "offset_s"}
"""Effects that make all motion late, the most alike first, and how much."""
CURVES = ("turn-slip", "turn-slip-quadratic", "clock-offset")
"""Effects that may stand beside a lag for what a filter does in curves, and for when it begins."""
_WITHIN = DEFAULTS.estimate.smoothing_within


@dataclass(frozen=True)
class SmoothingTracker:
    """A tracker that smooths with a time constant, in place of some effects; ``z``: standard errors by which it fits better."""

    tau_s: float
    z: float
    instead_of: tuple[str, ...] = (LAG,)

    def in_words(self, all_explained: bool = True) -> str:
        """What to say of a lag that was found; "" where the tracks speak for it.

        Where something is left unexplained, a better fit says little: the one that happens to imitate the rest has it.
        """
        if self.z < -MIN_Z:
            return ""
        effects = " and ".join(self.instead_of)
        alone = "motors that lag" if self.instead_of == (LAG,) else "this effect"
        others = "these effects" if len(self.instead_of) > 1 else alone
        tracker = f"a tracker that smooths its poses (a low-pass filter with a time constant of {1e3 * self.tau_s:.0f} ms)"
        known = "Ask whether yours does, and compare with raw poses or with the wheels' own speeds."
        if self.z > MIN_Z and not all_explained:
            return (
                f"{effects}: {tracker} may do the work of {others}, as far as what is left unexplained lets one tell. {known}"
            )
        if self.z <= MIN_Z:
            return f"{effects}: {tracker} fits this log as well as {others}. {known}"
        return (
            f"{effects}: {tracker} fits this log better than {others}, by {self.z:.1f} standard errors: it shortens curves, too. "
            f"{known}"
        )


def smoothing_tracker(problem: Problem, fit: Fit) -> SmoothingTracker | None:
    """The alternative to what makes a fitted model late; None where nothing does, or its robot has no wheels."""
    predictor, own = problem.predictor, [a.effect.name for a in fit.model.effects if not a.per_trial]
    late = next((name for name in LATE if name in own), "")
    if not isinstance(predictor, WheelPredictor) or predictor.tracks.relative or not late:
        return None
    lag_s = fit.model.values_of(late)[LATE[late]]
    if not lag_s > 0.0:
        return None
    bare = fit.model.without(late)
    imitated = tuple(name for name in own if name in CURVES and name != late)
    tried = [(), imitated] if imitated else [()]
    found = [((late, *names), *_best(problem, predictor, reduce(Model.without, names, bare), lag_s)) for names in tried]
    instead_of, tau_s, losses = min(found, key=lambda one: float(one[2].sum()))
    gain, se = paired_elpd_diff(fit.losses, losses)
    return SmoothingTracker(tau_s, gain / se if se > 0 else 0.0, instead_of)


def _best(problem: Problem, predictor: WheelPredictor, model: Model, lag_s: float) -> tuple[float, Array]:
    """The time constant (s) with which a model without the lag fits best, and the losses (trials,) with it."""

    def losses(log_tau: float) -> Array:
        return problem.per_trial(huber(problem.whitened_steps(predictor.smoothed_steps(model, float(np.exp(log_tau))))))

    bounds = np.log(lag_s) + np.array([-1.0, 1.0]) * np.log(_WITHIN)
    best = minimize_scalar(lambda log_tau: float(losses(log_tau).sum()), bounds=bounds, method="bounded", options={"xatol": 0.01})
    return float(np.exp(best.x)), losses(float(best.x))
