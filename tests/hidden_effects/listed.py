"""The listed effects, written a second time. Names and parameters are the product's; all else is this benchmark's own."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.signal import lfilter

from tests.hidden_effects.cause import Body, Cause, Moment
from tests.hidden_effects.listed_braking import BrakingLag, BrakingLimit, BrakingRamp, LagMismatch
from tests.hidden_effects.listed_floor import (
    BASE_M,
    AffineDistortion,
    CarpetDrift,
    CasterDrag,
    CasterSwing,
    CasterTrail,
    FloorJoints,
    FloorPatch,
    FloorTiles,
    LensDistortion,
    QuadraticTurnSlip,
    TiltedCamera,
    UnevenPatch,
    WheelPatch,
)
from tests.hidden_effects.listed_loads import (
    ControllerOvershoot,
    ForceLimit,
    GearFriction,
    InertiaLag,
    MassOffset,
    ScrubFriction,
    SlidingContact,
    SlopeLoad,
    TetherLoad,
    TractionLimit,
    VelocityRamp,
)
from tests.hidden_effects.listed_motors import (
    Backlash,
    BacklashMismatch,
    BacklashStart,
    Breakaway,
    CommandQuantisation,
    CommandRate,
    CommandTimeout,
    CommandTruncation,
    DeadZoneMismatch,
    Heating,
    OverloadTrip,
    ReversalPause,
    ReverseGain,
    SpeedLimitMismatch,
    StartDelay,
    Stribeck,
    SupplySag,
    SupplyTrip,
    WarmUp,
    WheelEccentricity,
)


@dataclass
class SpeedGain(Cause):
    """Both wheels faster by a factor."""

    gain: float

    def command(self, wheels: np.ndarray) -> np.ndarray:
        return wheels * self.gain


@dataclass
class WheelMismatch(Cause):
    """The right wheel rolls `ratio` times as far as the left, the mean as before."""

    ratio: float

    def command(self, wheels: np.ndarray) -> np.ndarray:
        return wheels * (np.array([2.0, 2.0 * self.ratio]) / (1.0 + self.ratio))


@dataclass
class WheelDiameters(Cause):
    """As `WheelMismatch`, of what the motors have made of the command."""

    ratio: float

    def wheels(self, wheels: np.ndarray, moment: Moment) -> np.ndarray:
        return WheelMismatch(self.ratio).command(wheels)


@dataclass
class Wheelbase(Cause):
    """The wheels stand `factor` times as far apart."""

    factor: float

    def __post_init__(self) -> None:
        self.wheelbase = self.factor


@dataclass
class MotorLag(Cause):
    """First-order answer of each wheel: exact for a demand that is constant during a step."""

    tau_s: float

    def wheels(self, wheels: np.ndarray, moment: Moment) -> np.ndarray:
        decay = np.exp(-moment.step_s / self.tau_s)
        after = lfilter([1 - decay], [1, -decay], wheels, axis=1)
        before = np.concatenate([np.zeros_like(after[:, :1]), after[:, :-1]], axis=1)
        return wheels + (before - wheels) * (1 - decay) * self.tau_s / moment.step_s


@dataclass
class CommandDelay(Cause):
    """Commands act later than they are logged."""

    delay_s: float


@dataclass
class DeadZone(Cause):
    """The first `width_m_s` of a wheel's command are lost."""

    width_m_s: float

    def command(self, wheels: np.ndarray) -> np.ndarray:
        return np.sign(wheels) * np.maximum(np.abs(wheels) - self.width_m_s, 0.0)


@dataclass
class FrictionWarmUp(Cause):
    """The lost part of a command falls to its share of a warm robot as the session goes on."""

    width_m_s: float
    cold_m_s: float
    time_s: float

    def demand(self, wheels: np.ndarray, moment: Moment) -> np.ndarray:
        session = np.maximum(moment.session_s + moment.trial_s, 0.0)
        lost = (self.width_m_s + self.cold_m_s * np.exp(-session / self.time_s))[..., None]
        return np.where(wheels > 0, np.maximum(wheels - lost, 0.0), np.minimum(wheels + lost, 0.0))


