"""A tracker looked through: what it saw before somebody asked does not count, and noise tells a picture from its copy."""

from types import SimpleNamespace

import numpy as np
import pytest

from bns.errors import TrialPausedError
from bns.hardware.link.hardware_log import HardwareLog
from bns.hardware.tracking.eye import Eye
from bns.hardware.tracking.sight import Sight


class Looks:
    """A tracker that shows one sight after the other, each so much older than the clock."""

    def __init__(self, clock, *shown):
        self._clock, self._shown = clock, list(shown)

    def look(self):
        old_s, pose = self._shown.pop(0) if len(self._shown) > 1 else self._shown[0]
        return Sight(self._clock.now_s() - old_s, np.array(pose))


def test_where_a_robot_stands_is_not_where_it_was_seen_before_it_was_put_there(clock):
    clock.sleep(1.0)
    eye = Eye(Looks(clock, (0.05, (0.7, 0.4, 0.0)), (0.0, (0.1, -0.2, 0.3))), clock, HardwareLog(None, clock), 0.0)
    np.testing.assert_allclose(eye.standing().pose, [0.1, -0.2, 0.3])


@pytest.mark.parametrize(("places", "wanders"), [((0, 1, 2, 3, 4, 5, 6, 7, 8, 9), True), ((0, 1, 2, 3, 3, 5, 6, 7, 8, 9), False)])
def test_a_robot_wanders_only_if_no_two_pictures_in_a_row_are_alike(clock, places, wanders):
    eye = Eye(Looks(clock, *((0.0, (1e-4 * place, 0.0, 0.0)) for place in places)), clock, HardwareLog(None, clock), 0.0)
    assert eye.standing() is not None
    assert eye.wanders == wanders


def test_a_camera_that_is_gone_is_not_taken_for_a_robot_out_of_sight(clock):
    tracker = SimpleNamespace(look=lambda: None, gone="")
    eye = Eye(tracker, clock, HardwareLog(None, clock), 0.0, kind="aruco")
    assert eye.standing() is None
    tracker.gone = "the camera 0 is gone"
    with pytest.raises(TrialPausedError, match=r"^the aruco tracker: the camera 0 is gone$"):
        eye.standing()
