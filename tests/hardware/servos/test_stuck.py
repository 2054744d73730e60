"""A controller whose drive is stuck is driven once more; stuck there again, it is kept as it was."""

from types import SimpleNamespace

import numpy as np
import pytest

from bns.errors import TrialPausedError
from bns.hardware.clock import EmulatedClock
from bns.hardware.leaps import Leaps
from bns.hardware.link.hardware_log import HardwareLog, events
from bns.hardware.platform import Driven
from bns.hardware.platforms import snake
from bns.hardware.rig import shipped_rig
from bns.hardware.servos.servo_chain import ServoError, StuckServoError
from bns.hardware.stop import Stop
from bns.trial.driver import TrialDriver
from bns.trial.folder import past_evaluations, stuck_before
from bns.trial.operator import Decision, UnattendedOperator

CYCLES = np.zeros((3, 5), np.float32)


class Hands:
    """Puts the robot back whenever it is asked to, and keeps everything."""

    def __init__(self):
        self.placed = []

    wants_picture = False

    def arm(self, _what):
        pass

    def place(self, _start, why):
        self.placed.append(why)

    def accept(self, _summary, _spans):
        return Decision("next")


def drives(*stuck):
    """A platform whose drives end one after the other stuck at these servos ("" : not at all)."""
    left = list(stuck)

    def drive(commands):
        what = left.pop(0)
        done = len(commands) if not what else 1
        ended = f"{what} is stuck" if what else ""
        return Driven(commands[:done], np.zeros((done + 1, 9)), [], Stop(True, 0.1, 0.1, ""), ended, 5.0, (), what)

    return SimpleNamespace(pose=lambda: np.zeros(3), readings=dict, drive=drive, left=left)


@pytest.fixture
def driver(tmp_path):
    """driver(platform, operator) -> a TrialDriver that goes on with the same journal."""
    path, clock, logs = tmp_path / "journal.jsonl", EmulatedClock(np.inf), []

    def build(platform, operator):
        stuck = stuck_before(path)
        logs.append(HardwareLog(path, clock))
        return TrialDriver(platform, operator, shipped_rig("snake"), np.zeros(3), clock, logs[-1], stuck=stuck)

    build.path = path
    yield build
    for log in logs:
        log.close()


def test_a_drive_that_is_stuck_once_is_repeated(driver):
    hands, platform = Hands(), drives("servo 9", "")
    kept = driver(platform, hands).evaluate(1, CYCLES)
    assert len(kept.commands) == 3
    assert hands.placed == ["servo 9 is stuck"]
    assert len(past_evaluations(driver.path)) == 1
    assert len(past_evaluations(driver.path)[0].commands) == 3


def test_a_drive_that_is_stuck_there_again_is_kept_as_far_as_it_went(driver):
    hands, platform = Hands(), drives("servo 9", "servo 9", "not driven")
    kept = driver(platform, hands).evaluate(1, CYCLES)
    assert len(kept.commands) == 1
    assert platform.left == ["not driven"]


def test_another_servo_and_another_evaluation_are_other_causes(driver):
    hands, platform = Hands(), drives("servo 9", "servo 3", "servo 9", "servo 9", "")
    driven = driver(platform, hands)
    assert len(driven.evaluate(1, CYCLES).commands) == 1
    assert len(driven.evaluate(2, CYCLES).commands) == 3
    assert len(hands.placed) == 3


def test_with_nobody_there_it_pauses_once_and_goes_on_with_what_the_second_attempt_gives(driver):
    with pytest.raises(TrialPausedError, match="servo 9 is stuck, and with --yes there is no operator to put it back"):
        driver(drives("servo 9"), UnattendedOperator()).evaluate(1, CYCLES)
    assert past_evaluations(driver.path) == []
    kept = driver(drives("servo 9"), UnattendedOperator()).evaluate(1, CYCLES)
    assert len(kept.commands) == 1
    assert [event["what"] for event in events(driver.path, "stuck")] == ["servo 9"]


class Drive:
    """In place of `SnakeDrive`: fails while it straightens or in its second cycle."""

    def __init__(self, error, straightening):
        self.error, self.straightening, self.cycles, self.rows, self.spans_s = error, straightening, [], [], []
        self.leaps = Leaps()

    def __call__(self, *_):
        return self

    def straighten(self):
        if self.straightening:
            raise self.error

    def carry_out(self, cycle):
        self.cycles.append(cycle)
        if len(self.cycles) == 2:
            raise self.error

    def finish(self):
        pass

    def done(self):
        return np.array(self.cycles)

    def observed(self):
        return np.zeros((len(self.cycles) + 1, 9))


def driven(monkeypatch, error, straightening=False):
    chain = SimpleNamespace(stop=lambda: Stop(True, 0.1, 0.1, ""))
    rig = SimpleNamespace(limits=shipped_rig("snake").limits, tracker={})
    monkeypatch.setattr(snake, "SnakeDrive", Drive(error, straightening))
    stopping = SimpleNamespace(check=lambda: None)
    return snake.SnakePlatform(chain, None, rig, None, EmulatedClock(np.inf), None, stopping).drive(CYCLES)


def test_a_stuck_servo_ends_the_drive_and_other_faults_and_a_body_that_cannot_lie_straight_pause(monkeypatch):
    stuck = StuckServoError(9, 1.0, 1.2)
    ended = driven(monkeypatch, stuck)
    assert (ended.stuck, len(ended.commands)) == ("servo 9", 2)
    assert ended.ended == "servo 9 has used 100% of its torque for 1.2 s; is it stuck?"
    with pytest.raises(TrialPausedError, match="servos failed: servo 9 has used"):
        driven(monkeypatch, stuck, straightening=True)
    with pytest.raises(TrialPausedError, match="servos failed: servo 2 is at 70"):
        driven(monkeypatch, ServoError("servo 2 is at 70"))


def test_a_heading_a_turn_further_is_the_same_heading(driver):
    hands, platform = Hands(), drives("")
    platform.pose = lambda: np.array([0.0, 0.0, 2.0 * np.pi - 0.01])
    driver(platform, hands).evaluate(1, CYCLES)
    assert hands.placed == []


def test_a_robot_is_put_back_once_after_a_drive_without_a_result(driver):
    hands, platform = Hands(), drives("")
    real, left = platform.drive, [2]

    def drive(commands):
        done = real(commands) if not left[0] else Driven(commands[:0], np.zeros((1, 9)), [], Stop(True, 0.1, 0.1, ""), "no")
        left[0] = max(0, left[0] - 1)
        return done

    platform.drive = drive
    driver(platform, hands).evaluate(1, CYCLES)
    assert hands.placed == ["The drive gave no result: no"] * 2


@pytest.mark.parametrize(
    ("raised", "why"),
    [(TrialPausedError("the camera is gone"), "the camera is gone"), (KeyboardInterrupt(), "KeyboardInterrupt")],
)
def test_a_drive_that_is_interrupted_says_why_in_the_journal(driver, raised, why):
    platform = drives("")

    def drive(_commands):
        raise raised

    platform.drive = drive
    with pytest.raises(type(raised)):
        driver(platform, Hands()).evaluate(4, CYCLES)
    assert [(event["evaluation"], event["why"]) for event in events(driver.path, "interrupted")] == [(4, why)]
    assert past_evaluations(driver.path) == []


def test_a_live_view_shows_the_last_stop_in_milliseconds(driver):
    on = driver(drives("", ""), Hands())
    on.stops_s = [0.5, 0.07]
    assert on.live_text()["last stop"] == "70 ms"