@dataclass
class DeadBand(Cause):
    """A wheel stands while its command is below this."""

    threshold_m_s: float

    def command(self, wheels: np.ndarray) -> np.ndarray:
        return np.where(np.abs(wheels) < self.threshold_m_s, 0.0, wheels)


@dataclass
class SpeedLimit(Cause):
    """No wheel is faster than this."""

    max_m_s: float

    def command(self, wheels: np.ndarray) -> np.ndarray:
        return np.clip(wheels, -self.max_m_s, self.max_m_s)


@dataclass
class SpeedScaling(Cause):
    """No wheel is faster than this; forward velocity and turn rate are divided by how much the faster one would exceed it."""

    max_m_s: float

    def command(self, wheels: np.ndarray) -> np.ndarray:
        forward, half = wheels.sum(axis=-1) / 2, (wheels[..., 1] - wheels[..., 0]) / 2
        exceeded = np.maximum((np.abs(forward) + np.abs(half)) / self.max_m_s, 1.0)
        return np.stack([forward / exceeded - half / exceeded, forward / exceeded + half / exceeded], axis=-1)


@dataclass
class AccelerationLimit(Cause):
    """No wheel changes its speed faster than this."""

    max_m_s2: float

    def wheels(self, wheels: np.ndarray, moment: Moment) -> np.ndarray:
        most = self.max_m_s2 * moment.step_s
        out, now = np.empty_like(wheels), np.zeros_like(wheels[:, 0])
        for i in range(wheels.shape[1]):
            then = now + np.clip(wheels[:, i] - now, -most, most)
            out[:, i] = (now + then) / 2
            now = then
        return out


@dataclass
class TurnDeadZone(Cause):
    """Scrubbing takes the same turn rate from every turn: what is left of a slower one is nothing."""

    width_rad_s: float

    def body(self, body: Body, moment: Moment) -> Body:
        return body._replace(turn=body.turn - np.clip(body.turn, -self.width_rad_s, self.width_rad_s))


@dataclass
class TurnSlip(Cause):
    """Turning costs forward speed."""

    slip_s: float

    def body(self, body: Body, moment: Moment) -> Body:
        return body._replace(forward=body.forward * (1 - self.slip_s * np.abs(body.turn)))


@dataclass
class PivotSlip(Cause):
    """Turns lose most on the spot, and less the less the inner wheel runs backwards."""

    loss: float

    def body(self, body: Body, moment: Moment) -> Body:
        sides = np.sort(np.stack([body.forward - body.turn * BASE_M / 2, body.forward + body.turn * BASE_M / 2]), axis=0)
        outer, inner = np.abs(sides).max(axis=0), np.abs(sides).min(axis=0)
        opposite = (sides[0] < 0) & (sides[1] > 0)
        return body._replace(turn=body.turn * (1 - self.loss * np.where(opposite, inner / np.where(outer > 0, outer, 1.0), 0.0)))


@dataclass
class TurnAsymmetry(Cause):
    """Left turns are so much larger, right ones so much smaller: the two are told apart by their sign."""

    share: float

    def body(self, body: Body, moment: Moment) -> Body:
        return body._replace(turn=body.turn * np.where(body.turn > 0, 1 + self.share, 1 - self.share))


@dataclass
class SideSlip(Cause):
    """Drifts out of the curve: to the right in a left turn."""

    slip_s: float

    def body(self, body: Body, moment: Moment) -> Body:
        return body._replace(right=body.right + self.slip_s * body.forward * body.turn)


