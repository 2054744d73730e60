"""A snake under a camera that hangs: found soon, and never by mistake."""

import tempfile
from contextlib import nullcontext
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from bns.errors import TrialPausedError
from bns.hardware.emulators.faults import Fault, FaultPlan
from bns.hardware.link.hardware_log import HardwareLog, events
from bns.hardware.platforms import snake
from bns.hardware.rig import shipped_rig
from bns.hardware.safety import DriveEnded, Limits, Stopping, Surface, Watch
from bns.hardware.servos.servo_chain import Health
from bns.hardware.servos.shape import apart_m
from bns.hardware.servos.snake_drive import SnakeDrive
from bns.hardware.servos.snake_settings import snake_settings
from bns.hardware.tracking.eye import Eye
from bns.hardware.tracking.sight import Sight
from bns.physics.snake.parameters import shipped_parameters

GENTLE = np.array([0.5, 0.1, 0.6, 0.7, 1.0])
WIDE = np.array([1.2, 0.0, 0.9, 0.0, 1.0])
TRACKING_M = 0.0005
BEYOND, BETWEEN = [0, 1, 10, 11], list(range(2, 10))


class Chain:
    """Servos that are at once where they were sent; only some of them obey. They take a while to get their torque."""

    step_rad = 0.005

    def __init__(self, clock, obey):
        self._clock, self._obey, self._at = clock, obey, np.zeros(12)

    def arm(self, meanwhile):
        for _ in range(10):
            meanwhile()
            self._clock.sleep(0.08)

    def move(self, angles_rad, _speeds):
        self._at[self._obey] = np.array(angles_rad)[self._obey]
        return list(angles_rad)

    def health(self):
        return {n: Health(float(self._at[n - 1]), 0.1, 12.0, 30.0) for n in range(1, 13)}

    def check_torque(self):
        pass


class Pictures:
    """A tracker at 15 pictures a second that sees both markers at rest, as far as its noise lets it, until `ends_s`."""

    def __init__(self, clock, ends_s):
        self._clock, self._ends_s, self._draw = clock, ends_s, np.random.default_rng(4)
        self.picture_s, self._last = None, None

    def look(self):
        filmed_s = np.floor(min(self._clock.now_s(), self._ends_s) * 15) / 15
        if filmed_s != self.picture_s:
            seen = [np.array(place) + TRACKING_M * self._draw.standard_normal(2) for place in ((0, -0.3), (0, 0.3))]
            self._last = Sight(filmed_s, np.array([0.0, 0.0, np.pi / 2]), 0.0, dict(zip(("yellow", "green"), seen, strict=True)))
        self.picture_s = filmed_s
        return self._last


class Copied(Pictures):
    """The same picture again and again from some time on, with new stamps; `rests`: the noise of the others as well."""

    def __init__(self, clock, from_s, rests=False, rate_hz=15):
        super().__init__(clock, np.inf)
        self.from_s, self._rests, self._rate_hz = from_s, rests, rate_hz

    def look(self):
        filmed_s = np.floor(self._clock.now_s() * self._rate_hz) / self._rate_hz
        if filmed_s >= self.from_s or (self._rests and self._last is not None):
            self._last, self.picture_s = replace(self._last, t_s=filmed_s), filmed_s
            return self._last
        return super().look()


@pytest.fixture
def drive(clock):
    """drive(joints that obey, when the pictures end) -> a drive of a robot whose markers are seen to stand still."""

    def build(obey, ends_s=np.inf, chain=Chain, **more):
        journal = HardwareLog(None, clock)
        eye = Eye(Pictures(clock, ends_s), clock, journal, 0.0)
        watch = Watch(Limits(Surface(-9, 9, -9, 9)), clock, Stopping())
        watch.begin()
        settings = snake_settings({"joint_speed_rad_s": 1.5})
        return SnakeDrive(chain(clock, obey), eye, watch, settings, clock, journal, **more)

    return build


def test_an_end_of_the_body_that_swings_moves_no_marker(drive):
    """The picture is right: the tail turns by more than a radian, over and over."""
    on = drive(BEYOND)
    on.straighten()
    for _ in range(3):
        on.carry_out(WIDE)
    assert len(on.done()) == 3


def test_a_joint_that_was_held_and_springs_loose_is_none_that_was_driven(drive, clock):
    """By 2 rad at once: more than its servo turns until the next picture."""
    on = drive([])
    on.straighten()
    on._look()
    on._chain._at[5] += 2.0
    for _ in range(5):
        clock.sleep(0.1)
        on._look()


def test_joints_between_the_markers_that_turn_unseen_are_a_picture_that_hangs(drive, clock):
    on = drive(BETWEEN)
    on.straighten()
    began_s = clock.now_s()
    with pytest.raises(TrialPausedError, match="the picture shows both markers where they were"):
        on.carry_out(WIDE)
    assert clock.now_s() - began_s < 2.0


class Slow(Chain):
    """Behind an adapter that holds every answer back: the way is over before the servos have confirmed it."""

    def move(self, angles_rad, speeds):
        self._clock.sleep(0.3)
        return super().move(angles_rad, speeds)


