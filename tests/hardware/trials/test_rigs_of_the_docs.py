"""The complete rigs of docs/trials.md can be used as they stand there, and say the defaults that there are."""

import re
from pathlib import Path

import pytest

from bns.hardware.rig import parse_rig
from bns.hardware.safety import Limits
from bns.hardware.servos.servo_chain import ServoLimits
from bns.hardware.servos.snake_settings import snake_settings
from bns.hardware.tracking.kinds import checked
from bns.hardware.wheels.khepera_settings import KheperaSettings, khepera_settings

TEXT = (Path(__file__).parents[3] / "docs" / "trials.md").read_text()


def rig(robot):
    [text] = re.findall(rf"```yaml\n(# {robot}\.yaml\n.*?)```", TEXT, re.DOTALL)
    return parse_rig(text, robot)


@pytest.mark.parametrize("robot", ["khepera", "snake"])
def test_a_rig_of_the_docs_can_be_used(robot):
    assert rig(robot).robot == robot
    checked(rig(robot).tracker)


def test_the_khepera_has_the_defaults():
    own = rig("khepera")
    assert own.limits == Limits(own.limits.surface)
    assert khepera_settings(own.driver) == KheperaSettings()


def test_the_snake_has_the_defaults():
    assert snake_settings(rig("snake").driver).limits == ServoLimits()
