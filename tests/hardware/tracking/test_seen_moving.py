"""Poses that are stamped ahead of the clock, and what a tracker says of a robot that should stand."""

import numpy as np
import pytest

from bns.errors import TrialPausedError
from bns.hardware.link.hardware_log import HardwareLog
from bns.hardware.safety import Limits, OutOfSight, Stopping, Surface, Watch
from bns.hardware.tracking.eye import Eye
from bns.hardware.tracking.sight import Sight

BEGIN_S, RATE_HZ = 10.0, 30.0


class Filmed:
    """A tracker that takes 30 pictures a second of a robot whose pose is a function of the time since `BEGIN_S`."""

    def __init__(self, clock, pose, ahead_s=0.0):
        self._clock, self._pose, self._ahead_s, self.looks = clock, pose, ahead_s, 0

    def look(self):
        self.looks += 1
        t_s = np.floor(self._clock.now_s() * RATE_HZ) / RATE_HZ
        pose = self._pose(t_s - BEGIN_S)
        return None if pose is None else Sight(t_s + self._ahead_s, np.array(pose, float))


class Failing:
    """A tracker that has failed."""

    def __init__(self):
        self.looks = 0

    def look(self):
        self.looks += 1
        raise RuntimeError("unplugged")


@pytest.fixture
def eye_of(clock):
    """eye_of(tracker) -> an eye at `BEGIN_S`."""
    clock.sleep(BEGIN_S)
    return lambda tracker: Eye(tracker, clock, HardwareLog(None, clock), 0.0, kind="udp")


def stands(_t_s):
    return 0.3, 0.2, 1.0


@pytest.mark.parametrize(("ahead_s", "said"), [(0.2, r"0\.1\d* s ahead|0\.2 s ahead"), (1e9, r"1e\+09 s ahead")])
def test_a_pose_from_the_future_is_refused(clock, eye_of, ahead_s, said):
    with pytest.raises(TrialPausedError, match=rf"the udp tracker gave a pose that is stamped ({said}) of the clock"):
        eye_of(Filmed(clock, stands, ahead_s)).look()


def test_a_stamp_may_be_rounded(clock, eye_of):
    assert eye_of(Filmed(clock, stands, 0.05)).look() is not None


def test_a_stamp_from_the_future_does_not_keep_a_robot_in_sight(clock):
    watch = Watch(Limits(Surface(-1.0, 1.0, -1.0, 1.0)), clock, Stopping())
    watch.check(Sight(clock.now_s() + 0.09, np.zeros(3)))
    clock.sleep(0.55)
    with pytest.raises(OutOfSight):
        watch.check(None)


def noisy(t_s):
    frame = round(t_s * RATE_HZ)
    return np.array([0.3, 0.2, 1.0]) + np.random.default_rng(frame + 100).normal(0.0, [0.003, 0.003, 0.01])


def coasts(t_s):
    return 0.1 * min(t_s, 0.5), 0.0, 0.0


def leaps_once(t_s):
    return (0.2 if 0.2 < t_s <= 0.2 + 1.0 / RATE_HZ else 0.0), 0.0, 0.0


def leaps_often(t_s):
    return (0.2 if round(t_s * RATE_HZ) % 10 == 5 else 0.0), 0.0, 0.0


@pytest.mark.parametrize(
    ("pose", "after_s"),
    [(stands, 0.5), (noisy, 0.5), (coasts, 1.0), (leaps_once, 0.5), (leaps_often, 0.5), (lambda _: None, 1.6)],
)
def test_a_robot_that_is_seen_to_stand_or_not_seen_does_not_move(clock, eye_of, pose, after_s):
    assert eye_of(Filmed(clock, pose)).moving() == ""
    assert clock.now_s() - BEGIN_S < after_s


@pytest.mark.parametrize(
    ("pose", "said"),
    [
        (lambda t_s: (0.05 * t_s, 0.0, 0.0), "the udp tracker sees it move at 0.05 m/s and turn at 0°/s"),
        (lambda t_s: (0.0, 0.0, np.radians(60.0) * t_s), "the udp tracker sees it move at 0.00 m/s and turn at 60°/s"),
    ],
)
def test_a_robot_that_moves_is_said_to(clock, eye_of, pose, said):
    assert eye_of(Filmed(clock, pose)).moving() == said


def test_a_tracker_that_failed_is_not_asked_again(eye_of):
    tracker = Failing()
    eye = eye_of(tracker)
    with pytest.raises(TrialPausedError):
        eye.look()
    assert eye.moving() == ""
    assert tracker.looks == 1


def test_a_tracker_that_fails_while_the_robot_should_stand_says_nothing(eye_of):
    assert eye_of(Failing()).moving() == ""
