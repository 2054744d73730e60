"""A stretch of a robot on joints is simulated from so long before that it does not show where its joints began."""

import numpy as np
import pytest

import bns
from bns.api.common.prepared import prepared
from bns.diagnose.data.bodies.joints import joint_tracks
from bns.diagnose.predict import run_ups
from bns.diagnose.predict.run_ups import joint_stretches
from bns.physics.jointed.drives import at_times
from bns.physics.jointed.mechanism import Mechanism
from tests.jointed.arm import JOINTS, log, xml

SITES = ("elbow", "hand")


QUICK = xml(stiffness=200.0).replace('damping="1.0"', 'damping="8.0"').replace("-3 3", "-300 300")


SLOW = xml()


def run_up_s(table, text=SLOW):
    return {told.run_up_s for told in joint_stretches(joint_tracks(table)[0], Mechanism(text, SITES)).told}


def one_row(began, seen_s, run_up_s):
    t, told = np.array([0.0, 1.0, 5.0]), np.array([[1.0], [2.0], [3.0]])
    return at_times(t, told, seen_s, 0.1, np.zeros(3), run_up_s=run_up_s, began=began).set_points[:, 0]


def test_a_run_up_is_as_long_as_asked_and_begins_in_the_trial_s_posture():
    home = np.array([0.0])
    assert one_row(home, (4.0, 5.5), 2.0)[[0, 29, 30]].tolist() == [2, 2, 3]
    assert one_row(home, (4.0, 5.5), 4.0)[[0, 1, 9, 10, 49, 50]].tolist() == [0, 1, 1, 2, 2, 3]
    assert one_row(None, (4.0, 5.5), 8.0)[[0, 9, 10]].tolist() == [1, 1, 2]


@pytest.mark.parametrize(("text", "expected_s"), [(SLOW, 4.0), (QUICK, 2.0)])
def test_slow_joints_need_a_longer_run_up(text, expected_s):
    """The log is that of the slow ones in both."""
    assert run_up_s(log(6, noise_m=0.0), text) == {expected_s}


@pytest.mark.parametrize(
    ("shows_m", "expected_s"),
    [([2e-4, 2e-4], 2.0), ([2e-4, 9e-5], 4.0), ([2e-4, 1.1e-4], 2.0), ([9e-3, 4e-3], 8.0), ([9e-5], 2.0)],
)
def test_a_run_up_is_doubled_as_long_as_that_halves_what_shows(shows_m, expected_s, monkeypatch):
    left = list(shows_m)
    monkeypatch.setattr(run_ups, "_shows_m", lambda *_: left.pop(0))
    assert run_up_s(log(2)) == {expected_s}
    assert not left


def test_a_trial_begins_in_the_posture_that_it_shows():
    """The arm's log begins at home; the same log without its first half second, in which it goes to its set points, does not."""
    table = log(4, noise_m=0.0)
    at_home = joint_stretches(joint_tracks(table)[0], Mechanism(xml(), SITES)).told
    assert all(told.began.tolist() == [0, 0, 0] for told in at_home)
    held = [f"{joint}_set_rad" for joint in JOINTS]
    there = log(4, noise_m=0.0).assign(**dict.fromkeys(held, 0.3))
    there[["elbow_x_m", "elbow_y_m"]] = 0.2 * np.array([np.cos(0.3), np.sin(0.3)])
    there[["hand_x_m", "hand_y_m"]] = sum(0.2 * np.array([np.cos(n * 0.3), np.sin(n * 0.3)]) for n in (1, 2, 3))
    assert all(told.began is None for told in joint_stretches(joint_tracks(there)[0], Mechanism(xml(), SITES)).told)


def test_a_trial_that_begins_in_motion_is_compared_after_a_whole_run_up():
    """Of the last trial, the first 0.6 s are missing: the arm moves when it is first seen."""
    table = log(4, noise_m=0.0)
    late = table[(table.trial < 3) | (table.t_s > 0.6)]
    stretches = joint_stretches(joint_tracks(late)[0], Mechanism(xml(), SITES))
    begins = list(zip(np.array(stretches.names)[stretches.trial[stretches.begins]], stretches.told, strict=True))
    assert [round(told.from_s) for name, told in begins if name == "3"] == [4]
    assert [round(told.from_s) for name, told in begins if name == "2"] == [2, 4]


