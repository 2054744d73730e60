"""One drive of the snake: servos armed, body straightened, cycles gone through posture by posture, all of it watched."""

from __future__ import annotations

import math

import numpy as np

from bns.errors import TrialPausedError
from bns.hardware.agreement import SameScene
from bns.hardware.clock import Clock
from bns.hardware.leaps import Leaps
from bns.hardware.link.hardware_log import HardwareLog
from bns.hardware.safety import Limits, OutOfSight, Watch
from bns.hardware.servos.servo_chain import ServoChain, StrainWatch, StuckServoError
from bns.hardware.servos.shape import apart_m
from bns.hardware.servos.snake_settings import SnakeSettings
from bns.hardware.tracking.eye import SAME_M, Eye
from bns.hardware.tracking.sight import Sight
from bns.physics.snake.gait import PARAMETERS, cycle_angles
from bns.physics.snake.parameters import shipped_parameters

_TICK_S, _SUSPECTS_S = 0.15, 0.03
"""Between looks; and while the camera sends a picture again."""
_STRAIGHTENING_RAD_S = 0.5
_STILL_M = 0.002
_FROZEN_RAD, _FROZEN_RAD_LATE = 0.5, 0.65
"""Joints between the markers that turn so far move a marker by that: after 0.35 rad at most in 182 drives of the model, seen by
five pictures a second. A camera that may be late is believed for longer. Joints beyond them do not count: an end of the body
that swings by 1 rad moves neither."""
_FROZEN_M, _FROZEN_M_LATE = 0.008, 0.012
"""Markers that the joints bring so much nearer, or further apart, are seen to move: after 3 mm at most in the same drives."""
_COPIED_RAD, _DELAYS = 0.05, 5
"""Joints between the markers that turn so far move a marker by more than `SAME_M`; of so many delays that a camera may have."""
_NEAREST_M = 0.01
_SPRUNG_RAD = 0.2
"""A joint that turned by so much more than its servo can had been held by the body and was let go."""
_READINGS = 32
UNKNOWN_S, KNOWN_S = 0.2, 0.02
"""So late a camera may be whose delay was not measured (slow ones are 0.16 s), and one whose delay was."""
_MARKERS = ("yellow", "green")
_PLACES = ("yellow_x_m", "yellow_y_m", "green_x_m", "green_y_m")
_NOTHING = dict.fromkeys(("cycle", *PARAMETERS, "stable"), math.nan)


