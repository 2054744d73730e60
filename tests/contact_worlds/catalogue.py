"""The worlds: what hides in each, in plain words and SI units, and the files that a lab would have of it."""

from __future__ import annotations

import zlib
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
import yaml

from tests.contact_worlds.robots import LARGE, MEDIUM, SMALL, Caster, weak
from tests.contact_worlds.simulation import Drive, Ground, Patch, Setup, Tracker, simulate

HEADER = "trial,t_s,x_m,y_m,heading_rad,left_m_s,right_m_s"
FORMATS = ["%d", "%.2f", "%.5f", "%.5f", "%.5f", "%.4f", "%.4f"]
WEAK_MEDIUM = "speed controllers are proportional and weak (straight time constant 0.04 s), the condition for the above"


@dataclass(frozen=True)
class World:
    """A named setup with its truth; ``wheelbase_m`` is what the lab believes."""

    name: str
    kind: str
    setup: Setup
    hidden: tuple[str, ...] = ()
    expected: tuple[str, ...] = ()
    # What follows from the hidden things and may be named as well.
    also: tuple[str, ...] = ()
    wheelbase_m: float = 0.0
    seed: int = 1

    def log(self) -> np.ndarray:
        """The log's rows, simulated afresh."""
        return simulate(self.setup, [self.seed, zlib.crc32(self.name.encode())])[0]


def write(world: World, directory: Path) -> None:
    """NAME.csv, the lab's model NAME.yaml and NAME.truth.yaml."""
    directory.mkdir(parents=True, exist_ok=True)
    path = directory / world.name
    np.savetxt(path.with_suffix(".csv"), world.log(), fmt=FORMATS, delimiter=",", header=HEADER, comments="")
    wheelbase = world.wheelbase_m or world.setup.robot.wheelbase_m
    path.with_suffix(".yaml").write_text(f"base: differential-drive\nwheelbase_m: {wheelbase:g}\n")
    truth = {"kind": world.kind} | {key: list(getattr(world, key)) for key in ("hidden", "expected", "also")}
    path.with_suffix(".truth.yaml").write_text(yaml.safe_dump(truth, sort_keys=False, width=120))


def worlds(seed: int = 1) -> list[World]:
    """All worlds, in order of kind."""
    every = (*_nothing(), *_drive(), *_body(), *_tracker(), *_several(), *_unlisted())
    return [replace(world, seed=seed) for world in every]


def _nothing() -> list[World]:
    return [
        World("none-small", "none", Setup(SMALL)),
        World("none-medium", "none", Setup(MEDIUM, tracker=Tracker(correlation=0.6))),
        World("none-large", "none", Setup(LARGE)),
    ]


def _single(name: str, setup: Setup, hidden: str, expected: str, *also: str, wheelbase_m: float = 0.0) -> World:
    return World(name, "single", setup, tuple(hidden.split("; ")), tuple(expected.split()), also, wheelbase_m)


def _drive() -> list[World]:
    """One effect between the command and the wheel's set speed."""
    return [
        _single("lag-short", Setup(SMALL, Drive(lag_s=0.06)), "motor lag, time constant 0.06 s", "motor-lag"),
        _single("lag-long", Setup(MEDIUM, Drive(lag_s=0.25)), "motor lag, time constant 0.25 s", "motor-lag"),
        _single(
            "acceleration-limit",
            Setup(MEDIUM, Drive(acceleration_ms2=0.3), tracker=Tracker(correlation=0.6)),
            "each wheel's set speed changes by 0.3 m/s2 at most",
            "acceleration-limit",
        ),
        _single(
            "overshoot",
            Setup(weak(MEDIUM, 0.06), Drive(integral_per_s=8.0)),
            "speed controllers with an integral part, 8 /s times the proportional one (straight time constant 0.06 s)",
            "controller-overshoot",
        ),
        _single(
            "overshoot-hard",
            Setup(weak(MEDIUM, 0.1), Drive(integral_per_s=25.0)),
            "the same with 25 /s and 0.1 s: wheels that swing for a second",
            "controller-overshoot",
        ),
        _single("latency", Setup(LARGE, Drive(latency_s=0.12)), "commands act 0.12 s late", "latency", "clock-offset"),
        _single(
            "both-slow",
            Setup(MEDIUM, Drive(gain_left=0.95, gain_right=0.95)),
            "both wheels turn at 0.95 of the command",
            "speed-gain",
        ),
        _single("left-slow", Setup(SMALL, Drive(gain_left=0.95)), "left wheel: 0.95 of the command", "speed-mismatch"),
        _single(
            "wheelbase",
            Setup(MEDIUM, tracker=Tracker(correlation=0.6)),
            "wheelbase is 0.25 m, the lab's model says 0.23 m",
            "wheelbase",
            wheelbase_m=0.23,
        ),
        _single(
            "dead-zone",
            Setup(SMALL, Drive(dead_zone_ms=0.03)),
            "a wheel stands while its command is below 0.03 m/s",
            "dead-zone",
        ),
    ]