def test_where_no_stretch_has_a_whole_run_up_all_are_compared(monkeypatch):
    left = [9e-3, 1e-5]
    monkeypatch.setattr(run_ups, "_shows_m", lambda *_: left.pop(0))
    table = log(2, noise_m=0.0)
    told = joint_stretches(joint_tracks(table[(table.t_s > 0.6) & (table.t_s < 4.5)])[0], Mechanism(xml(), SITES)).told
    assert [(round(one.from_s), one.run_up_s) for one in told] == [(2, 4.0), (2, 4.0)]


@pytest.mark.parametrize("seen_every", [25, 10])
def test_an_arm_that_is_its_model_ends_within_its_noise(tmp_path, seen_every):
    """In this log a run-up of 2 s ended 45 mm away once, and one from the set points' posture 2 mm."""
    (tmp_path / "arm.xml").write_text(xml())
    predictor = prepared(log(12, seed=5, noise_m=1e-4, seen_every=seen_every), bns.Model(tmp_path / "arm.xml")).predictor
    seen = predictor._simulations.at(predictor._simulations.exactly(predictor._bare)[:, 0], predictor._stretches.since_s)
    assert np.abs(seen - predictor._stretches.points_m).max() < 5e-4


def test_every_frame_is_looked_at_where_it_is_seen(tmp_path):
    """At 10 Hz, or within one of the coarse steps, of 8 ms; and in the steps of either length."""
    (tmp_path / "arm.xml").write_text(xml())
    predictor = prepared(log(3, seen_every=25), bns.Model(tmp_path / "arm.xml")).predictor
    body, tracks = predictor._simulations._body, predictor._stretches
    for level, dt_s in ((body.fine, 0.004), (body.coarse, 0.008)):
        for drive, i in zip(level.simulator.drives, range(len(tracks.told)), strict=True):
            looks_s = (drive.frames - drive.frames[0]) * dt_s
            since_s = tracks.since_s[tracks.stretch == i]
            beside = np.searchsorted(looks_s, since_s[1:-1] + 1e-9, side="right")
            there = np.abs(looks_s[beside - 1] - since_s[1:-1]) < 1e-9
            assert (there | (looks_s[beside] - looks_s[beside - 1] < 0.0081)).all()
            assert np.diff(looks_s).max() < 0.0241


def test_what_is_told_of_a_stretch_has_its_run_up(tmp_path):
    told = joint_stretches(joint_tracks(log(4))[0], Mechanism(xml(), SITES)).told[-1]
    assert told.run_up_s == 4.0
    assert told.commands()["t_s"][-1] == pytest.approx(told.to_s - max(told.from_s - 4.0, 0.0), abs=0.05)


def test_two_bodies_are_compared_on_the_same_stretches_whatever_run_up_each_needs(tmp_path):
    """Trials that begin in motion: of the slow arm more of their beginnings are left out than of the quick one."""
    table = log(trials=4, seed=3)
    table = table[table["t_s"] > 0.6]
    tracks = joint_tracks(table)[0]
    slow, quick = (joint_stretches(tracks, Mechanism(text, SITES)) for text in (SLOW, QUICK))
    assert len(slow.told) < len(quick.told)
    same = joint_stretches(tracks, Mechanism(QUICK, SITES), slow)
    assert run_ups._begun(same) == run_ups._begun(slow)
    assert [told.run_up_s for told in same.told] == [told.run_up_s for told in quick.told][: len(same.told)]
    for name, text in (("slow", SLOW), ("quick", QUICK)):
        (tmp_path / f"{name}.xml").write_text(text)
    bodies = {name: bns.Model(str(tmp_path / f"{name}.xml"), sites=SITES) for name in ("slow", "quick")}
    wrong = bns.compare(table, bodies["slow"], beside=bodies["quick"]).changes.position_m["quick", "stretch"]
    right = bns.compare(table, bodies["quick"], beside=bodies["slow"]).changes.position_m["slow", "stretch"]
    assert right < 2.5e-3  # the log is its own
    assert wrong > 0.1