class SnakeDrive:
    """Rows and observations are gathered as it goes on. A cycle that ends out of sight counts as unstable: a robot on its back
    hides its markers. So does one that ends with a servo stuck: links that press against each other hold it;
    and one in which the robot is seen to leap further than it can move.

    `unknown_s`: so much before its stamp a picture may have been taken.
    """

    def __init__(
        self,
        chain: ServoChain,
        eye: Eye,
        watch: Watch,
        settings: SnakeSettings,
        clock: Clock,
        journal: HardwareLog,
        unknown_s: float = UNKNOWN_S,
        disagree_s: float = Limits.disagree_s,
    ) -> None:
        self._unknown_s, known = unknown_s, unknown_s <= KNOWN_S
        self._frozen_rad, self._frozen_m = (_FROZEN_RAD, _FROZEN_M) if known else (_FROZEN_RAD_LATE, _FROZEN_M_LATE)
        self._chain, self._eye, self._watch, self._settings = chain, eye, watch, settings
        self._clock, self._journal = clock, journal
        self._strain = StrainWatch(settings.limits)
        self._scene, self._turned_rad = SameScene(_STILL_M), 0.0
        self._parameters = shipped_parameters()
        self._between = self._parameters.joints_between_markers
        self.leaps, self._disagree_s = Leaps(), disagree_s
        # A joint at one end that turns as fast as it may swings the body about it, and the middle of the markers at half their
        # distance: at 0.49 m/s with the shipped rig. In twelve drives of the model it moved at 0.42 m/s at most; a robot that
        # rolls over is faster than half of that. About one another the markers move at twice that speed: their direction turned
        # at 0.93 of what follows, at most, in eight drives of three random cycles each.
        self._fastest_m_s = settings.joint_speed_rad_s * self._parameters.marker_gap_m / 2.0
        self._shape, self._apart = SameScene(_STILL_M), list[tuple[float, float]]()
        """When the joints were read, and how far apart the markers are by them, m; since the last one that sprang."""
        self._shown: tuple[float, float] | None = None
        """Least and greatest distance, by the joints, of the markers in the scene that the picture shows."""
        self._copy, self._turns = SameScene(SAME_M), list[tuple[float, float]]()
        """When the joints were read, and how far they had turned by then."""
        self._first_s, self._came_s, self._repeats = 0.0, 0.0, False
        self._copied_s: float | None = None
        """When a picture came that the camera has sent again since, while the joints turned."""
        self._joints_rad: np.ndarray | None = None
        self._read_s = 0.0
        self._angles = np.zeros(len(settings.ids))
        self._markers = np.full(4, math.nan)
        self._began_s = 0.0
        self._cycles: list[np.ndarray] = []
        self._seen: list[tuple[float, np.ndarray]] = []
        self._observed: list[tuple[float, float, float]] = []
        self.rows: list[dict[str, float]] = []
        self.spans_s: list[tuple[float, float]] = []
        """When each cycle began and ended, by the trial's clock."""

    def done(self) -> np.ndarray:
        """Cycles carried out (k, 5)."""
        return np.array(self._cycles, np.float32).reshape(-1, 5)

    def observed(self) -> np.ndarray:
        """(k + 1, 9): the markers at the start, then at the begin and end of each cycle, and whether it was stable."""
        if not self._seen:
            return np.empty((0, 9))
        start = self._seen[0][1]
        cycles = [np.concatenate([self._at(a), self._at(b), [stable]]) for a, b, stable in self._observed]
        return np.array([np.concatenate([start, start, [1.0]]), *cycles])

    def _at(self, t_s: float) -> np.ndarray:
        """The markers (4,) then: between the two times around it at which they were filmed."""
        times, places = np.array([t for t, _ in self._seen]), np.array([place for _, place in self._seen])
        return np.array([np.interp(t_s, times, column) for column in places.T])

    def finish(self) -> None:
        """The last posture is held until it has been filmed."""
        while self._observed and self._seen[-1][0] < self._observed[-1][1]:
            self._clock.sleep(_TICK_S / 2)
            self._look()

    def straighten(self) -> None:
        """Torque on, slowly straight; where the markers are then is where the drive starts."""
        self._chain.arm(self._glance)
        here = np.array([health.position_rad for health in self._chain.health().values()])
        self._go_to(np.zeros(len(here)), float(np.abs(here).max()), _STRAIGHTENING_RAD_S)
        start = self._eye.standing(self._still_held)
        if start is None:
            raise TrialPausedError("the camera does not see both markers: are they lit, on top, in its picture? Try: bns track")
        self._watch.begin()
        self._began_s = self._clock.now_s()
        self._markers = np.concatenate([start.points[name] for name in _MARKERS])
        self.rows = [self._row(self._began_s)]
        self._seen = [(self._began_s, self._markers)]
        self._reached(self._began_s)

    def carry_out(self, cycle: np.ndarray) -> None:
        """One cycle: up to its first posture, then through it; ServoError, DriveEnded, TrialPausedError."""
        angles, began_s = cycle_angles(cycle[:4], len(self._angles)), self._clock.now_s()
        commanded = dict(zip(PARAMETERS, cycle[:4].tolist(), strict=True))
        self._journal.note("command", **commanded)
        first, leapt = len(self.rows), self.leaps.count
        self.rows[-1] |= {"cycle": float(len(self._cycles) + 1), **commanded}
        self._strain.stalled, before_s = False, began_s
        try:
            self._posture(angles[0])
            before_s = self._in_sight()
            for target in angles[1:]:
                self._posture(target)
            after_s, stable = self._in_sight(), not self._strain.stalled and self.leaps.count == leapt
            self._chain.check_torque()
        except (OutOfSight, StuckServoError):
            self._over(cycle, (before_s, self._clock.now_s()), False, began_s, first)
            raise
        finally:
            self.rows[-1] |= dict.fromkeys(("cycle", *PARAMETERS), math.nan)  # nothing is in force any more
        self._over(cycle, (before_s, after_s), stable, began_s, first)

    def _over(self, cycle: np.ndarray, between_s: tuple[float, float], stable: bool, began_s: float, first: int) -> None:
        self._cycles.append(cycle)
        self._observed.append((*between_s, float(stable)))
        self.spans_s.append((began_s, self._clock.now_s()))
        for row in self.rows[first:]:
            row["stable"] = float(stable)

    def _posture(self, target: np.ndarray) -> None:
        self._go_to(target, float(np.abs(target - self._angles).max()), self._settings.joint_speed_rad_s)

    def _go_to(self, target: np.ndarray, way_rad: float, speed_rad_s: float) -> None:
        """Every joint at the same speed until the one with the longest way is there, and a pause."""
        asked_s = self._clock.now_s()
        sent = np.array(self._chain.move(target.tolist(), [speed_rad_s] * len(target)))
        short = int(np.argmax(np.abs(sent - target)))
        if abs(sent[short] - target[short]) > 1.5 * self._chain.step_rad:
            raise TrialPausedError(
                f"joint {short + 1} should go to {math.degrees(target[short]):.0f}°, but the command was "
                f"clipped to {math.degrees(sent[short]):.0f}°: widen the angle limits in its servo"
            )
        self._angles, end_s, looked = target, asked_s + way_rad / speed_rad_s + self._settings.settle_s, False
        while (left_s := end_s - self._clock.now_s()) > 0 or not looked:  # a slow adapter leaves no time, and is looked at too
            newest_s = self._eye.picture_s if self._copied_s is None else self._copied_s
            tick_s = _SUSPECTS_S if self._repeats else _TICK_S
            self._clock.sleep(self._watch.next_look_s(min(tick_s, max(left_s, 0.0)), newest_s))
            self._look()
            looked = True

    def _look(self) -> Sight | None:
        """Look at servos and markers; a row if there is something new to see."""
        asked_s = self._clock.now_s()
        healths = self._chain.health()
        self._strain.look(healths, self._clock.now_s())
        self._read((asked_s + self._clock.now_s()) / 2.0, np.array([health.position_rad for health in healths.values()]))
        sight = self._eye.look()
        if sight is not None:
            self._markers = np.concatenate([sight.points[name] for name in _MARKERS])
            self._reach(sight.t_s)
            self._follow(sight.t_s)
            self._compare(sight.t_s)
            if self._seen and sight.t_s > self._seen[-1][0]:
                self._seen.append((sight.t_s, self._markers))
            if self.rows and sight.t_s - self._began_s > self.rows[-1]["t_s"]:
                here = {name: self.rows[-1][name] for name in ("cycle", *PARAMETERS)}
                self.rows.append(self._row(sight.t_s) | here)
        self._watch.check(sight, self._eye.picture_s)
        if self._copied_s is not None and self._watch.overdue(self._copied_s):
            raise TrialPausedError(
                "the camera sends the same picture again and again while the joints turn: it hangs. Look at it: bns track"
            )
        return sight

    def _glance(self) -> None:
        """While the robot gets its torque: it stands, and the camera must go on."""
        self._eye.look()
        self._still_filmed()

    def _still_held(self) -> None:
        """While the straight robot is looked at: servos are asked, or a bridge takes silence for a computer that is gone."""
        self._chain.health()
        self._still_filmed()

    def _still_filmed(self) -> None:
        self._watch.still_filmed(self._eye.picture_s)

    def _read(self, read_s: float, joints_rad: np.ndarray) -> None:
        """Take in where the joints are: how far they have turned, and what that makes of the distance of the markers."""
        if self._joints_rad is not None:
            furthest_rad = self._settings.joint_speed_rad_s * (read_s - self._read_s)
            turned_rad = float(np.abs(joints_rad - self._joints_rad)[self._between].max())
            self._turned_rad += min(turned_rad, furthest_rad)
            if turned_rad > furthest_rad + _SPRUNG_RAD:
                self._apart, self._shown = [], None
        self._joints_rad, self._read_s = joints_rad, read_s
        self._turns = [*self._turns[1 - _READINGS :], (read_s, self._turned_rad)]
        self._apart = [*self._apart[1 - _READINGS :], (read_s, apart_m(joints_rad, self._parameters))]

    def _reached(self, filmed_s: float) -> float:
        """For how long, s, the markers have been where the robot cannot have brought them: their middle, or their direction.

        Markers that lie near one another may turn about each other the faster.
        """
        yellow, green = self._markers.reshape(2, 2)
        apart = green - yellow
        fastest_rad_s = 2.0 * self._fastest_m_s / max(float(np.hypot(*apart)), _NEAREST_M)
        heading_rad = math.atan2(apart[1], apart[0])
        return self.leaps.seen(filmed_s, (yellow + green) / 2.0, self._fastest_m_s, heading_rad, fastest_rad_s)

    def _reach(self, filmed_s: float) -> None:
        """TrialPausedError if the robot has been seen where it cannot be for too long."""
        if not self._seen or filmed_s <= self._began_s:
            return
        lasts_s = self._reached(filmed_s)
        if lasts_s >= self._disagree_s:
            raise TrialPausedError(
                f"the robot is seen where it cannot have moved to for {lasts_s:.1f} s. Is another thing tracked, was it carried, "
                "was the camera pushed? Try: bns track"
            )

    def _follow(self, filmed_s: float) -> None:
        """TrialPausedError if joints between the markers turn on and on and the markers stay where they were, or if the markers
        must have come nearer, or gone apart, by the time of the picture."""
        markers, span = self._markers.reshape(2, 2), self._apart_m(filmed_s)
        unseen_rad = self._scene.since_it_moved(markers, self._turned_rad)
        if self._shape.is_another(markers) or self._shown is None:
            self._shown = span
        unseen_m = max(span[0] - self._shown[1], self._shown[0] - span[1])
        if unseen_rad > self._frozen_rad or unseen_m > self._frozen_m:
            raise TrialPausedError(
                f"joints have turned by {math.degrees(unseen_rad):.0f}°, {100 * max(unseen_m, 0.0):.1f} cm of the markers' "
                "distance, and the picture shows both markers where they were: the camera hangs or shows another scene. Look at "
                "it: bns track"
            )

    def _compare(self, filmed_s: float) -> None:
        """Whether this picture is one that came before: no camera sees two markers in the same places while one of them moves.

        A clock in the picture may go on. A tracker that sees a robot at rest always in the same place is not judged.
        """
        if self._copy.is_another(self._markers.reshape(2, 2)) or not self._eye.wanders:
            self._first_s, self._came_s = filmed_s, self._eye.picture_s or filmed_s
        self._repeats = filmed_s > self._first_s
        times, turned_rad = np.array(self._turns).T
        delays_s = np.linspace(0.0, self._unknown_s, _DELAYS)
        then_rad, now_rad = (np.interp(t_s - delays_s, times, turned_rad) for t_s in (self._first_s, filmed_s))
        self._copied_s = self._came_s if (now_rad - then_rad).min() > _COPIED_RAD else None

    def _apart_m(self, filmed_s: float) -> tuple[float, float]:
        """Least and greatest distance of the markers, by the joints, at the times at which the picture can have been taken."""
        times, apart = (np.array(column) for column in zip(*self._apart, strict=True))
        ends = np.interp([filmed_s - self._unknown_s, filmed_s], times, apart)
        between = apart[(times > filmed_s - self._unknown_s) & (times < filmed_s)]
        return float(min(*ends, *between)), float(max(*ends, *between))

    def _in_sight(self) -> float:
        """Now; if the markers are not seen just then, the posture is held until they are, or the drive ends."""
        while self._look() is None:
            self._clock.sleep(_TICK_S / 2)
        return self._clock.now_s()

    def _row(self, filmed_s: float) -> dict[str, float]:
        return {"t_s": filmed_s - self._began_s, **_NOTHING, **dict(zip(_PLACES, self._markers.tolist(), strict=True))}