def _body() -> list[World]:
    """One effect of the robot's body or the forces on it."""
    wobble = replace(weak(MEDIUM), caster=Caster(trail_m=0.03, damping_nms=0.01, friction_nm=0.01))
    return [
        _single(
            "wheel-friction",
            Setup(replace(weak(MEDIUM, 0.03), wheel_friction_nm=0.05)),
            "dry friction of 0.05 N m in each wheel; proportional controllers with a straight time constant of 0.03 s",
            "wheel-friction",
            "dead-zone",
            "motor-lag",
        ),
        _single(
            "slope",
            Setup(weak(MEDIUM), ground=Ground(slope_rad=0.06, downhill_rad=0.8)),
            f"floor falls by 0.06 rad towards 0.8 rad; {WEAK_MEDIUM}",
            "slope",
            "motor-lag",
        ),
        _single(
            "caster",
            Setup(wobble),
            "swivel caster 0.125 m behind the axle, trail 0.03 m, hinge damping 0.01 N m s, hinge friction 0.01 N m; "
            + WEAK_MEDIUM,
            "caster-swing",
            "motor-lag",
        ),
        _single(
            "payload",
            Setup(replace(MEDIUM, payload_kg=4.0, torque_limit_nm=0.04)),
            "4 kg on a robot of 2.8 kg; motors give 0.04 N m at most",
            "payload",
            "acceleration-limit",
        ),
        _single(
            "eccentric",
            Setup(replace(SMALL, eccentricity_m=0.0015)),
            "left wheel of radius 0.02 m sits 0.0015 m off its centre; every trial starts with the thick side ahead",
            "wheel-eccentricity",
        ),
        _single(
            "tether",
            Setup(replace(weak(MEDIUM), tether_n_m=4.0, tether_free_m=0.1, tether_at=(0.4, -0.2))),
            f"rubber band of 4 N/m, free length 0.1 m, from (0.4, -0.2) m to 0.125 m behind the axle; {WEAK_MEDIUM}",
            "tether",
            "motor-lag",
        ),
    ]


def _tracker() -> list[World]:
    """One fault of the measurement."""
    turned = "positions are turned by 0.07 rad about the origin, headings are not"
    return [
        _single("camera-scale", Setup(MEDIUM, tracker=Tracker(scale=1.04)), "positions times 1.04", "camera-scale"),
        _single("camera-rotation", Setup(SMALL, tracker=Tracker(rotation_rad=0.07)), turned, "camera-rotation"),
        _single(
            "clock",
            Setup(LARGE, tracker=Tracker(lead_s=0.1)),
            "tracker's clock is off: a row bears the pose of 0.1 s later",
            "clock-offset",
        ),
        _single(
            "marker",
            Setup(MEDIUM, tracker=Tracker(marker_x_m=0.03, marker_y_m=-0.015)),
            "marker 0.03 m ahead and 0.015 m right of the axle's centre",
            "marker-offset",
        ),
    ]


