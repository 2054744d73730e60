"""Listed effects of floors, casters and cameras, written a second time."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from tests.hidden_effects.cause import Body, Cause, Moment

NEAR_M = 1e-4
"""Two points of the robot, so far apart, show where a picture says that it heads."""
BASE_M = 0.0884
FINE = 4
SLOW_RAD_S = 0.1
"""Of the robot (Khepera III), m; parts of a step; below this rate a hinge's dry friction fades."""


@dataclass
class FloorPatch(Cause):
    """A round patch of floor, its rim sharp, on which the robot is slower."""

    x_m: float
    y_m: float
    radius_m: float
    loss: float
    depends_on_pose = True

    def place(self, body: Body, x: np.ndarray, y: np.ndarray, heading: np.ndarray) -> Body:
        share = 1 - self.loss * (np.hypot(x - self.x_m, y - self.y_m) < self.radius_m)
        return body._replace(forward=body.forward * share, turn=body.turn * share)


@dataclass
class CarpetDrift(Cause):
    """A carpet that moves like a slow belt while the robot drives, forwards or backwards, and stands while it turns."""

    x_share: float
    y_share: float

    def body(self, body: Body, moment: Moment) -> Body:
        driven = np.sqrt(body.forward**2)
        return body._replace(east=body.east + driven * self.x_share, north=body.north + driven * self.y_share)


@dataclass
class WheelPatch(FloorPatch):
    """The same, slowing a wheel where it is itself; a complex number points from the robot's centre to its left wheel."""

    apart_share: float = 1.0

    def place(self, body: Body, x: np.ndarray, y: np.ndarray, heading: np.ndarray) -> Body:
        return self.slowed(body, x, y, heading, (self.loss, self.loss))

    def slowed(self, body: Body, x: np.ndarray, y: np.ndarray, heading: np.ndarray, losses: tuple[float, float]) -> Body:
        """With a loss for each wheel."""
        here, to_left = x + 1j * y - (self.x_m + 1j * self.y_m), 0.5j * BASE_M * np.exp(1j * heading)
        within = [np.abs(here + s * self.apart_share * to_left) < self.radius_m for s in (1, -1)]
        left, right = (1 - loss * inside for loss, inside in zip(losses, within, strict=True))
        rolled = left * (body.forward - body.turn * BASE_M / 2), right * (body.forward + body.turn * BASE_M / 2)
        return body._replace(forward=sum(rolled) / 2, turn=(rolled[1] - rolled[0]) / BASE_M)


@dataclass
class UnevenPatch(WheelPatch):
    """The same; one wheel loses more than the other, and the mean of both losses is given."""

    left_share: float = 1.0

    def place(self, body: Body, x: np.ndarray, y: np.ndarray, heading: np.ndarray) -> Body:
        left = self.loss * self.left_share
        return self.slowed(body, x, y, heading, (left, 2 * self.loss - left))


@dataclass
class FloorJoints(Cause):
    """Strips of the floor, one at each joint, on which a wheel gets a part of its way only; it loses the same at any angle."""

    spacing_m: float
    across_rad: float
    at_m: float
    loss_m: float
    over_m: float
    depends_on_pose = True

    def place(self, body: Body, x: np.ndarray, y: np.ndarray, heading: np.ndarray) -> Body:
        return self.held(body, x + 1j * y, heading, [(np.exp(1j * self.across_rad), self.at_m, self.loss_m)])

    def held(self, body: Body, here: np.ndarray, heading: np.ndarray, rows: list[tuple[complex, float, float]]) -> Body:
        """With the joints of several rows: direction across, where one lies, and what is lost there."""
        ahead, sides = np.exp(1j * heading), []
        for side in (1, -1):
            wheel, more = here + side * 0.5j * BASE_M * ahead, 0.0
            for across, at, loss in rows:
                off = (wheel * np.conj(across)).real - at
                near = np.abs(off - self.spacing_m * np.floor(off / self.spacing_m + 0.5)) < self.over_m / 2
                more = more + near * loss / self.over_m * np.abs((ahead * np.conj(across)).real)
            sides.append((body.forward - side * body.turn * BASE_M / 2) / (1 + more))
        return body._replace(forward=sum(sides) / 2, turn=(sides[1] - sides[0]) / BASE_M)


@dataclass
class FloorTiles(FloorJoints):
    """The same with a second row of joints across the first."""

    second_at_m: float = 0.0
    second_share: float = 0.0

    def place(self, body: Body, x: np.ndarray, y: np.ndarray, heading: np.ndarray) -> Body:
        first = np.exp(1j * self.across_rad)
        rows = [(first, self.at_m, self.loss_m), (1j * first, self.second_at_m, self.second_share * self.loss_m)]
        return self.held(body, x + 1j * y, heading, rows)


@dataclass
class QuadraticTurnSlip(Cause):
    """Turning costs forward speed, with the square of the turn rate."""

    slip_s2: float

    def body(self, body: Body, moment: Moment) -> Body:
        return body._replace(forward=body.forward * np.maximum(1 - self.slip_s2 * body.turn * body.turn, 0.0))


@dataclass
class CasterSwing(Cause):
    """A caster half a wheelbase ahead drags while it points another way than its pivot moves; it turns with the way."""

    loss: float
    trail_m: float

    def wheels(self, wheels: np.ndarray, moment: Moment) -> np.ndarray:
        pivot = wheels.mean(axis=2) + 0.5j * (wheels[..., 1] - wheels[..., 0])
        caster, out = np.zeros(len(wheels)), np.empty_like(wheels)
        for i in range(wheels.shape[1]):
            speed = np.abs(pivot[:, i])
            off = np.angle(pivot[:, i] * np.exp(-1j * caster))
            off = np.where(speed > 1e-3, off, 0.0)
            out[:, i] = wheels[:, i] * (1 - self.loss * np.sin(off / 2) ** 2)[:, None]
            caster = caster + off * np.minimum(speed * moment.step_s / self.trail_m, 1.0)
        return out


