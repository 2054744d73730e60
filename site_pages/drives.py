"""One drive, predicted by the plain model and by the model with one effect: what the pictures of the gallery show."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from bns.physics.effect import Effect
from bns.physics.model import Model, load_model
from bns.physics.wheels.differential_drive import observe, track

FRAMES_S = 0.02
COMMANDS = (  # left m/s, right m/s, s
    (0.12, 0.12, 2.0),
    (0.12, 0.06, 2.5),
    (0.05, 0.13, 3.5),
    (-0.10, -0.10, 1.5),
    (0.08, -0.08, 0.8),
    (0.14, 0.10, 3.0),
    (0.03, 0.03, 2.0),
)
"""A straight, curves both ways, a reversal, a turn on the spot and a slow crawl: what at least one effect needs each."""

VALUES: dict[str, dict[str, float]] = {
    "acceleration-limit": {"max_m_s2": 0.3},
    "backlash": {"gap_m": 0.04},
    "backlash-start": {"gap_m": 0.04, "crossed_share": 0.0},
    "backlash-mismatch": {"gap_m": 0.03, "crossed_share": 1.0, "left_share": 2.0},
    "battery-sag": {"rate_per_s": -0.01, "per_volt": 0.0},
    "braking-lag": {"tau_s": 0.5, "brake_ratio": 0.2},
    "braking-limit": {"max_m_s2": 0.15, "brake_ratio": 4.0},
    "braking-ramp": {"forward_m_s2": 0.1, "turn_rad_s2": 1.5, "brake_ratio": 4.0},
    "camera-rotation": {"angle_rad": 0.2},
    "camera-scale": {"factor": 1.1},
    "caster-drag": {"friction_m_s": 0.03, "damping_m": 0.01, "trail_m": 0.02, "pivot_m": -0.05},
    "caster-swing": {"loss": 0.6, "trail_m": 0.03},
    "caster-trail": {"loss": 0.6, "trail_m": 0.03, "pivot_m": 0.0442},
    "clock-drift": {"rate": 0.02},
    "clock-offset": {"offset_s": 0.4},
    "command-delay": {"delay_s": 0.3},
    "command-quantisation": {"step_m_s": 0.03, "share": 1.0},
    "command-truncation": {"step_m_s": 0.06, "share": 1.0},
    "command-rate": {"period_s": 0.7},
    "compass-deviation": {"cosine_share": 0.3, "sine_share": 0.2},
    "controller-overshoot": {"tau_s": 0.15, "lead_s": 0.1, "swing_s": 0.3, "turn_ratio": 1.0},
    "dead-zone": {"width_m_s": 0.02},
    "floor-patch": {"x_m": 0.35, "y_m": 0.0, "radius_m": 0.12, "loss": 0.3},
    "wheel-patch": {"x_m": 0.35, "y_m": 0.0, "radius_m": 0.12, "loss": 0.3, "apart_share": 1.0},
    "floor-slope": {"x_m_s": 0.0, "y_m_s": -0.01},
    "force-limit": {"max_m_s2": 0.15, "turn_ratio": 4.0},
    "traction-limit": {"max_m_s2": 0.15, "turn_ratio": 4.0},
    "wheel-diameters": {"ratio": 0.9},
    "velocity-ramp": {"forward_m_s2": 0.1, "turn_rad_s2": 1.5},
    "heading-delay": {"delay_s": 0.4},
    "heating": {"loss_per_m": 0.2, "cool_s": 60.0},
    "inertia-lag": {"tau_s": 0.6, "turn_ratio": 0.3},
    "lag-mismatch": {"tau_s": 0.4, "ratio": 3.0},
    "affine-distortion": {"stretch": 0.15, "shear": 0.0},
    "lens-distortion": {"per_m2": 0.3, "x_m": 0.2, "y_m": 0.0},
    "marker-offset": {"forward_m": 0.04, "left_m": 0.03},
    "motor-lag": {"tau_s": 0.3},
    "sensor-rotation": {"angle_rad": 0.2},
    "dead-zone-mismatch": {"width_m_s": 0.004, "left_share": 1.8},
    "speed-limit-mismatch": {"max_m_s": 0.12, "left_spare": 0.1},
    "reverse-gain": {"gain": 0.8},
    "reversal-pause": {"pause_s": 0.5},
    "start-delay": {"wait_s": 0.6},
    "side-slip": {"slip_s": 0.3},
    "slope-load": {"x_m_s": 0.02, "y_m_s": 0.01, "behind_share": 0.1, "at_rest": 0.0},
    "speed-gain": {"gain": 1.1},
    "speed-limit": {"max_m_s": 0.1},
    "speed-scaling": {"max_m_s": 0.1},
    "stribeck": {"width_m_s": 0.03, "fade_m_s": 0.05},
    "dead-band": {"threshold_m_s": 0.04},
    "breakaway": {"threshold_m_s": 0.1, "stop_ratio": 0.4},
    "carpet-drift": {"x_share": 0.1, "y_share": -0.05},
    "command-timeout": {"timeout_s": 2.2},
    "overload-trip": {"step_m_s": 0.1, "off_s": 0.5},
    "supply-trip": {"step_m_s": 0.1, "off_s": 0.5},
    "sliding-contact": {"friction_m_s": 0.02, "distance_share": 0.6, "left_share": 0.0},
    "supply-sag": {"loss_s_m": 1.0},
    "tether-load": {
        "pull_per_s": 0.02,
        "anchor_x_m": 0.2,
        "anchor_y_m": 0.4,
        "free_m": 0.1,
        "ahead_share": -0.5,
        "at_rest": 0.0,
    },
    "tether-pull": {"pull_per_s": 0.015, "anchor_x_m": 0.0, "anchor_y_m": 0.5},
    "tilted-camera": {"x_per_m": 0.3, "y_per_m": 0.1},
    "turn-dead-zone": {"width_rad_s": 0.3},
    "friction-warm-up": {"width_m_s": 0.01, "cold_m_s": 0.03, "time_s": 60.0},
    "turn-slip": {"slip_s": 0.12},
    "turn-slip-quadratic": {"slip_s2": 0.1},
    "floor-joints": {"spacing_m": 0.1, "across_rad": 0.5, "at_m": 0.0, "loss_m": 0.02, "over_m": 0.015},
    "floor-tiles": {
        "spacing_m": 0.1,
        "across_rad": 0.5,
        "at_m": 0.0,
        "loss_m": 0.02,
        "over_m": 0.015,
        "second_at_m": 0.05,
        "second_share": 1.0,
    },
    "uneven-patch": {"x_m": 0.35, "y_m": 0.0, "radius_m": 0.12, "loss": 0.08, "apart_share": 1.0, "left_share": 2.0},
    "understeer": {"loss_s_m": 1.5},
    "turn-asymmetry": {"share": 0.2},
    "pivot-slip": {"loss": 0.4},
    "warm-up": {"loss": 0.5, "time_s": 3.0},
    "wheel-eccentricity": {"left_share": 0.6, "right_share": -0.6, "turn_m": 0.4},
    "wheel-mismatch": {"ratio": 1.05},
    "wheelbase": {"factor": 1.15},
    "yaw-bias": {"rate_rad_s": 0.04},
}
"""Sizes that can be seen in a picture of half a metre. They are larger than a sound robot shows."""


@dataclass(frozen=True)
class Demonstration:
    """The same commands in both models: t_s (frames,), x_m and y_m as (frames, 2)."""

    values: dict[str, float]
    t_s: NDArray[np.float64]
    plain_m: NDArray[np.float64]
    with_effect_m: NDArray[np.float64]
    by_heading: bool = False
    """Whether the second path is that of wrong headings: the places themselves are right."""

    @property
    def apart_m(self) -> NDArray[np.float64]:
        """Distance between the two positions at each time, (frames,)."""
        gap: NDArray[np.float64] = np.hypot(*(self.with_effect_m - self.plain_m).T)
        return gap


def demonstrate(effect: Effect) -> Demonstration:
    """Drive `COMMANDS` without and with ``effect``, from the origin, facing east."""
    values = VALUES.get(effect.name) or visible_values(effect)
    plain = load_model("khepera")
    t_s, alone = seen(plain)
    _, altered = seen(plain.with_effect(effect.name, **values))
    drawn, by_heading = altered[:, :2], False
    if effect.needs == "motions":
        drawn = added_up(alone, alone[:-1, 2] - altered[:-1, 2], altered)
    elif by_heading := np.array_equal(drawn, alone[:, :2]):
        drawn = added_up(alone, altered[:-1, 2] - alone[:-1, 2], alone)
    return Demonstration(values, t_s, alone[:, :2], drawn, by_heading)


def seen(model: Model) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Times (frames,) and poses (frames, 3) as the tracker of ``model`` reports them."""
    left, right, duration = np.array(COMMANDS).T[:, None, :]
    found = track(model, left, right, duration, dense_dt_s=FRAMES_S)
    return found.t_s[0], observe(found.poses[0], None, model)


def added_up(
    plain: NDArray[np.float64], turned: NDArray[np.float64], steps_of: NDArray[np.float64]
) -> NDArray[np.float64]:
    """The path that steps add up to, each turned by an angle (frames - 1,), from where the plain path begins: (frames, 2).

    Of motions that a sensor on the robot measures, taken for the robot's own; or of the robot's own, by a wrong heading.
    """
    step = np.diff(steps_of[:, :2], axis=0)
    cos, sin = np.cos(turned), np.sin(turned)
    steps = np.stack([cos * step[:, 0] - sin * step[:, 1], sin * step[:, 0] + cos * step[:, 1]], axis=1)
    return np.vstack([plain[:1, :2], plain[0, :2] + np.cumsum(steps, axis=0)])


def visible_values(effect: Effect) -> dict[str, float]:
    """Of an effect that `VALUES` lacks: a quarter of the way from neutral to the end of the plausible range."""
    values = {}
    for p in effect.parameters:
        low, high = p.plausible
        values[p.name] = p.neutral + (high - p.neutral) / 4 if np.isfinite(p.neutral) else (low * high) ** 0.5
    return values
