"""Worlds of the longer list: each effect listed and taken out of it; three at once; other robots and trackers."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

from tests.hidden_effects.camera import Camera, Layout
from tests.hidden_effects.world import Parameters, World


def _tether(pull_per_s: float, anchor_m: tuple[float, float], **others: float) -> Parameters:
    return {"pull_per_s": pull_per_s, "anchor_x_m": anchor_m[0], "anchor_y_m": anchor_m[1]} | others


LONGER: dict[str, tuple[Parameters, Parameters]] = {
    "wheel-eccentricity": (
        {"left_share": 0.12, "right_share": 0.0, "turn_m": 0.1288},
        {"left_share": 0.15, "right_share": 0.2, "turn_m": 0.1288},
    ),
    "backlash": ({"gap_m": 0.004}, {"gap_m": 0.01}),
    "backlash-start": ({"gap_m": 0.004, "crossed_share": 0.0}, {"gap_m": 0.01, "crossed_share": 0.5}),
    "backlash-mismatch": (
        {"gap_m": 0.003, "crossed_share": 1.0, "left_share": 2.0},
        {"gap_m": 0.006, "crossed_share": 0.5, "left_share": 0.3},
    ),
    "caster-swing": ({"loss": 0.3, "trail_m": 0.03}, {"loss": 0.6, "trail_m": 0.05}),
    "caster-trail": (
        {"loss": 0.3, "trail_m": 0.015, "pivot_m": 0.0442},
        {"loss": 0.6, "trail_m": 0.03, "pivot_m": -0.06},
    ),
    "caster-drag": (
        {"friction_m_s": 0.005, "damping_m": 0.002, "trail_m": 0.015, "pivot_m": -0.05},
        {"friction_m_s": 0.015, "damping_m": 0.004, "trail_m": 0.03, "pivot_m": -0.05},
    ),
    "wheel-diameters": ({"ratio": 0.95}, {"ratio": 1.12}),
    "heating": ({"loss_per_m": 0.03, "cool_s": 60.0}, {"loss_per_m": 0.05, "cool_s": 90.0}),
    "warm-up": ({"loss": 0.08, "time_s": 4.0}, {"loss": 0.25, "time_s": 3.0}),
    "stribeck": ({"width_m_s": 0.02, "fade_m_s": 0.04}, {"width_m_s": 0.04, "fade_m_s": 0.05}),
    "dead-band": ({"threshold_m_s": 0.03}, {"threshold_m_s": 0.045}),
    "breakaway": ({"threshold_m_s": 0.045, "stop_ratio": 0.5}, {"threshold_m_s": 0.06, "stop_ratio": 0.4}),
    "carpet-drift": ({"x_share": 0.03, "y_share": -0.02}, {"x_share": -0.05, "y_share": 0.08}),
    "command-timeout": ({"timeout_s": 1.0}, {"timeout_s": 0.6}),
    "turn-slip-quadratic": ({"slip_s2": 0.03}, {"slip_s2": 0.07}),
    "floor-patch": (
        {"x_m": 0.8, "y_m": 0.5, "radius_m": 0.35, "loss": 0.12},
        {"x_m": 0.6, "y_m": 0.6, "radius_m": 0.3, "loss": 0.35},
    ),
    "wheel-patch": (
        {"x_m": 0.8, "y_m": 0.5, "radius_m": 0.2, "loss": 0.35, "apart_share": 1.0},
        {"x_m": 0.6, "y_m": 0.6, "radius_m": 0.3, "loss": 0.5, "apart_share": 1.0},
    ),
    "uneven-patch": (
        {"x_m": 0.8, "y_m": 0.5, "radius_m": 0.25, "loss": 0.15, "apart_share": 1.0, "left_share": 2.0},
        {"x_m": 0.6, "y_m": 0.6, "radius_m": 0.3, "loss": 0.3, "apart_share": 1.0, "left_share": 0.4},
    ),
    "floor-joints": (
        {"spacing_m": 0.25, "across_rad": 0.4, "at_m": 0.1, "loss_m": 0.004, "over_m": 0.015},
        {"spacing_m": 0.15, "across_rad": -1.2, "at_m": -0.05, "loss_m": 0.008, "over_m": 0.015},
    ),
    "floor-tiles": (
        {"spacing_m": 0.3, "across_rad": 0.2, "at_m": 0.1, "loss_m": 0.004, "over_m": 0.015}
        | {"second_at_m": 0.05, "second_share": 1.0},
        {"spacing_m": 0.2, "across_rad": -0.6, "at_m": 0.0, "loss_m": 0.008, "over_m": 0.015}
        | {"second_at_m": 0.1, "second_share": 0.6},
    ),
    "command-rate": ({"period_s": 0.2}, {"period_s": 0.5}),
    "command-quantisation": ({"step_m_s": 0.02}, {"step_m_s": 0.04}),
    "command-truncation": ({"step_m_s": 0.02}, {"step_m_s": 0.04}),
    "reversal-pause": ({"pause_s": 0.1}, {"pause_s": 0.3}),
    "start-delay": ({"wait_s": 0.08}, {"wait_s": 0.2}),
    "reverse-gain": ({"gain": 0.95}, {"gain": 1.12}),
    "turn-asymmetry": ({"share": 0.025}, {"share": -0.06}),
    "pivot-slip": ({"loss": 0.05}, {"loss": 0.15}),
    "dead-zone-mismatch": ({"width_m_s": 0.006, "left_share": 1.8}, {"width_m_s": 0.015, "left_share": 0.4}),
    "speed-limit-mismatch": ({"max_m_s": 0.16, "left_spare": 0.2}, {"max_m_s": 0.12, "left_spare": -1.0}),
    "turn-dead-zone": ({"width_rad_s": 0.1}, {"width_rad_s": 0.25}),
    "friction-warm-up": (
        {"width_m_s": 0.004, "cold_m_s": 0.008, "time_s": 240.0},
        {"width_m_s": 0.01, "cold_m_s": 0.02, "time_s": 480.0},
    ),
    "supply-sag": ({"loss_s_m": 0.2}, {"loss_s_m": 0.6}),
    "tilted-camera": ({"x_per_m": 0.03, "y_per_m": -0.02}, {"x_per_m": -0.07, "y_per_m": 0.06}),
    "compass-deviation": ({"cosine_share": 0.05, "sine_share": -0.03}, {"cosine_share": -0.12, "sine_share": 0.15}),
    "heading-delay": ({"delay_s": 0.06}, {"delay_s": -0.12}),
    "affine-distortion": ({"stretch": 0.015, "shear": 0.0}, {"stretch": -0.02, "shear": 0.03}),
    "lens-distortion": (
        {"per_m2": -0.04, "x_m": 0.8, "y_m": 0.5},
        {"per_m2": 0.08, "x_m": 0.7, "y_m": 0.4},
    ),
    "force-limit": ({"max_m_s2": 0.4, "turn_ratio": 2.5}, {"max_m_s2": 0.2, "turn_ratio": 4.0}),
    "traction-limit": ({"max_m_s2": 0.4, "turn_ratio": 2.0}, {"max_m_s2": 0.2, "turn_ratio": 1.5}),
    "velocity-ramp": (
        {"forward_m_s2": 0.3, "turn_rad_s2": 8.0},
        {"forward_m_s2": 0.15, "turn_rad_s2": 3.0},
    ),
    "inertia-lag": ({"tau_s": 0.12, "turn_ratio": 0.5}, {"tau_s": 0.25, "turn_ratio": 0.3}),
    "speed-scaling": ({"max_m_s": 0.16}, {"max_m_s": 0.12}),
    "lag-mismatch": ({"tau_s": 0.12, "ratio": 1.5}, {"tau_s": 0.2, "ratio": 0.4}),
    "braking-lag": ({"tau_s": 0.12, "brake_ratio": 0.6}, {"tau_s": 0.2, "brake_ratio": 2.0}),
    "braking-limit": ({"max_m_s2": 0.4, "brake_ratio": 2.0}, {"max_m_s2": 0.25, "brake_ratio": 0.5}),
    "braking-ramp": (
        {"forward_m_s2": 0.3, "turn_rad_s2": 8.0, "brake_ratio": 2.0},
        {"forward_m_s2": 0.2, "turn_rad_s2": 4.0, "brake_ratio": 0.5},
    ),
    "gear-friction": (
        {"tau_s": 0.1, "turn_ratio": 1.0, "friction_m_s": 0.03, "loss_m_s": 0.0},
        {"tau_s": 0.2, "turn_ratio": 0.5, "friction_m_s": 0.08, "loss_m_s": 0.01},
    ),
    "scrub-friction": (
        {"tau_s": 0.08, "turn_ratio": 0.9, "width_rad_s": 0.2},
        {"tau_s": 0.2, "turn_ratio": 0.6, "width_rad_s": 0.5},
    ),
    "sliding-contact": (
        {"friction_m_s": 0.006, "distance_share": 0.5, "left_share": 0.0},
        {"friction_m_s": 0.02, "distance_share": 0.9, "left_share": -0.4},
    ),
    "slope-load": (
        {"x_m_s": 0.003, "y_m_s": -0.002, "behind_share": 0.05, "at_rest": 0.0},
        {"x_m_s": -0.008, "y_m_s": 0.006, "behind_share": 0.15, "at_rest": 1.0},
    ),
    "tether-load": (
        _tether(0.01, (1.2, 0.3), free_m=0.2, ahead_share=-0.3, at_rest=0.0),
        _tether(0.03, (0.6, 0.6), free_m=0.1, ahead_share=-0.6, at_rest=1.0),
    ),
    "controller-overshoot": (
        {"tau_s": 0.064, "lead_s": 0.0, "swing_s": 0.053, "turn_ratio": 1.0},
        {"tau_s": 0.04, "lead_s": 0.1, "swing_s": 0.12, "turn_ratio": 0.5},
    ),
    "mass-offset": ({"lead_m_s": 0.0006}, {"lead_m_s": -0.0015}),
    "overload-trip": ({"step_m_s": 0.2, "off_s": 0.15}, {"step_m_s": 0.15, "off_s": 0.3}),
    "supply-trip": ({"step_m_s": 0.3, "off_s": 0.15}, {"step_m_s": 0.2, "off_s": 0.4}),
}
"""Medium and strong, of the Khepera."""
BESIDE: dict[str, dict[str, Parameters]] = {
    "wheel-diameters": {"acceleration-limit": {"max_m_s2": 0.25}},
    "traction-limit": {"motor-lag": {"tau_s": 0.15}},
}
"""What an effect needs beside it to differ from a simpler one: without limits, diameters are a mismatch of commands.