def test_a_robot_behind_a_slow_adapter_is_looked_at_in_every_posture(drive):
    """A cycle has thirteen; after a second without a look a drive ends."""
    on = drive([], chain=Slow)
    on.straighten()
    on.carry_out(GENTLE)
    assert len(on.done()) == 1


class Turning(Chain):
    """Servos that turn as fast as they are told to."""

    def __init__(self, clock, obey):
        super().__init__(clock, obey)
        self._from, self._goal, self._since_s, self._speed = np.zeros(12), np.zeros(12), 0.0, 0.0

    def at(self, t_s):
        way = self._speed * max(t_s - self._since_s, 0.0)
        return self._from + np.clip(self._goal - self._from, -way, way)

    def move(self, angles_rad, speeds):
        self._from = self.at(self._clock.now_s())
        self._goal[self._obey] = np.array(angles_rad)[self._obey]
        self._since_s, self._speed = self._clock.now_s(), speeds[0]
        return list(angles_rad)

    def health(self):
        self._at = self.at(self._clock.now_s())
        return super().health()


class Late(Pictures):
    """The markers are seen as far apart as the joints had them some time before."""

    def __init__(self, clock, chain, late_s):
        super().__init__(clock, np.inf)
        self._chain, self._late_s = chain, late_s

    def look(self):
        sight = super().look()
        apart = apart_m(self._chain.at(sight.t_s - self._late_s), shipped_parameters())
        return replace(sight, points={"yellow": np.array([0.0, -apart / 2]), "green": np.array([0.0, apart / 2])})


@pytest.mark.parametrize(
    ("late_s", "unknown_s", "pauses"),
    [(0.0, 0.02, False), (0.02, 0.02, False), (0.16, 0.2, False), (0.16, 0.02, True)],
)
def test_a_camera_that_is_late_pauses_a_drive_only_if_its_delay_was_said_to_be_known(drive, late_s, unknown_s, pauses):
    on = drive(BETWEEN, chain=Turning, unknown_s=unknown_s)
    on._eye._tracker = Late(on._clock, on._chain, late_s)
    on.straighten()
    with pytest.raises(TrialPausedError, match="markers' distance") if pauses else nullcontext():
        for angle in (0.5, 0.0, 0.3, 0.0):
            on._go_to(np.tile([angle, 0.0], 6), 0.5, 1.5)


@pytest.mark.parametrize(("unknown_s", "within_s"), [(0.02, 0.35), (0.2, 0.5)])
def test_markers_that_must_come_nearer_and_do_not_are_a_picture_that_hangs(drive, clock, unknown_s, within_s):
    """Joints that bend the body to one side; turning alone is believed for longer."""
    on = drive(BETWEEN, chain=Turning, unknown_s=unknown_s)
    on.straighten()
    began_s = clock.now_s()
    with pytest.raises(TrialPausedError, match=r"cm of the markers' distance, and the picture shows both markers where"):
        on._go_to(np.tile([0.5, 0.0], 6), 0.5, 1.5)
    assert 0.0 < clock.now_s() - began_s <= within_s
    assert on._turned_rad < 0.65


@pytest.mark.parametrize(("unknown_s", "turned_rad", "pauses"), [(0.02, 0.45, 0), (0.02, 0.55, 1), (0.2, 0.55, 0), (0.2, 0.7, 1)])
def test_a_camera_whose_delay_is_known_is_believed_for_less_turning(drive, clock, unknown_s, turned_rad, pauses):
    on = drive(BETWEEN, unknown_s=unknown_s)
    on.straighten()
    on._look()
    on._turned_rad += turned_rad
    clock.sleep(0.1)
    with pytest.raises(TrialPausedError, match="joints have turned by") if pauses else nullcontext():
        on._look()


@pytest.mark.parametrize(("unknown_s", "nearer_m", "pauses"), [(0.02, 0.006, 0), (0.02, 0.0095, 1), (0.2, 0.0095, 0)])
def test_a_camera_whose_delay_is_known_shows_a_centimetre(drive, clock, unknown_s, nearer_m, pauses):
    """The joints have turned by less than what would be noticed by itself."""
    on, far_m = drive([4, 6], unknown_s=unknown_s), apart_m(np.zeros(12), shipped_parameters())
    on.straighten()
    on._look()
    bends = (np.where(np.isin(np.arange(12), [4, 6]), angle, 0.0) for angle in np.arange(0.0, 0.5, 0.002))
    on._chain._at = next(joints for joints in bends if far_m - apart_m(joints, shipped_parameters()) > nearer_m)
    with pytest.raises(TrialPausedError, match="cm of the markers' distance") if pauses else nullcontext():
        for _ in range(6):
            clock.sleep(0.1)
            on._look()
    assert on._turned_rad < 0.5


def little(on, rad=0.2):
    """Joints turn by less than what would be noticed without a look at the noise."""
    on._go_to(np.tile([0.0, rad], 6), rad, 0.4)


