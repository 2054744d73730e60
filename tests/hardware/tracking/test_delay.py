"""Poses are stamped when they were filmed: the tracker's delay, measured by the robot's own motion, and what a trial does."""

from contextlib import contextmanager
from dataclasses import replace
from types import SimpleNamespace

import mujoco
import numpy as np
import pytest

from bns.errors import HardwareError
from bns.hardware.delay import Motion, delay_between
from bns.hardware.emulators.faults import Fault, FaultPlan
from bns.hardware.guard.client import GuardedPlatform
from bns.hardware.rig import shipped_rig
from bns.hardware.safety import Stopping
from bns.hardware.servos.shape import apart_m
from bns.hardware.tracking.kinds import checked, delay_of
from bns.physics.snake.body import Body
from bns.physics.snake.parameters import shipped_parameters
from bns.trial.delay import measured_delay
from bns.trial.session import TrialSetup, open_rig

ARUCO = {"kind": "aruco", "camera": 0, "calibration": "x", "side_m": 0.09, "height_m": 0.07}


def setup(tracker, late_s, **more):
    rig = shipped_rig("khepera")
    rig = replace(rig, tracker={**(tracker or rig.tracker), **more})
    plan = FaultPlan((Fault("late-tracker", at_s=0.0, for_s=late_s),)) if late_s else FaultPlan()
    return TrialSetup(rig, emulated=True, speed=np.inf, plan=plan)


@pytest.mark.parametrize(("tracker", "late_s"), [(None, 0.0), (None, 0.15), (ARUCO, 0.0), (ARUCO, 0.07), (ARUCO, 0.15)])
@pytest.mark.slow
def test_a_late_tracker_is_found_out(tracker, late_s):
    """A camera's fifteen pictures a second are taken when they are stamped, or so much before.

    What the kernel's smoothing does to a Wii remote's lights comes on top of its delay.
    """
    found = measured_delay(setup(tracker, late_s))
    low_s, high_s = (-0.003, 0.003) if tracker else (-0.003, 0.015)
    assert low_s < found.delay_s - late_s < high_s
    assert found.error_s < 0.003


@pytest.mark.slow
@pytest.mark.parametrize(("driver", "most_s"), [({}, 0.005), ({"wiring": "bridge"}, 0.009)])
def test_a_snake_finds_out_by_bending(driver, most_s):
    """An emulated bridge reads its servos when it is asked, half of the 17 ms of its answer before the middle."""
    rig = shipped_rig("snake")
    rig = replace(rig, driver={**rig.driver, **driver})
    plan = FaultPlan((Fault("late-tracker", at_s=0.0, for_s=0.1),))
    found = measured_delay(TrialSetup(rig, emulated=True, speed=np.inf, plan=plan), seconds=7.5)
    assert found.delay_s == pytest.approx(0.1, abs=most_s)
    assert found.error_s < 0.003


def test_the_markers_are_as_far_apart_as_mujoco_has_them():
    parameters = shipped_parameters()
    body, draw = Body(parameters), np.random.default_rng(0)
    assert apart_m([0.0] * 12, parameters) == pytest.approx(parameters.marker_gap_m)
    for _ in range(5):
        joints = draw.uniform(-0.9, 0.9, 12)
        body.lay_straight((0.0, 0.0))
        body.data.qpos[7:] = joints
        mujoco.mj_forward(body.model, body.data)
        yellow, green = body.data.site_xpos[body.sites]
        assert apart_m(joints.tolist(), parameters) == pytest.approx(np.linalg.norm(green - yellow), abs=1e-9)


def test_a_guarded_platform_moves_about_only_if_its_own_can(tmp_path):
    told = []
    guard = SimpleNamespace(tripped=lambda: None, stop_now=None, arm=lambda: told.append("a"), still=lambda: told.append("s"))
    able = SimpleNamespace(move_about=told.append)
    GuardedPlatform(able, guard, Stopping()).move_about(3.0)
    assert told == ["a", 3.0, "s"]
    assert not hasattr(GuardedPlatform(SimpleNamespace(), guard, Stopping()), "move_about")


@pytest.mark.slow
def test_what_is_known_already_is_part_of_the_delay():
    assert measured_delay(setup(ARUCO, 0.1, delay_s=0.04)).delay_s == pytest.approx(0.1, abs=0.003)


def driven(how, commands):
    with Stopping() as stopping, open_rig(how, 0, None, stopping) as opened:
        emulation = opened.operator._emulation
        found = opened.platform.drive(np.array(commands, np.float32))
        asked_s = emulation.body._segments[1][0] - emulation.robot._latency_s / 2
    return found, lambda t_s: emulation.body.seen(asked_s + t_s)[:2]


