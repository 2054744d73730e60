"""A robot that is put back by hand: how often somebody is asked, and what is looked at afterwards."""

from types import SimpleNamespace

import numpy as np
import pytest

from bns.errors import TrialPausedError
from bns.hardware.link.hardware_log import HardwareLog
from bns.hardware.platform import Driven
from bns.hardware.rig import shipped_rig
from bns.hardware.stop import Stop
from bns.trial.driver import TrialDriver
from bns.trial.operator import Decision

START = np.zeros(3)
FAR = np.array([1.0, 0.0, 0.0])


def driver(clock, poses):
    """A driver whose robot stands at the next of these poses whenever it is looked at, and the reasons that the operator got."""
    seen, heard = iter(poses), []
    operator = SimpleNamespace(place=lambda _start, why: heard.append(why), wants_picture=False)
    platform = SimpleNamespace(pose=lambda: next(seen))
    return TrialDriver(platform, operator, shipped_rig("khepera"), START, clock, HardwareLog(None, clock)), heard


@pytest.mark.parametrize("requests", [0, 1, 3])
def test_a_robot_that_stands_right_after_the_last_request_is_driven(clock, requests):
    own, heard = driver(clock, [*[FAR] * requests, START])
    own._ready(0)
    assert heard == ["The robot stands 100 cm from its start"] * requests


def test_a_robot_that_stands_wrong_after_the_last_request_pauses_the_trial(clock):
    own, heard = driver(clock, [FAR, FAR, FAR, None])
    with pytest.raises(TrialPausedError, match="could not be brought to its start: The tracker does not see the robot"):
        own._ready(0)
    assert len(heard) == 3


def test_why_the_last_drive_ended_is_said_to_whoever_puts_the_robot_back(clock):
    ended = "the camera has sent no new picture for 0.27 s"
    own, heard = driver(clock, [START, None, START])
    own._platform.readings = dict
    own._platform.drive = lambda _commands: Driven(np.ones((1, 3)), np.zeros((2, 3)), [], Stop(True, 0.1, 0.1), ended)
    own._operator.arm = lambda _what: None
    own._operator.accept = lambda *_: Decision("next")
    for number in (1, 2):
        own.evaluate(number, np.ones((1, 3)))
    assert heard == [f"The tracker does not see the robot (the last drive ended because {ended})"]


def test_why_the_last_drive_ended_is_said_where_the_robot_stands_elsewhere(clock):
    turned = np.array([0.0, 0.0, 3.0])
    own, heard = driver(clock, [FAR, turned, START])
    own._last_end = "the camera has sent no new picture for 0.27 s"
    own._ready(1)
    because = "(the last drive ended because the camera has sent no new picture for 0.27 s)"
    assert heard == [f"The robot {how} from its start {because}" for how in ("stands 100 cm", "is turned by 172°")]