@dataclass
class BatterySag(Cause):
    """Speeds fall by the same share of the first speed every second of the session."""

    rate_per_s: float

    def demand(self, wheels: np.ndarray, moment: Moment) -> np.ndarray:
        session = np.maximum(moment.session_s + moment.trial_s, 0.0)
        return wheels * (1 - self.rate_per_s * session)[..., None]


BATTERY_V, BATTERY_DROP_V, BATTERY_TIME_S = 8.0, 0.9, 500.0


def voltage(session_s: np.ndarray) -> np.ndarray:
    """A battery that falls fast at first: not a straight line in time."""
    return BATTERY_V - BATTERY_DROP_V * (1 - np.exp(-np.maximum(session_s, 0.0) / BATTERY_TIME_S))


@dataclass
class BatterySagByVolt(Cause):
    """Speeds times 1 + per_volt (V - V of the session's first row)."""

    per_volt: float

    def demand(self, wheels: np.ndarray, moment: Moment) -> np.ndarray:
        drop = voltage(moment.session_s + moment.trial_s) - BATTERY_V
        return wheels * (1 + self.per_volt * drop)[..., None]


@dataclass
class FloorSlope(Cause):
    """A constant velocity in the world while a wheel turns."""

    x_m_s: float
    y_m_s: float

    def body(self, body: Body, moment: Moment) -> Body:
        return body._replace(
            east=body.east + self.x_m_s * body.moving, north=body.north + self.y_m_s * body.moving
        )


@dataclass
class YawBias(Cause):
    """A constant turn while a wheel turns."""

    rate_rad_s: float

    def body(self, body: Body, moment: Moment) -> Body:
        return body._replace(turn=body.turn + self.rate_rad_s * body.moving)


@dataclass
class TetherPull(Cause):
    """A velocity towards the anchor, in proportion to the distance, while a wheel turns."""

    anchor_x_m: float
    anchor_y_m: float
    pull_per_s: float
    depends_on_pose = True

    def place(self, body: Body, x: np.ndarray, y: np.ndarray, heading: np.ndarray) -> Body:
        pull = self.pull_per_s * body.moving
        return body._replace(
            east=body.east + pull * (self.anchor_x_m - x), north=body.north + pull * (self.anchor_y_m - y)
        )


@dataclass
class ClockOffset(Cause):
    """Poses are stamped late: one stamped t was taken at t - offset_s."""

    offset_s: float

    def __post_init__(self) -> None:
        self.late_s = self.offset_s


@dataclass
class HeadingDelay(Cause):
    """Headings of poses are from delay_s before their positions."""

    delay_s: float

    def __post_init__(self) -> None:
        self.heading_late_s, self.delay_s = self.delay_s, 0.0  # delay_s of a cause is that of commands


@dataclass
class MarkerOffset(Cause):
    """The marker is not above the axle's centre."""

    forward_m: float
    left_m: float

    def seen(self, poses: np.ndarray) -> np.ndarray:
        x, y, heading = np.moveaxis(poses, -1, 0)
        cos, sin = np.cos(heading), np.sin(heading)
        return np.stack(
            [x + self.forward_m * cos - self.left_m * sin, y + self.forward_m * sin + self.left_m * cos, heading], -1
        )


@dataclass
class CameraScale(Cause):
    """Tracked positions stretched about the origin."""

    factor: float

    def seen(self, poses: np.ndarray) -> np.ndarray:
        return poses * np.array([self.factor, self.factor, 1.0])


@dataclass
class CameraRotation(Cause):
    """Tracked positions turned about the origin, counter-clockwise; headings as they are."""

    angle_rad: float

    def seen(self, poses: np.ndarray) -> np.ndarray:
        x, y, heading = np.moveaxis(poses, -1, 0)
        cos, sin = np.cos(self.angle_rad), np.sin(self.angle_rad)
        return np.stack([x * cos - y * sin, x * sin + y * cos, heading], -1)


