"""The tracker's scale is wrong: it reports every distance too long or too short by one factor."""

from __future__ import annotations

from bns.physics.effect import Effect, Parameter
from bns.physics.signals import View


def apply(view: View, factor: float) -> View:
    """Positions times ``factor``; headings unchanged."""
    poses = view.poses.copy()
    poses[..., :2] *= factor
    return View(poses)


EFFECT = Effect(
    name="camera-scale",
    stage="measure",
    parameters=(Parameter("factor", "1", 0.2, 5.0, (0.7, 1.4), 1.0, "tracked distance divided by true distance"),),
    equation="x' = c·x, y' = c·y",
    residuals="All distances are wrong by the same fraction, while all turns fit.",
    lookalikes=("speed-gain", "wheelbase"),
    sentence="the tracker reports all distances too long or too short by one factor",
    sized="the tracker reports all distances {factor:too long|too short}",
    measurement="lay an object of known length on the floor, track both of its ends, and compare the lengths",
    apply=apply,
    needs="track",
)