@dataclass
class CasterTrail(Cause):
    """A caster drags while it points another way than its hinge moves, ``pivot_m`` ahead of the axle or behind it; it trails."""

    loss: float
    trail_m: float
    pivot_m: float

    def wheels(self, wheels: np.ndarray, moment: Moment) -> np.ndarray:
        yaw = (wheels[..., 1] - wheels[..., 0]) / BASE_M
        pivot = wheels.mean(axis=2) + 1j * self.pivot_m * yaw
        caster, out = np.zeros(len(wheels)), np.empty_like(wheels)
        for i in range(wheels.shape[1]):
            speed = np.abs(pivot[:, i])
            turn = np.where(speed > 1e-3, yaw[:, i], 0.0)
            kept = 0.0
            for _ in range(FINE):
                off = np.where(speed > 1e-3, np.angle(pivot[:, i] * np.exp(-1j * caster)), 0.0)
                upright = np.abs(off) > np.pi - 0.01  # no floor is so even that it stays so: it has fallen by half a degree
                off = np.where(upright, np.copysign(np.pi - 0.01, off), off)
                caster = np.where(upright, np.angle(pivot[:, i]) - off, caster)
                left = 1 - self.loss * np.sin(off / 2) ** 2
                kept = kept + left / FINE
                caster = caster + left * (speed * np.sin(off) / self.trail_m - turn) * moment.step_s / FINE
            out[:, i] = wheels[:, i] * kept[:, None]
        return out


@dataclass
class CasterDrag(Cause):
    """A caster's hinge that resists: its angle in small steps, the mean of eight robots whose casters point all ways at first."""

    friction_m_s: float
    damping_m: float
    trail_m: float
    pivot_m: float

    def body(self, body: Body, moment: Moment) -> Body:
        angle = np.linspace(0, 2 * np.pi, 8, endpoint=False) * np.ones((len(body.forward), 1))
        forward, turn = np.array(body.forward), np.array(body.turn)
        for i in range(forward.shape[1]):
            v, w = body.forward[:, i, None], body.turn[:, i, None]
            push, twist = 0.0, 0.0
            for _ in range(FINE):
                hinge = np.stack([v + 0 * angle, w * self.pivot_m + 0 * angle])  # velocity of the hinge, ahead and left
                across = hinge[1] * np.cos(angle) - hinge[0] * np.sin(angle)
                rate = across / self.trail_m - w
                torque = self.friction_m_s * rate / (np.abs(rate) + SLOW_RAD_S) + self.damping_m * rate
                push = push + (torque * np.sin(angle)).mean(axis=1) / FINE
                twist = twist + (torque * (self.trail_m - self.pivot_m * np.cos(angle))).mean(axis=1) / FINE
                angle = angle + rate * moment.step_s / FINE
            forward[:, i] += push
            turn[:, i] += twist / (BASE_M / 2) ** 2
        return body._replace(forward=forward, turn=turn)


class Picture(Cause):
    """A camera's picture of the floor: places and, by a second point a little ahead, headings."""

    def pictured(self, places: np.ndarray) -> np.ndarray:
        """Places (..., 2) as the picture shows them."""
        raise NotImplementedError

    def seen(self, poses: np.ndarray) -> np.ndarray:
        heading = poses[..., 2]
        ahead = poses[..., :2] + NEAR_M * np.stack([np.cos(heading), np.sin(heading)], axis=-1)
        here, there = self.pictured(poses[..., :2]), self.pictured(ahead)
        shown = np.arctan2(there[..., 1] - here[..., 1], there[..., 0] - here[..., 0])
        nearest = heading + np.angle(np.exp(1j * (shown - heading)))
        return np.concatenate([here, nearest[..., None]], axis=-1)


@dataclass
class TiltedCamera(Picture):
    """A plane seen at a slant: homogeneous coordinates whose third is no longer one."""

    x_per_m: float
    y_per_m: float

    def pictured(self, places: np.ndarray) -> np.ndarray:
        homography = np.array([[1, 0, 0], [0, 1, 0], [self.x_per_m, self.y_per_m, 1]])
        shown = np.concatenate([places, np.ones_like(places[..., :1])], axis=-1) @ homography.T
        return shown[..., :2] / shown[..., 2:]


@dataclass
class LensDistortion(Picture):
    """Radial, of third order, about a centre."""

    per_m2: float
    x_m: float
    y_m: float

    def pictured(self, places: np.ndarray) -> np.ndarray:
        centre = np.array([self.x_m, self.y_m])
        radius = np.linalg.norm(places - centre, axis=-1, keepdims=True)
        return centre + (places - centre) * (1 + self.per_m2 * radius**2)


@dataclass
class AffineDistortion(Picture):
    """Two stretches, each along its own axis: one along x and y, one along the diagonals."""

    stretch: float
    shear: float

    def pictured(self, places: np.ndarray) -> np.ndarray:
        longest = np.array([self.stretch, self.shear])
        size, angle = np.linalg.norm(longest), np.arctan2(self.shear, self.stretch) / 2
        axis = np.array([np.cos(angle), np.sin(angle)])
        along = (places @ axis)[..., None] * axis
        return places + size * (along - (places - along))
