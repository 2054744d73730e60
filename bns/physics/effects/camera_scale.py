"""The tracker's metre is not a metre."""

from __future__ import annotations

from bns.physics.effect import Effect, Parameter
from bns.physics.signals import View


def apply(view: View, factor: float) -> View:
    """Positions times ``factor``; headings as they are."""
    poses = view.poses.copy()
    poses[..., :2] *= factor
    return View(poses)


EFFECT = Effect(
    name="camera-scale",
    stage="measure",
    parameters=(Parameter("factor", "1", 0.2, 5.0, (0.7, 1.4), 1.0, "tracked over true distance"),),
    equation="x' = c·x, y' = c·y",
    residuals="All distances are wrong by the same share while all turns fit.",
    lookalikes=("speed-gain", "wheelbase"),
    sentence="the camera's positions are too large or too small",
    measurement="lay a tape measure on the floor in the camera's view and compare its length with the tracked one",
    apply=apply,
    needs="track",
)