def _several() -> list[World]:
    return [
        World(
            "lag-and-latency",
            "several",
            Setup(SMALL, Drive(lag_s=0.12, latency_s=0.1)),
            ("motor lag, time constant 0.12 s", "commands act 0.1 s late"),
            ("motor-lag", "latency"),
        ),
        World(
            "slope-and-mismatch",
            "several",
            Setup(weak(MEDIUM), Drive(gain_right=0.94), Ground(slope_rad=0.05, downhill_rad=-1.2)),
            ("floor falls by 0.05 rad towards -1.2 rad", "right wheel turns at 0.94 of the command", WEAK_MEDIUM),
            ("slope", "speed-mismatch"),
            ("motor-lag",),
        ),
        World(
            "limit-marker-scale",
            "several",
            Setup(LARGE, Drive(acceleration_ms2=0.4), tracker=Tracker(scale=0.97, marker_x_m=-0.06)),
            (
                "each wheel's set speed changes by 0.4 m/s2 at most",
                "marker 0.06 m behind the axle's centre",
                "positions times 0.97",
            ),
            ("acceleration-limit", "marker-offset", "camera-scale"),
        ),
        World(
            "lag-wheelbase-zone",
            "several",
            Setup(MEDIUM, Drive(lag_s=0.15, dead_zone_ms=0.04), tracker=Tracker(correlation=0.6)),
            (
                "motor lag, time constant 0.15 s",
                "wheelbase is 0.25 m, the lab's model says 0.265 m",
                "a wheel stands while its command is below 0.04 m/s",
            ),
            ("motor-lag", "wheelbase", "dead-zone"),
            wheelbase_m=0.265,
        ),
    ]


def _unlisted() -> list[World]:
    """Effects of tyres, floor and controllers that are on no simple list."""
    slick, soft = Patch(0.1, 0.05, 0.3, friction=0.04), Patch(-0.1, 0.0, 0.25, rolling_nm=0.08)
    fast = replace(MEDIUM, top_speed_ms=1.0, tyre_friction=0.1)
    loaded = replace(weak(MEDIUM, 0.03), wheel_friction_nm=0.02, payload_kg=2.0)
    return [
        World(
            "slippery-patch",
            "unlisted",
            Setup(MEDIUM, ground=Ground(patch=slick)),
            ("inside 0.3 m of (0.1, 0.05) m the tyres' friction is 0.04 instead of 1.5",),
            ("floor-patch",),
        ),
        World(
            "soft-patch",
            "unlisted",
            Setup(weak(MEDIUM, 0.03), ground=Ground(patch=soft)),
            (
                "inside 0.25 m of (-0.1, 0) m the floor takes 0.08 N m from each wheel on it",
                "proportional controllers with a straight time constant of 0.03 s",
            ),
            ("floor-patch",),
            ("motor-lag", "dead-zone"),
        ),
        World(
            "tyre-slip",
            "unlisted",
            Setup(fast, Drive(acceleration_ms2=0.55)),
            (
                "tyres' friction is 0.1 at speeds up to 1 m/s: they slip sideways in fast turns",
                "each wheel's set speed changes by 0.55 m/s2 at most",
            ),
            ("sideways-slip", "acceleration-limit"),
        ),
        World(
            "two-lags",
            "unlisted",
            Setup(SMALL, Drive(lag_straight_s=0.25, lag_turning_s=0.06)),
            ("mean speed lags by 0.25 s, difference of the wheels by 0.06 s",),
            ("lag-straight-and-turning",),
            ("motor-lag",),
        ),
        World(
            "dead-band",
            "unlisted",
            Setup(loaded, Drive(dead_band_ms=0.02)),
            (
                "controllers give no torque while a wheel is within 0.02 m/s of its set speed",
                "payload 2 kg, friction of 0.02 N m in each wheel, straight time constant 0.03 s without payload",
            ),
            ("dead-band",),
            ("motor-lag", "dead-zone", "wheel-friction", "payload"),
        ),
        World(
            "rubbing-wheel",
            "unlisted",
            Setup(weak(SMALL), ground=Ground(rub_nm=0.003, rub_width_rad=1.5)),
            (
                "left wheel rubs with 0.003 N m over 1.5 rad of each turn, from any starting angle",
                "proportional controllers with a straight time constant of 0.04 s",
            ),
            ("wheel-rub",),
            ("wheel-eccentricity", "speed-mismatch", "motor-lag"),
        ),
        World(
            "obstacle",
            "unlisted",
            Setup(replace(MEDIUM, obstacle_height_m=0.03), ground=Ground(obstacle_trials=(7, 19, 23, 38, 44, 57))),
            (
                "a bar 0.03 m high, 0.25 m wide lies 0.16 to 0.19 m before or behind the axle in trials 7 19 23 38 44 57",
            ),
            ("collision",),
        ),
    ]