@dataclass
class CompassDeviation(Cause):
    """The needle follows the sum of two fields; headings go on where they were, whole turns included."""

    cosine_share: float
    sine_share: float

    def seen(self, poses: np.ndarray) -> np.ndarray:
        really = np.exp(1j * poses[..., 2])
        needle = really + complex(self.cosine_share, self.sine_share)
        return np.concatenate([poses[..., :2], (poses[..., 2] + np.angle(needle / really))[..., None]], axis=-1)


LISTED: dict[str, type[Cause]] = {
    "command-quantisation": CommandQuantisation,
    "command-truncation": CommandTruncation,
    "command-rate": CommandRate,
    "command-delay": CommandDelay,
    "dead-zone": DeadZone,
    "stribeck": Stribeck,
    "dead-band": DeadBand,
    "warm-up": WarmUp,
    "speed-gain": SpeedGain,
    "reverse-gain": ReverseGain,
    "dead-zone-mismatch": DeadZoneMismatch,
    "speed-limit-mismatch": SpeedLimitMismatch,
    "wheel-mismatch": WheelMismatch,
    "speed-limit": SpeedLimit,
    "speed-scaling": SpeedScaling,
    "breakaway": Breakaway,
    "carpet-drift": CarpetDrift,
    "command-timeout": CommandTimeout,
    "overload-trip": OverloadTrip,
    "supply-trip": SupplyTrip,
    "reversal-pause": ReversalPause,
    "start-delay": StartDelay,
    "battery-sag": BatterySag,
    "supply-sag": SupplySag,
    "motor-lag": MotorLag,
    "acceleration-limit": AccelerationLimit,
    "force-limit": ForceLimit,
    "braking-limit": BrakingLimit,
    "velocity-ramp": VelocityRamp,
    "braking-ramp": BrakingRamp,
    "inertia-lag": InertiaLag,
    "lag-mismatch": LagMismatch,
    "braking-lag": BrakingLag,
    "gear-friction": GearFriction,
    "scrub-friction": ScrubFriction,
    "sliding-contact": SlidingContact,
    "controller-overshoot": ControllerOvershoot,
    "traction-limit": TractionLimit,
    "heating": Heating,
    "wheel-diameters": WheelDiameters,
    "wheel-eccentricity": WheelEccentricity,
    "backlash": Backlash,
    "backlash-mismatch": BacklashMismatch,
    "backlash-start": BacklashStart,
    "caster-swing": CasterSwing,
    "caster-trail": CasterTrail,
    "caster-drag": CasterDrag,
    "wheelbase": Wheelbase,
    "yaw-bias": YawBias,
    "turn-dead-zone": TurnDeadZone,
    "friction-warm-up": FrictionWarmUp,
    "turn-asymmetry": TurnAsymmetry,
    "pivot-slip": PivotSlip,
    "turn-slip": TurnSlip,
    "turn-slip-quadratic": QuadraticTurnSlip,
    "side-slip": SideSlip,
    "mass-offset": MassOffset,
    "floor-patch": FloorPatch,
    "wheel-patch": WheelPatch,
    "uneven-patch": UnevenPatch,
    "floor-joints": FloorJoints,
    "floor-tiles": FloorTiles,
    "slope-load": SlopeLoad,
    "tether-load": TetherLoad,
    "floor-slope": FloorSlope,
    "tether-pull": TetherPull,
    "marker-offset": MarkerOffset,
    "tilted-camera": TiltedCamera,
    "lens-distortion": LensDistortion,
    "affine-distortion": AffineDistortion,
    "camera-scale": CameraScale,
    "camera-rotation": CameraRotation,
    "compass-deviation": CompassDeviation,
    "clock-offset": ClockOffset,
    "heading-delay": HeadingDelay,
}
"""In the order in which they act when two of them act on the same thing."""


def cause(name: str, parameters: dict[str, float]) -> Cause:
    """The effect of that name; battery-sag takes its law from its parameter."""
    kind = BatterySagByVolt if "per_volt" in parameters else LISTED[name]
    return kind(**parameters)
