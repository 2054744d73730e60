"""The numbers of a robot and its sensor from single relative motions, all fitted together, found significant or not.

What a diagnosis names it fits with the rest at the drawing's values; but the wheels' size and their distance do much the same
to short motions, so either alone would have too narrow an interval. A calibration asks for all, each with the others free:
Censi et al., "Simultaneous calibration of odometry and sensor parameters for mobile robots", IEEE T-RO 29(2), 2013, sec. IV.
"""

from __future__ import annotations

from collections.abc import Collection

import numpy as np

from bns.diagnose.data.tracks import Array
from bns.diagnose.estimate.fit import Fit
from bns.diagnose.estimate.fit_set import fit_set
from bns.diagnose.estimate.starts import listed
from bns.diagnose.predict.base import Predictor
from bns.physics.model import Model

CALIBRATED = ("speed-gain", "wheel-mismatch", "wheelbase", "marker-offset", "sensor-rotation")
"""Both wheels' size (mean and ratio), their distance, and the sensor's pose on the robot."""


def calibrated(predictor: Predictor, model: Model, barred: Collection[str] = ()) -> Fit | None:
    """The fit of the model with all of `CALIBRATED` that it may have; None where the tracks are no relative motions."""
    if not predictor.tracks.relative:
        return None
    there = listed(model, None, predictor.tracks, barred)
    effects = [there[name] for name in CALIBRATED if name in there]
    return fit_set(predictor, model, effects)[1] if effects else None


def wheel_sizes(fit: Fit) -> dict[str, tuple[float, float, float]]:
    """Size of the left and the right wheel over the drawing's: value and 95 % interval; empty where the fit has not both numbers.

    From the mean size g and the ratio r of right to left: left = 2g/(1 + r), right = r·left; intervals to first order.
    """
    at = {(n.effect, n.parameter.name): i for i, n in enumerate(fit.free)}
    pair = [at.get(("speed-gain", "gain")), at.get(("wheel-mismatch", "ratio"))]
    if None in pair:
        return {}
    chosen = np.array(pair, dtype=int)
    g, r = fit.values[chosen]
    covariance: Array = fit.covariance[np.ix_(chosen, chosen)]
    left, right = 2 * g / (1 + r), 2 * g * r / (1 + r)
    slopes = {"left": (left / g, -left / (1 + r)), "right": (right / g, right / (r * (1 + r)))}
    low, high = fit.interval(int(chosen[0]))
    widths = (high - low) / 2 / max(fit.se(int(chosen[0])), 1e-300)
    out = {}
    for side, value in (("left", float(left)), ("right", float(right))):
        slope = np.array(slopes[side])
        half = widths * float(np.sqrt(slope @ covariance @ slope))
        out[side] = (value, value - half, value + half)
    return out
