"""The robot is believed, not the picture: poses that do not follow what is driven pause the trial; a poor robot does not."""

import itertools
import re
from dataclasses import replace

import numpy as np
import pytest

from bns.errors import TrialPausedError
from bns.hardware.agreement import Agreement, SameScene
from bns.hardware.emulators.faults import Fault, FaultPlan
from bns.hardware.link.hardware_log import events
from bns.hardware.rig import shipped_rig
from bns.hardware.safety import Stopping
from bns.hardware.tracking.sight import Sight
from bns.hardware.wheels.khepera import WHEELBASE_M
from bns.trial.driver import TrialDriver
from bns.trial.operator import UnattendedOperator
from bns.trial.session import TrialSetup, open_rig

ARUCO = {"kind": "aruco", "camera": 0, "calibration": "x", "side_m": 0.09, "height_m": 0.07}
FAST = np.array([[23000, 20000, 6000]], np.float32)
CYCLES = np.tile(np.float32([0.6, 0.4, 0.5, 0.5, 1.0]), (3, 1))
START = np.array([0.0, 0.0, np.pi / 2])


def setup(robot, *faults, **tracker):
    rig = shipped_rig(robot)
    rig = replace(rig, tracker=tracker or rig.tracker)
    return TrialSetup(rig, emulated=True, speed=np.inf, plan=FaultPlan(faults))


def paused(how, commands, journal):
    """Why a drive paused, and how long after three seconds the robot was confirmed to stand."""
    with Stopping() as stopping, pytest.raises(TrialPausedError) as caught, open_rig(how, 0, journal, stopping) as opened:
        opened.platform.drive(commands)
    first = next(e for e in events(journal, "stop") if e["t_s"] > 3.0)
    assert first["confirmed"]
    return str(caught.value), first["t_s"] - 3.0


@pytest.mark.parametrize(("robot", "tracker"), [("khepera", {}), ("khepera", ARUCO), ("snake", {})])
def test_a_scene_that_stands_still_under_a_running_clock_pauses_the_trial(tmp_path, robot, tracker):
    commands = FAST if robot == "khepera" else CYCLES
    why, after_s = paused(setup(robot, Fault("frozen-scene", at_s=3.0, for_s=99.0), **tracker), commands, tmp_path / "j.jsonl")
    assert re.search("no motion|both markers where they were", why)
    assert "bns track" in why
    assert after_s <= (0.7 if robot == "khepera" else 1.0)


def test_a_camera_that_sends_the_same_bits_again_and_again_stops_the_robot(tmp_path):
    how = setup("khepera", Fault("stuck-marker", at_s=3.0, for_s=99.0), **ARUCO)
    with Stopping() as stopping, open_rig(how, 0, tmp_path / "j.jsonl", stopping) as opened:
        ended = opened.platform.drive(FAST).ended
    assert ended.startswith("the camera has sent no new picture for 0.")
    first = next(e for e in events(tmp_path / "j.jsonl", "stop") if e["t_s"] > 3.0)
    assert first["t_s"] - 3.0 <= 0.6


@pytest.mark.parametrize("at_s", [3.0, 3.03, 3.06, 3.09])
def test_a_picture_that_is_overdue_is_missed_at_once_and_not_at_the_next_look(tmp_path, at_s):
    """Within `picture_s` of the last one, whenever that came: a look a tenth of a second would find it up to so much later."""
    how = setup("khepera", Fault("stuck-marker", at_s=at_s, for_s=99.0), **ARUCO)
    with Stopping() as stopping, open_rig(how, 0, tmp_path / "j.jsonl", stopping) as opened:
        assert opened.platform.drive(FAST).ended.startswith("the camera has sent no new picture for 0.2")
    first = next(e for e in events(tmp_path / "j.jsonl", "stop") if e["t_s"] > at_s)
    assert first["t_s"] - first["seconds"] - at_s <= 0.27


def stands_unseen(speed_m_s, every_s=0.01):
    """How long a robot that is ordered to go on is seen where it was, until the trial pauses; whether that was suspected."""
    agreement = Agreement(0.5, WHEELBASE_M)
    agreement.ordered(0.0, speed_m_s, speed_m_s)
    for t_s in np.arange(0.0, 9.0, every_s).tolist():
        suspected = agreement.suspects
        try:
            agreement.seen(Sight(t_s, START))
        except TrialPausedError:
            return t_s, suspected
    raise AssertionError("it never paused")


