"""The numbers of a robot and its sensor from single relative motions, all fitted together, found significant or not.

What a diagnosis names it fits with the rest at the drawing's values; but the wheels' size and their distance do much the same
to short motions, so either alone would have too narrow an interval. A calibration asks for all, each with the others free:
Censi et al., "Simultaneous calibration of odometry and sensor parameters for mobile robots", IEEE T-RO 29(2), 2013, sec. IV.
"""

from __future__ import annotations

from collections.abc import Collection

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