Without a lag, tyres limit what motors do."""
ALIKE = {
    "caster-swing": ("caster-trail",),
    "caster-trail": ("caster-swing",),
    "slope-load": ("tether-load",),
    "floor-patch": ("wheel-patch", "uneven-patch"),
    "wheel-patch": ("floor-patch", "uneven-patch"),
    "uneven-patch": ("floor-patch", "wheel-patch"),
    "floor-joints": ("floor-tiles",),
    "backlash": ("backlash-start", "backlash-mismatch"),
    "backlash-start": ("backlash-mismatch",),
    "wheel-diameters": ("wheel-mismatch",),
    "overload-trip": ("supply-trip",),
    "supply-trip": ("overload-trip",),
    "traction-limit": ("force-limit", "acceleration-limit"),
}
"""What would stand in for an effect that is taken out: a slope is a cable from far away, and one patch contains another."""
TURNING = {
    "backlash",
    "backlash-mismatch",
    "backlash-start",
    "braking-lag",
    "breakaway",
    "caster-drag",
    "caster-swing",
    "caster-trail",
    "dead-band",
    "gear-friction",
    "mass-offset",
    "overload-trip",
    "pivot-slip",
    "reversal-pause",
    "reverse-gain",
    "scrub-friction",
    "sliding-contact",
    "start-delay",
    "stribeck",
    "supply-trip",
}
"""Effects that show only where wheels reverse or turn slowly."""

TRIPLES: tuple[dict[str, Parameters], ...] = (
    {"speed-gain": {"gain": 0.94}, "wheel-mismatch": {"ratio": 0.975}, "motor-lag": {"tau_s": 0.12}},
    {"wheelbase": {"factor": 1.08}, "side-slip": {"slip_s": 0.08}, "yaw-bias": {"rate_rad_s": -0.03}},
    {
        "dead-zone": {"width_m_s": 0.008},
        "wheelbase": {"factor": 0.94},
        "marker-offset": {"forward_m": 0.02, "left_m": 0.01},
    },
    {
        "turn-slip": {"slip_s": 0.08},
        "wheel-mismatch": {"ratio": 1.03},
        "floor-slope": {"x_m_s": 0.006, "y_m_s": -0.003},
    },
    {"warm-up": LONGER["warm-up"][1], "wheelbase": {"factor": 1.06}, "camera-rotation": {"angle_rad": -0.06}},
    {"floor-patch": LONGER["floor-patch"][1], "speed-gain": {"gain": 1.05}, "wheel-mismatch": {"ratio": 1.02}},
    {"backlash": LONGER["backlash"][0], "motor-lag": {"tau_s": 0.1}, "wheel-mismatch": {"ratio": 0.98}},
    {
        "wheel-eccentricity": LONGER["wheel-eccentricity"][1],
        "wheelbase": {"factor": 0.95},
        "speed-limit": {"max_m_s": 0.16},
    },
)

SIZED = ("tiny", "large", "vehicle")
OF_SIZE: dict[str, Parameters] = {
    "wheelbase": {"factor": 1.08},
    "motor-lag": {"tau_s": 0.12},
    "marker-offset": {"forward_m": 0.02, "left_m": -0.015},
    "dead-zone": {"width_m_s": 0.01},
    "turn-slip": {"slip_s": 0.06},
}
LENGTHS = {"forward_m", "left_m", "width_m_s"}
REFERENCE_M = 0.0884

NOISE = {
    "5-hz": {"layout": Layout(frame_s=0.2)},
    "100-hz": {"layout": Layout(frame_s=0.01)},
    "8-mm": {"camera": Camera(0.008, 0.015, 0.001, 0.002)},
    "ar1": {"camera": Camera(0.0015, 0.007, memory=0.9)},
    "3-percent-lost": {"camera": Camera(0.0015, 0.007, lost=0.03, outliers=0.01)},
}
UNDER_NOISE: dict[str, Parameters] = {
    "wheelbase": {"factor": 1.08},
    "motor-lag": {"tau_s": 0.12},
    "wheel-mismatch": {"ratio": 0.96},
    "camera-rotation": {"angle_rad": -0.1},
}


def further() -> Iterator[World]:
    """All of these families."""
    yield from _longer()
    for number, hidden in enumerate(TRIPLES):
        plan = "mixed" if number % 2 or TURNING & set(hidden) else "forward"
        yield World(f"triple-{'-'.join(hidden)}", "triple", hidden, plan=plan)
    for robot in SIZED:
        yield World(f"size-{robot}-none", "size", robot=robot)
        for name, parameters in OF_SIZE.items():
            yield World(f"size-{robot}-{name}", "size", {name: _sized(parameters, robot)}, robot=robot, plan="mixed")
    for condition, changes in NOISE.items():
        yield replace(World(f"size-{condition}-none", "size"), **changes)
        for name, parameters in UNDER_NOISE.items():
            yield replace(World(f"size-{condition}-{name}", "size", {name: parameters}), **changes)


def _longer() -> Iterator[World]:
    for number, (name, strengths) in enumerate(LONGER.items()):
        for level, parameters in zip(("medium", "strong"), strengths, strict=True):
            plan = "mixed" if name in TURNING or (number + (level == "strong")) % 2 else "forward"
            beside = BESIDE.get(name, {})
            yield World(f"new-{name}-{level}", "new", {name: parameters, **beside}, plan=plan)
            out = World(f"removed-{name}-{level}", "removed", beside, unlisted={name: parameters}, plan=plan)
            yield replace(out, barred=(name, *ALIKE.get(name, ())))


def _sized(parameters: Parameters, robot: str) -> Parameters:
    wide = {"tiny": 0.05, "large": 0.4, "vehicle": 1.5}[robot] / REFERENCE_M
    return {name: value * wide if name in LENGTHS else value for name, value in parameters.items()}
