"""Effects that no list holds: the right answer to each is that something unlisted is going on.

Chosen so that no set of listed effects gives the same poses. (One dead wheel, say, is dead-zone with yaw-bias as long as
both wheels turn forward; its worlds therefore reverse and spin.)
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.signal import lfilter

from tests.hidden_effects.cause import Body, Cause, Moment
from tests.hidden_effects.unlisted_motors import MOTORS


@dataclass
class QuadraticGain(Cause):
    """Speed rises faster than its command."""

    share: float
    fastest_m_s: float

    def command(self, wheels: np.ndarray) -> np.ndarray:
        return wheels * (1 + self.share * np.abs(wheels) / self.fastest_m_s)


@dataclass
class LeftTurnSlip(Cause):
    """Turning costs forward speed in left turns alone."""

    slip_s: float

    def body(self, body: Body, moment: Moment) -> Body:
        return body._replace(forward=body.forward * (1 - self.slip_s * np.maximum(body.turn, 0.0)))


@dataclass
class LeftDeadZone(Cause):
    """The left wheel alone loses the first part of its command."""

    width_m_s: float

    def command(self, wheels: np.ndarray) -> np.ndarray:
        left = np.sign(wheels[..., 0]) * np.maximum(np.abs(wheels[..., 0]) - self.width_m_s, 0.0)
        return np.stack([left, wheels[..., 1]], axis=-1)


@dataclass
class HeadingWalk(Cause):
    """The turn wanders about what was commanded, slowly and at random."""

    spread_rad_s: float
    time_s: float

    def body(self, body: Body, moment: Moment) -> Body:
        decay = np.exp(-moment.step_s / self.time_s)
        kicks = moment.rng.normal(0, self.spread_rad_s * np.sqrt(1 - decay**2), body.turn.shape)
        kicks[:, 0] = moment.rng.normal(0, self.spread_rad_s, len(kicks))
        return body._replace(turn=body.turn + body.moving * lfilter([1], [1, -decay], kicks, axis=1))


@dataclass
class SessionDrag(Cause):
    """Slower in the middle of the session, and as fast as ever at its end."""

    loss: float
    middle_s: float
    width_s: float

    def demand(self, wheels: np.ndarray, moment: Moment) -> np.ndarray:
        away = (moment.session_s + moment.trial_s - self.middle_s) / self.width_s
        return wheels * (1 - self.loss * np.exp(-(away**2)))[..., None]


@dataclass
class Whirl(Cause):
    """A field that pushes round a point, weaker further off: no tether, which pulls towards it."""

    x_m: float
    y_m: float
    speed_m_s: float
    reach_m: float
    depends_on_pose = True

    def place(self, body: Body, x: np.ndarray, y: np.ndarray, heading: np.ndarray) -> Body:
        east, north = x - self.x_m, y - self.y_m
        push = body.moving * self.speed_m_s * 2 * self.reach_m / (self.reach_m**2 + east**2 + north**2)
        return body._replace(east=body.east - push * north, north=body.north + push * east)


@dataclass
class CarpetNap(Cause):
    """The nap of the carpet: slower against it, faster along it."""

    share: float
    along_rad: float
    depends_on_pose = True

    def place(self, body: Body, x: np.ndarray, y: np.ndarray, heading: np.ndarray) -> Body:
        return body._replace(forward=body.forward * (1 + self.share * np.cos(heading - self.along_rad)))


@dataclass
class Seam(Cause):
    """A seam of the floor along a line turns a robot that crosses it to the left."""

    x_m: float
    width_m: float
    turn_rad_m: float
    depends_on_pose = True

    def place(self, body: Body, x: np.ndarray, y: np.ndarray, heading: np.ndarray) -> Body:
        bump = self.turn_rad_m * np.exp(-(((x - self.x_m) / self.width_m) ** 2))
        return body._replace(turn=body.turn + bump * np.abs(body.forward))


@dataclass
class ReverseLoss(Cause):
    """Wheels are slower backward."""

    loss: float

    def command(self, wheels: np.ndarray) -> np.ndarray:
        return np.where(wheels < 0, wheels * (1 - self.loss), wheels)


@dataclass
class Swing(Cause):
    """The turn swings with a period of its own, whenever the robot moves."""

    rate_rad_s: float
    period_s: float

    def body(self, body: Body, moment: Moment) -> Body:
        phase = 2 * np.pi * (moment.session_s + moment.trial_s) / self.period_s
        return body._replace(turn=body.turn + body.moving * self.rate_rad_s * np.sin(phase))


@dataclass
class Kicks(Cause):
    """Now and then something turns the robot at once, to either side."""

    rate_per_s: float
    turn_rad: float

    def body(self, body: Body, moment: Moment) -> Body:
        now = body.moving * (moment.rng.random(body.turn.shape) < self.rate_per_s * moment.step_s)
        side = moment.rng.choice([-1.0, 1.0], body.turn.shape)
        return body._replace(turn=body.turn + now * side * self.turn_rad / moment.step_s)


UNLISTED: dict[str, type[Cause]] = {
    "quadratic-gain": QuadraticGain,
    "left-turn-slip": LeftTurnSlip,
    "left-dead-zone": LeftDeadZone,
    "heading-walk": HeadingWalk,
    "session-drag": SessionDrag,
    "whirl": Whirl,
    "carpet-nap": CarpetNap,
    "seam": Seam,
    "reverse-loss": ReverseLoss,
    "swing": Swing,
    "kicks": Kicks,
    **MOTORS,
}