@pytest.mark.parametrize(("speed_m_s", "within_s"), [(0.06, (0.5, 0.55)), (0.1, (0.38, 0.42)), (0.3, (0.29, 0.32))])
def test_two_centimetres_unseen_are_a_frozen_scene_and_a_tenth_of_a_second_at_full_speed(speed_m_s, within_s):
    """Orders count from 0.2 s on. A camera may be late, which is no way for a slow robot and centimetres for a fast one."""
    lasted_s, suspected = stands_unseen(speed_m_s)
    assert within_s[0] <= lasted_s <= within_s[1]
    assert suspected


def turns_back(speed_m_s, phase_s, tau_s=0.08, frozen_s=np.inf, orders=4):
    """A robot that goes to and fro each second, its wheels late, looked at as in a drive: when what is seen pauses it."""
    agreement, y_m, is_m_s, look_s, shown = Agreement(0.5, WHEELBASE_M), 0.0, 0.0, phase_s, START
    for step in range(100 * orders):
        t_s = step / 100
        if step % 100 == 0:
            asked_m_s = speed_m_s * (-1) ** (step // 100)
            agreement.ordered(t_s, asked_m_s, asked_m_s)
        is_m_s += (asked_m_s - is_m_s) * 0.01 / tau_s
        y_m += 0.01 * is_m_s
        if t_s < look_s:
            continue
        shown = START + np.array([0.0, y_m, 0.0]) if t_s < frozen_s else shown
        try:
            agreement.seen(Sight(t_s, shown))
        except TrialPausedError:
            return t_s
        look_s = t_s + (0.03 if agreement.suspects else 0.1)
    return np.inf


@pytest.mark.parametrize("speed_m_s", [0.05, 0.08, 0.1, 0.12, 0.15, 0.2, 0.3])
@pytest.mark.parametrize("tau_s", [0.04, 0.08])
def test_a_robot_that_turns_back_is_where_it_was_and_neither_held_nor_filmed_by_a_camera_that_hangs(speed_m_s, tau_s):
    assert {turns_back(speed_m_s, phase_s / 100, tau_s) for phase_s in range(10)} == {np.inf}


@pytest.mark.parametrize("speed_m_s", [0.05, 0.1, 0.2])
def test_a_picture_that_stands_still_while_a_robot_turns_back_is_found_as_much_later_as_that_takes(speed_m_s):
    usual_s = max(turns_back(speed_m_s, phase_s / 100, frozen_s=0.5) - 0.5 for phase_s in range(10))
    late_s = [turns_back(speed_m_s, phase_s / 100, frozen_s=0.9) - 0.9 for phase_s in range(10)]
    assert max(late_s) <= usual_s + 0.2 + 0.03


def test_a_robot_that_stands_by_order_is_not_suspected():
    agreement = Agreement(0.5, WHEELBASE_M)
    agreement.ordered(0.0, 0.0, 0.0)
    for t_s in np.arange(0.0, 9.0, 0.1).tolist():
        agreement.seen(Sight(t_s, START))
    assert not agreement.suspects


def test_a_marker_that_points_another_way_pauses_the_trial():
    """Ahead is 113 degrees from where the robot goes."""
    agreement, goes = Agreement(0.5, WHEELBASE_M), np.radians(90 - 113)
    agreement.ordered(0.0, 0.1, 0.1)
    with pytest.raises(TrialPausedError, match="is the marker turned on the robot"):
        straight(agreement, goes)


def straight(agreement, goes):
    for t_s in np.arange(0.0, 3.0, 0.1):
        agreement.seen(Sight(t_s, np.array([0.1 * t_s * np.cos(goes), 0.1 * t_s * np.sin(goes), np.pi / 2])))


def test_a_robot_put_down_the_wrong_way_round_is_said_before_it_drives(tmp_path):
    how = setup("khepera")
    with Stopping() as stopping, open_rig(how, 0, tmp_path / "j.jsonl", stopping) as opened:
        opened.operator._emulation.put_down(START + np.array([0.0, 0.0, np.radians(113)]))
        driver = TrialDriver(opened.platform, UnattendedOperator(), how.rig, START, opened.clock, opened.log)
        with pytest.raises(TrialPausedError, match="turned by 113°"):
            driver.evaluate(1, FAST)
    assert not list(events(tmp_path / "j.jsonl", "command"))


@pytest.mark.parametrize("share", [0.0, 0.3])
def test_wheels_that_do_not_turn_as_ordered_pause_the_trial(tmp_path, share):
    how = setup("khepera")
    with Stopping() as stopping, open_rig(how, 0, None, stopping) as opened:
        body = opened.operator._emulation.body
        order = body.order
        body.order = lambda left, right, t_s: order(left * share, right, t_s)
        with pytest.raises(TrialPausedError, match=r"wheels do not turn as|from where its commands lead"):
            opened.platform.drive(FAST)


@pytest.mark.parametrize("latency_s", [0.02, 0.3])
def test_what_a_sound_robot_does_is_never_taken_for_a_disagreement(latency_s):
    """Random commands in the world with all its effects; a slow link, too."""
    draw = np.random.default_rng(3)
    with Stopping() as stopping, open_rig(setup("khepera"), 0, None, stopping) as opened:
        opened.operator._emulation.robot._latency_s = latency_s
        for _ in range(12):
            opened.operator._emulation.put_down(START)
            commands = np.column_stack([draw.uniform(0, 30000, (4, 2)), draw.uniform(300, 2500, 4)])
            assert opened.platform.drive(commands.astype(np.float32)).stop.confirmed


@pytest.mark.parametrize(("left", "right"), [(0.7, 0.7), (1.3, 1.3), (0.8, 1.0), (1.0, 1.25)])
def test_a_poor_robot_is_one_to_be_diagnosed(left, right):
    """A third slower or faster than ordered, or pulling to a side by a fifth of its speed."""
    follow(lambda v, w: (v * left, w * right))


@pytest.mark.parametrize(("left", "right"), [(0.2, 0.2), (2.5, 2.5), (-1.0, 1.0), (0.0, 1.0)])
def test_one_that_does_something_else_is_not(left, right):
    with pytest.raises(TrialPausedError):
        follow(lambda v, w: (v * left, w * right))


def test_short_disagreements_far_apart_do_not_pause_the_trial_and_a_long_one_does():
    agreement = Agreement(0.5, WHEELBASE_M)
    agreement.ordered(0.0, 0.0, 0.0)

    def seen(tenths, *aside):
        for tenth in tenths:
            agreement.seen(Sight(tenth / 10, START + np.array([0.1 * (tenth in aside), 0.0, 0.0])))

    seen(range(120), 30, 31, 32, 70, 71, 72)
    with pytest.raises(TrialPausedError, match="10 cm from where its commands lead"):
        seen(range(120, 130), *range(120, 130))


def follow(really, seconds=12.0):
    """A robot whose wheels do something of what is ordered, seen ten times a second."""
    agreement, pose, draw = Agreement(0.5, WHEELBASE_M), START.copy(), np.random.default_rng(0)
    for step, t_s in enumerate(np.arange(0.0, seconds, 0.01)):
        if step % 150 == 0:
            ordered = draw.uniform(0.02, 0.2, 2)
            agreement.ordered(t_s, *ordered)
            lag = ordered
        v, w = really(*lag)
        pose = pose + 0.01 * np.array([(v + w) / 2 * np.cos(pose[2]), (v + w) / 2 * np.sin(pose[2]), (w - v) / WHEELBASE_M])
        if step % 10 == 0:
            agreement.seen(Sight(t_s, pose + 0.001 * draw.standard_normal(3)))


def test_a_scene_is_the_same_as_long_as_no_point_moves():
    scene, points = SameScene(0.003), np.zeros((2, 2))
    made = [scene.since_it_moved(points + np.array([[0.0, 0.0], [0.0005 * step, 0.0]]), 0.1 * step) for step in range(12)]
    assert made[6] == pytest.approx(0.6)
    assert made[7] == 0.0
    assert all(a < b for a, b in itertools.pairwise(made[:7]))