@pytest.mark.parametrize("rate_hz", [5, 15])
@pytest.mark.parametrize("unknown_s", [0.02, 0.2])
def test_a_picture_that_is_sent_again_and_again_is_none(drive, clock, rate_hz, unknown_s):
    """Whatever its stamps say: without the noise of a camera it is a copy."""
    on = drive(BETWEEN, chain=Turning, unknown_s=unknown_s)
    on._eye._tracker = pictures = Copied(clock, np.inf, rate_hz=rate_hz)
    on.straighten()
    pictures.from_s = began_s = clock.now_s() + 0.05
    with pytest.raises(TrialPausedError, match="sends the same picture again and again while the joints turn"):
        little(on)
    assert clock.now_s() - began_s < 0.55
    assert on._turned_rad < 0.5


def test_a_robot_that_stands_may_be_seen_in_the_same_place(drive, clock):
    on = drive(BETWEEN, chain=Turning)
    on._eye._tracker = pictures = Copied(clock, np.inf)
    on.straighten()
    pictures.from_s = clock.now_s()
    for _ in range(10):
        on._look()
        clock.sleep(0.1)


def test_a_tracker_without_noise_is_not_judged_by_its_noise(drive, clock):
    on = drive(BETWEEN, chain=Turning)
    on._eye._tracker = Copied(clock, np.inf, rests=True)
    on.straighten()
    little(on)


def test_pictures_with_noise_are_no_copies(drive):
    on = drive(BETWEEN, chain=Turning)
    on.straighten()
    little(on)


@pytest.mark.parametrize("ends_s", [0.2, 0.5, 0.9])
def test_a_camera_that_stops_while_the_servos_get_their_torque_is_noticed(drive, clock, ends_s):
    """By 0.8 s they have it; then the robot is looked for, for another second."""
    with pytest.raises(DriveEnded, match="the camera has sent no new picture"):
        drive(BETWEEN, ends_s).straighten()
    assert clock.now_s() - ends_s < 0.45


@pytest.mark.parametrize(("kind", "within_s"), [("stuck-marker", 0.6), ("frozen-picture", 0.6), ("frozen-scene", 1.0)])
@pytest.mark.parametrize("at_s", [3.1, 4.4])
def test_an_emulated_robot_is_stopped_when_its_camera_hangs(tmp_path, clock, kind, within_s, at_s):
    """Bits and scene; the emulated camera takes a picture every 0.2 s."""
    rig = shipped_rig("snake")
    on = snake.emulate(rig, Path(tempfile.mkdtemp(dir=tmp_path)), clock, FaultPlan((Fault(kind, at_s=at_s, for_s=99.0),)), 0)
    journal = HardwareLog(tmp_path / "journal.jsonl", clock)
    platform = snake.open_platform(replace(on.rig, limits=rig.limits), clock, journal, Stopping())
    try:
        if kind != "stuck-marker":
            with pytest.raises(TrialPausedError, match=r"same picture again|the picture shows both markers where they were"):
                platform.drive(np.array([GENTLE] * 5, np.float32))
        else:
            assert "no new picture" in platform.drive(np.array([GENTLE] * 5, np.float32)).ended
    finally:
        platform.close()
        on.close()
        journal.close()
    stop = next(event for event in events(tmp_path / "journal.jsonl", "stop") if event["t_s"] > at_s)
    assert stop["confirmed"]
    assert stop["t_s"] - stop["seconds"] - at_s < within_s


def test_a_camera_that_repeats_itself_is_looked_at_more_often(drive, clock, monkeypatch):
    on, slept = drive(BETWEEN, chain=Turning, unknown_s=0.2), []
    on._eye._tracker = pictures = Copied(clock, np.inf)
    on.straighten()
    monkeypatch.setattr(clock, "sleep", lambda seconds, sleep=clock.sleep: (slept.append(seconds), sleep(seconds)))
    little(on)
    assert max(slept) > 0.1
    pictures.from_s = clock.now_s()
    slept.clear()
    with pytest.raises(TrialPausedError, match="same picture"):
        on._go_to(np.tile([0.0, -0.2], 6), 0.4, 0.4)
    assert sum(seconds < 0.05 for seconds in slept) > 3


class Clipped(Chain):
    """Servos whose angle limits are too narrow on one side."""

    def move(self, angles_rad, speeds):
        return np.minimum(super().move(angles_rad, speeds), 0.3)


def test_a_joint_that_a_servo_keeps_from_its_angle_pauses_the_drive_and_is_named(drive):
    on = drive([], chain=Clipped)
    on.straighten()
    with pytest.raises(TrialPausedError, match=r"joint \d+ should go to \d\d°, but the command was clipped to 17°"):
        on.carry_out(WIDE)


def test_whether_a_cycle_was_stable_is_said_of_the_rows_after_its_command(drive):
    on = drive([])
    on.straighten()
    on.carry_out(GENTLE)
    start, *after = [row["stable"] for row in on.rows]
    assert np.isnan(start)
    assert len(after) > 2
    assert set(after) == {1.0}
