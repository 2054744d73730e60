"""Poses that the robot cannot have reached are counted, told, and no cycle of a snake with one is kept as stable."""

import numpy as np
import pytest

from bns.errors import TrialPausedError
from bns.hardware.leaps import OFF_M, OFF_RAD, Leaps
from bns.hardware.tracking.camera import FrameTracker
from bns.hardware.tracking.sight import Sight
from bns.hardware.tracking.wii import WiiTracker
from bns.trial.folder import measured, past_evaluations

from ..trials.calls import TRIAL, call, journal_of
from ..trials.test_snake_trial import GENTLE, rigged  # noqa: F401


def leapt(*places_m, fastest_m_s=0.5, step_s=0.1):
    leaps = Leaps()
    return [leaps.seen(step_s * i, np.array([x, 0.0]), fastest_m_s) for i, x in enumerate(places_m)], leaps.count


def test_a_robot_may_move_as_fast_as_it_can_and_a_little_more():
    assert leapt(0.0, 0.05 + OFF_M - 1e-6, 0.1)[1] == 0
    assert leapt(0.0, 0.05 + OFF_M + 1e-6)[1] == 1


def test_a_place_that_leaps_and_comes_back_counts_once():
    assert leapt(0.0, 0.02, 0.42, 0.06, 0.08)[1] == 1


def test_a_place_that_stays_away_counts_until_the_robot_can_be_there():
    lasts_s, count = leapt(0.0, *[0.4] * 12)
    assert count == 7  # 0.4 m are 0.04 and 0.72 s of driving
    assert max(lasts_s) == pytest.approx(0.6)
    assert lasts_s[-1] == 0.0


def turned(*headings_rad, fastest_rad_s=2.0, step_s=0.1):
    leaps = Leaps()
    for i, heading_rad in enumerate(headings_rad):
        leaps.seen(step_s * i, np.zeros(2), 0.5, heading_rad, fastest_rad_s)
    return leaps.count


def test_a_robot_may_turn_as_fast_as_it_can_and_a_little_more():
    assert turned(0.0, 0.2 + OFF_RAD - 1e-6, 0.2) == 0
    assert turned(0.0, 0.2 + OFF_RAD + 1e-6) == 1
    assert turned(3.1, -3.1, 3.1 + 2 * np.pi) == 0


def test_a_marker_that_is_seen_the_other_way_round_counts_once():
    assert turned(0.0, 0.1, 0.1 + np.pi, 0.2, 0.3 - np.pi, 0.4) == 2


def test_an_old_pose_is_no_leap():
    leaps = Leaps()
    leaps.seen(1.0, np.zeros(2), 0.5)
    assert leaps.seen(1.0, np.ones(2), 0.5) == leaps.seen(0.5, np.ones(2), 0.5) == leaps.count == 0


def leaping(tracker, monkeypatch, aside_m, which, turned_rad=0.0):
    """Every sight of a robot on its way whose number is in `which` is so far aside, and turned."""
    good, seen, moving = tracker.look, [], []

    def look(self):
        sight = good(self)
        if sight is None:
            return None
        seen.append(sight.pose[:2])
        if np.hypot(*(seen[-1] - seen[0])) > 0.03:
            moving.append(sight.t_s)
        if len(set(moving)) not in which:
            return sight
        aside = np.array([aside_m, 0.0])
        points = {name: place + aside for name, place in sight.points.items()}
        return Sight(sight.t_s, sight.pose + np.array([aside_m, 0.0, turned_rad]), sight.residual_m, points)

    monkeypatch.setattr(tracker, "look", look)


def test_leaps_of_a_khepera_are_counted_and_told(tmp_path, monkeypatch, capsys):
    leaping(WiiTracker, monkeypatch, 0.3, {3, 8})
    assert call(*TRIAL, "--evaluations", 1, "--results", tmp_path) == 0
    said = capsys.readouterr()
    assert "evaluation 1: 2 poses are further from the one before than the robot can drive" in said.err
    assert "2 poses are further from the one before than the robot can drive" in said.out
    assert "cycles" not in said.err + said.out
    assert len(past_evaluations(journal_of(tmp_path))) == 1
    assert len(measured(journal_of(tmp_path)))


