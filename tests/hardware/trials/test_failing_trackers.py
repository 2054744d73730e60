"""A tracker that fails while the robot drives, however it does so: robot stopped, trial paused, the tracker named."""

import numpy as np
import pytest

from bns.hardware.link.hardware_log import events
from bns.hardware.tracking.sight import Sight
from bns.hardware.tracking.wii import WiiTracker
from bns.trial.folder import past_evaluations

from .calls import TRIAL, call, faults, journal_of


def raises(error):
    def look(_now_s):
        raise error

    return look


NOT_POSES = [
    lambda now_s: Sight(now_s, np.full(3, np.nan)),
    lambda now_s: Sight(now_s, np.array([0.0, np.inf, 0.0])),
    lambda now_s: Sight(np.nan, np.zeros(3)),
    lambda now_s: Sight(now_s, np.zeros(3), np.nan),
    lambda now_s: Sight(now_s, np.zeros(3), 0.0, {"nose": np.full(2, np.nan)}),
    lambda now_s: Sight(now_s, np.zeros(2)),
    lambda now_s: Sight(now_s, ["here"] * 3),
    lambda now_s: Sight(now_s, None),
    lambda now_s: (0.0, 0.0, 0.0),
    raises(ValueError("could not convert string to float: '0.1e'")),
    raises(FileNotFoundError(2, "No such file or directory", "pose.txt")),
    raises(IndexError("list index out of range")),
    raises(RuntimeError("no frame")),
]


@pytest.mark.parametrize("look", NOT_POSES)
def test_a_tracker_that_fails_in_mid_drive_pauses_the_trial(tmp_path, monkeypatch, capsys, look):
    good, moving_s = WiiTracker.look, []

    def looked(self):
        pose = good(self)
        if pose is not None and pose.pose[1] > 0.02:  # on its way from the start
            moving_s.append(self._clock.now_s())
            return look(self._clock.now_s())
        return pose

    asked = [*TRIAL, "--evaluations", 1, "--results", tmp_path]
    with monkeypatch.context() as patched:
        patched.setattr(WiiTracker, "look", looked)
        assert call(*asked) == 3
    assert len(moving_s) == 1
    said = capsys.readouterr().err
    assert "the wii tracker failed" in said
    assert "bns track" in said
    assert "the same command with --resume goes on" in said
    assert not past_evaluations(journal_of(tmp_path))
    assert all(stop["confirmed"] for stop in events(journal_of(tmp_path), "stop"))
    assert call(*asked, "--resume") == 0


def test_a_pose_without_numbers_is_said_to_be_none(tmp_path, monkeypatch, capsys):
    monkeypatch.setattr(WiiTracker, "look", lambda self: Sight(self._clock.now_s(), np.full(3, np.nan)))
    assert call(*TRIAL, "--evaluations", 1, "--results", tmp_path) == 3
    assert "it gave the pose [nan, nan, nan]" in capsys.readouterr().err


def test_a_tracker_that_cannot_be_closed_takes_nothing_from_a_trial(tmp_path, monkeypatch):
    monkeypatch.setattr(WiiTracker, "close", lambda _self: 1 / 0)
    assert call(*TRIAL, "--evaluations", 1, "--results", tmp_path) == 0


def test_a_lost_picture_clock_pauses_as_well(tmp_path, monkeypatch, capsys):
    monkeypatch.setattr(WiiTracker, "picture_s", property(lambda _self: int("no time")), raising=False)
    assert call(*TRIAL, "--evaluations", 1, "--results", tmp_path, *faults(tmp_path)) == 3
    assert "the wii tracker failed (ValueError" in capsys.readouterr().err