@pytest.mark.parametrize("corrected", [True, False])
def test_rows_of_a_trial_are_stamped_when_they_were_filmed(corrected):
    """With a camera 120 ms late, poses compared with where the robot was: which shift of time brings the true path nearest."""
    how = setup(ARUCO, 0.12, **({"delay_s": 0.12} if corrected else {}))
    found, true = driven(how, [[20000, 12000, 1500], [8000, 20000, 1500], [15000, 15000, 1000]])
    shifts, off_s = np.arange(-0.3, 0.3, 0.001), []
    for row in [row for row in found.rows if 0.5 < row["t_s"] < found.rows[-1]["t_s"] - 0.3]:
        path = np.array([true(row["t_s"] - shift) for shift in shifts])
        off_s.append(shifts[np.argmin(np.hypot(*(path - [row["x_m"], row["y_m"]]).T))])
    if corrected:
        assert np.abs(off_s).max() <= 0.005
    else:
        assert np.median(off_s) == pytest.approx(0.12, abs=0.005)


def test_commands_end_where_the_robot_was_when_they_ended():
    commands = np.array([[20000, 20000, 1500], [6000, 20000, 1500]])
    found, true = driven(setup(ARUCO, 0.12, delay_s=0.12), commands)
    for pose, t_s in zip(found.poses[1:], np.cumsum(found.commands[:, 2]) / 1000, strict=True):
        assert np.hypot(*(pose[:2] - true(t_s))) < 0.004
    np.testing.assert_allclose(found.commands[:, 2], commands[:, 2], atol=60)


def turns(late_s, slope=1.0, noise=0.0, seed=0):
    draw = np.random.default_rng(seed)
    robot_s = np.arange(0.0, 12.0, 0.05)
    heading = lambda t: np.sin(2.1 * t) + 0.6 * np.sin(5.3 * t + 1.0)  # noqa: E731
    seen_s = np.arange(0.0, 12.0, 0.033)
    seen = slope * heading(seen_s - late_s) + 0.02 * seen_s + 0.3 + noise * draw.standard_normal(len(seen_s))
    return Motion(robot_s, 0.04 * heading(robot_s), seen_s, seen)


@pytest.mark.parametrize("late_s", [-0.05, 0.0, 0.08, 0.3])
def test_the_delay_is_that_of_the_motion_whatever_scale_and_drift(late_s):
    found = delay_between(turns(late_s, slope=1.3, noise=0.01))
    assert found.delay_s == pytest.approx(late_s, abs=0.003)


def test_the_delay_by_which_times_were_corrected_already_is_added():
    assert delay_between(turns(0.08), known_s=0.04).delay_s == pytest.approx(0.12, abs=0.003)


def test_the_standard_error_is_the_scatter():
    found = [delay_between(turns(0.1, noise=0.05, seed=seed)) for seed in range(40)]
    scatter = np.std([one.delay_s for one in found])
    assert np.mean([one.error_s for one in found]) == pytest.approx(scatter, rel=0.4)


@pytest.mark.parametrize(
    ("given", "message"),
    [
        (turns(0.1)._replace(seen_s=np.arange(3.0), seen=np.zeros(3)), "was seen 3 times"),
        (turns(0.1, slope=0.0, noise=0.1), "does not follow the robot's own motion"),
        (turns(0.9), "does not follow the robot's own motion"),
    ],
)
def test_what_tells_no_delay_is_refused(given, message):
    with pytest.raises(HardwareError, match=message):
        delay_between(given)


def test_a_delay_may_be_up_to_a_second_either_way():
    assert [delay_of({"delay_s": given}) for given in (-1, -0.02, 0, 1.0)] == [-1.0, -0.02, 0.0, 1.0]
    for given in (-1.01, 1.01, np.nan, True):
        with pytest.raises(HardwareError, match="it is a number of seconds, up to 1"):
            checked({**ARUCO, "delay_s": given})


def test_a_delay_that_makes_no_sense_is_named():
    with pytest.raises(HardwareError, match="delay_s is 'late'; it is a number of seconds, up to 1"):
        measured_delay(setup(None, 0.0, delay_s="late"))


def test_without_anybody_to_ask_nothing_moves(monkeypatch):
    moved = []
    platform = SimpleNamespace(move_about=moved.append)

    @contextmanager
    def opened(*_):
        yield SimpleNamespace(platform=platform)

    def ended(_question):
        raise EOFError

    monkeypatch.setattr("bns.trial.delay.open_rig", opened)
    monkeypatch.setattr("builtins.input", ended)
    with pytest.raises(HardwareError, match="nobody to ask before the robot moves"):
        measured_delay(TrialSetup(shipped_rig("khepera")))
    assert not moved