def test_headings_that_turn_round_are_counted_and_told(tmp_path, monkeypatch, capsys):
    leaping(WiiTracker, monkeypatch, 0.0, {3, 8}, np.pi)
    assert call(*TRIAL, "--evaluations", 1, "--results", tmp_path) == 0
    assert "2 poses are further from the one before than the robot can drive, or turned further" in capsys.readouterr().out


def test_a_trial_without_leaps_says_nothing_of_them(tmp_path, capsys):
    assert call(*TRIAL, "--evaluations", 1, "--results", tmp_path) == 0
    assert "than the robot can drive" not in "".join(capsys.readouterr())


def test_a_cycle_of_a_snake_with_a_leap_is_not_stable(rigged, monkeypatch):  # noqa: F811
    on = rigged()
    leaping(FrameTracker, monkeypatch, 0.4, {4})
    driven = on.platform.drive(np.array([GENTLE, GENTLE], np.float32))
    assert driven.leaps == 1
    assert driven.poses[:, 8].tolist() == [1.0, 0.0, 1.0]
    assert {row["stable"] for row in driven.rows if row["cycle"] == 1 and not np.isnan(row["stable"])} == {0.0}


def test_a_trial_of_a_snake_says_what_becomes_of_cycles_with_a_leap(tmp_path, monkeypatch, capsys):
    table = tmp_path / "commands.csv"
    rows = [",".join(map(str, [trial, *GENTLE[:4]])) for trial in (0, 0)]
    table.write_text("\n".join(["trial,a_lat_rad,a_vert_rad,omega_rad,alpha_rad", *rows]))
    leaping(FrameTracker, monkeypatch, 0.4, {4})
    asked = ("trial", "--robot", "snake", "--emulated", "--yes", "--speed", "inf", "--commands", table, "--results", tmp_path)
    assert call(*asked) == 0
    said = capsys.readouterr()
    assert "cycles with such poses count as unstable" in said.err
    assert "cycles with such poses count as unstable" in said.out


def test_a_snake_that_drives_as_it_can_has_no_leap(rigged):  # noqa: F811
    driven = rigged().platform.drive(np.array([GENTLE, GENTLE], np.float32))
    assert driven.leaps == 0
    assert driven.poses[:, 8].all()


def test_a_snake_that_stays_where_it_cannot_be_pauses_the_trial(rigged, monkeypatch):  # noqa: F811
    on = rigged()
    leaping(FrameTracker, monkeypatch, 0.8, set(range(4, 1000)))
    with pytest.raises(TrialPausedError, match=r"seen where it cannot have moved to for 0\.\d s.*was it carried"):
        on.platform.drive(np.array([GENTLE] * 3, np.float32))
    assert not any(servo.get("torque_enable") for servo in on.emulation.servos)


def exchanging(monkeypatch, which):
    """The camera takes each marker for the other in every sight of a robot on its way whose number is in `which`."""
    good, seen, moving = FrameTracker.look, [], []

    def look(self):
        sight = good(self)
        if sight is None:
            return None
        seen.append(sight.pose[:2])
        if np.hypot(*(seen[-1] - seen[0])) > 0.03:
            moving.append(sight.t_s)
        if len(set(moving)) not in which:
            return sight
        points = dict(zip(sight.points, reversed(sight.points.values()), strict=True))
        return Sight(sight.t_s, sight.pose + np.array([0.0, 0.0, np.pi]), sight.residual_m, points)

    monkeypatch.setattr(FrameTracker, "look", look)


def test_a_cycle_of_a_snake_whose_markers_change_places_once_is_not_stable(rigged, monkeypatch):  # noqa: F811
    on = rigged()
    exchanging(monkeypatch, {4})
    driven = on.platform.drive(np.array([GENTLE, GENTLE], np.float32))
    assert driven.leaps == 1
    assert driven.poses[:, 8].tolist() == [1.0, 0.0, 1.0]


def test_markers_that_stay_exchanged_pause_the_trial(rigged, monkeypatch):  # noqa: F811
    on = rigged()
    exchanging(monkeypatch, set(range(4, 1000)))
    with pytest.raises(TrialPausedError, match=r"seen where it cannot have moved to for 0\.\d s"):
        on.platform.drive(np.array([GENTLE] * 3, np.float32))
    assert not any(servo.get("torque_enable") for servo in on.emulation.servos)
