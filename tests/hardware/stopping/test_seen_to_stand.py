"""A stop counts only if the tracker, where it sees the robot, does not see it move; one that does not count is never hidden."""

import sys
from types import SimpleNamespace

import numpy as np
import pytest

from bns.errors import StopNotConfirmedError
from bns.hardware.link.hardware_log import HardwareLog, events
from bns.hardware.platforms.khepera import WHEELS
from bns.hardware.rig import shipped_rig
from bns.hardware.safety import CUT_THE_POWER, Stopping, StopsAtTheEnd
from bns.hardware.stop import Stop
from bns.hardware.tracking.sight import Sight
from bns.hardware.wheels.wheeled import WheeledPlatform

SAID = Stop(True, 0.1, 0.02)


@pytest.fixture
def stopped(clock, tmp_path):
    """stopped(speed_m_s, said) -> what a stop is, and the notes of it, of a robot that drives on at this speed."""

    def of(speed_m_s, said=SAID):
        tracker = SimpleNamespace(look=lambda: Sight(clock.now_s(), np.array([speed_m_s * clock.now_s(), 0.0, 0.0])))
        path = tmp_path / "journal.jsonl"
        with HardwareLog(path, clock) as journal:
            driver = SimpleNamespace(stop=lambda: said)
            platform = WheeledPlatform(driver, tracker, WHEELS, shipped_rig("khepera"), clock, journal, Stopping())
            stop = platform.stop()
        return stop, list(events(path, "moving"))

    return of


def test_wheels_that_say_they_stand_while_the_robot_is_seen_to_drive_are_no_stop(stopped):
    stop, noted = stopped(0.13)
    assert not stop.confirmed
    assert stop.problem == "its wheels say that they stand, but the wii tracker sees it move at 0.13 m/s and turn at 0°/s"
    assert [note["problem"] for note in noted] == [stop.problem]
    assert (stop.seconds, stop.acknowledged_s) == (SAID.seconds, SAID.acknowledged_s)


def test_a_stop_of_a_robot_that_is_seen_to_stand_is_the_driver_s(stopped):
    assert stopped(0.0) == (SAID, [])


def test_the_tracker_is_not_asked_about_a_stop_that_failed_anyway(stopped):
    failed = Stop(False, 5.0, None, "the wheels still turn")
    assert stopped(0.13, failed) == (failed, [])


def test_a_terminal_that_is_closed_does_not_hide_a_stop_that_was_not_confirmed(monkeypatch):
    def gone(_text):
        raise OSError(5, "Input/output error")

    monkeypatch.setattr(sys, "stderr", SimpleNamespace(write=gone, flush=lambda: None))
    not_confirmed = StopsAtTheEnd(lambda: Stop(False, 5.0, None, "the port is gone"))
    with pytest.raises(StopNotConfirmedError, match=CUT_THE_POWER), not_confirmed:
        raise RuntimeError("the drive failed")
