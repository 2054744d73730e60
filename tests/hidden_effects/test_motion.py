"""The generator against closed forms: it judges others, so it has to be right by itself."""

import numpy as np
import pytest

from tests.hidden_effects.driving import Driving
from tests.hidden_effects.listed import (
    AccelerationLimit,
    BatterySag,
    CameraRotation,
    ClockOffset,
    CommandDelay,
    DeadZone,
    FloorSlope,
    MarkerOffset,
    MotorLag,
    SideSlip,
    SpeedGain,
    SpeedLimit,
    TetherPull,
    TurnSlip,
    Wheelbase,
    WheelMismatch,
    YawBias,
)  # fmt: skip
from tests.hidden_effects.listed_floor import FloorPatch
from tests.hidden_effects.listed_loads import ControllerOvershoot
from tests.hidden_effects.listed_motors import Backlash, StartDelay
from tests.hidden_effects.luck import luck
from tests.hidden_effects.motion import mean_commands, move
from tests.hidden_effects.unlisted import Kicks, Swing
from tests.hidden_effects.unlisted_motors import (
    LeftOvershoot,
    LooseWheel,
    LostPulses,
    SpeedLag,
    Stalls,
    WeakSupply,
)

BASE_M = 0.1


def driving(*commands, session_s=0.0):
    """One trial of commands (left, right, seconds) from (0, 0) heading north."""
    lasts = np.array([command[2] for command in commands])
    edges = np.concatenate([[0.0], np.cumsum(lasts)])[None]
    wheels = np.array([command[:2] for command in commands], float)[None]
    start = np.array([[0.0, 0.0, np.pi / 2]])
    return Driving(wheels, edges, np.array([len(commands)]), start, np.array([session_s]))


def poses_at(times_s, causes, *commands, session_s=0.0):
    """Poses (times, 3)."""
    told = driving(*commands, session_s=session_s)
    paths = move(told, BASE_M, causes, np.zeros_like(told.wheels_m_s), luck(0, "test"))
    return paths.at(0, np.array(times_s))


def pose_after(causes, *commands, at=None, session_s=0.0):
    """Pose (3,) at `at`, or at the end of the last command."""
    ends_s = sum(command[2] for command in commands)
    return poses_at([ends_s if at is None else at], causes, *commands, session_s=session_s)[0]


def arc(left, right, seconds, base=BASE_M, x=0.0, y=0.0, heading=np.pi / 2):
    """Where a robot of two wheels comes to: the textbook's circle."""
    v, w = (left + right) / 2, (right - left) / base
    r, turned = v / w, heading + w * seconds
    return np.array([x + r * (np.sin(turned) - np.sin(heading)), y - r * (np.cos(turned) - np.cos(heading)), turned])


def test_a_command_is_an_arc():
    np.testing.assert_allclose(pose_after([], (0.05, 0.12, 2.3)), arc(0.05, 0.12, 2.3), atol=1e-9)


def test_a_command_that_ends_between_steps_loses_nothing():
    np.testing.assert_allclose(pose_after([], (0.1, 0.1, 1.00037), at=1.2), [0, 0.100037, np.pi / 2], atol=1e-9)


@pytest.mark.parametrize(
    ("cause", "left", "right", "base"),
    [
        (SpeedGain(1.1), 0.055, 0.11, 0.1),
        (WheelMismatch(1.25), 0.05 * 2 / 2.25, 0.1 * 2.5 / 2.25, 0.1),
        (Wheelbase(1.2), 0.05, 0.1, 0.12),
        (DeadZone(0.01), 0.04, 0.09, 0.1),
        (SpeedLimit(0.07), 0.05, 0.07, 0.1),
        (YawBias(0.2), 0.04, 0.11, 0.1),
        (BatterySag(1e-4), 0.044995, 0.08999, 0.1),
    ],
)
def test_effects_that_only_change_the_arc(cause, left, right, base):
    """The battery 1000 s into the session; its mean speed is that of the middle second."""
    session = 1000.0 if isinstance(cause, BatterySag) else 0.0
    expected = arc(left, right, 2.0, base)
    tolerance = 1e-6 if isinstance(cause, BatterySag) else 1e-9
    np.testing.assert_allclose(pose_after([cause], (0.05, 0.1, 2.0), session_s=session), expected, atol=tolerance)


def test_lag_is_a_first_order_step_response():
    tau, t = 0.3, 1.1
    way = 0.1 * (t - tau * (1 - np.exp(-t / tau)))
    np.testing.assert_allclose(pose_after([MotorLag(tau)], (0.1, 0.1, 2.0), at=t)[1], way, atol=1e-8)


def test_a_slow_motor_loses_half_its_run_up():
    limit = pose_after([AccelerationLimit(0.25)], (0.1, 0.1, 2.0))
    np.testing.assert_allclose(limit[1], 0.1 * 2.0 - 0.1**2 / (2 * 0.25), atol=1e-7)


def test_delay_and_late_clock_are_the_same_from_outside():
    commands = [(0.05, 0.1, 1.0), (0.1, 0.02, 0.7)]
    late = pose_after([CommandDelay(0.1)], *commands, at=1.5)
    np.testing.assert_allclose(late, pose_after([], *commands, at=1.4), atol=1e-9)
    assert ClockOffset(0.1).late_s == CommandDelay(0.1).delay_s


def test_turning_slip_shortens_the_arc_and_keeps_the_turn():
    v, w = 0.075 * (1 - 0.2 * 0.5), 0.5
    expected = [-(v / w) * (1 - np.cos(w * 2)), (v / w) * np.sin(w * 2), np.pi / 2 + w * 2]
    np.testing.assert_allclose(pose_after([TurnSlip(0.2)], (0.05, 0.1, 2.0)), expected, atol=1e-9)


def test_side_slip_is_outwards_in_a_left_turn():
    v, w, k, t = 0.075, 0.5, 0.3, 0.01
    x, y, _ = pose_after([SideSlip(k)], (0.05, 0.1, 2.0), at=t)
    assert x == pytest.approx(k * v * w * t - v * w * t**2 / 2, rel=1e-3), "heading north, outwards is east"
    assert y == pytest.approx(v * t, rel=1e-3)


def test_slope_and_yaw_act_only_while_a_wheel_turns():
    slope = pose_after([FloorSlope(0.01, -0.02)], (0.1, 0.1, 1.0), at=1.4)
    np.testing.assert_allclose(slope, [0.01, 0.08, np.pi / 2], atol=3e-5)
    standing = pose_after([FloorSlope(0.01, -0.02), YawBias(0.5)], (0.0, 0.0, 2.0))
    np.testing.assert_allclose(standing, [0, 0, np.pi / 2], atol=1e-12)


def test_a_tether_pulls_exponentially():
    pull, t = 0.05, 3.0
    x = pose_after([TetherPull(2.0, 0.0, pull)], (0.1, 0.1, t))[0]
    assert x == pytest.approx(2.0 * (1 - np.exp(-pull * t)), abs=1e-5)


def test_camera_effects_move_what_is_seen():
    poses = np.array([[[1.0, 0.0, np.pi / 2]]])
    np.testing.assert_allclose(MarkerOffset(0.1, 0.02).seen(poses)[0, 0], [0.98, 0.1, np.pi / 2])
    np.testing.assert_allclose(CameraRotation(np.pi / 2).seen(poses)[0, 0], [0, 1, np.pi / 2], atol=1e-15)


def test_backlash_costs_the_gap_at_each_reversal():
    gap = 0.004
    y = pose_after([Backlash(gap)], (0.1, 0.1, 1.0), (-0.1, -0.1, 1.0), (0.1, 0.1, 1.0))[1]
    assert y == pytest.approx(0.1, abs=1e-9), "0.1 forth, 0.1 - gap back, 0.1 - gap forth"
    back = pose_after([Backlash(gap)], (0.1, 0.1, 1.0), (-0.1, -0.1, 1.0))[1]
    assert back == pytest.approx(gap, abs=1e-9)


def test_a_sticky_patch_slows_inside_only():
    y = pose_after([FloorPatch(0.0, 0.0, 0.1, 0.5)], (0.1, 0.1, 3.0))[1]
    assert y == pytest.approx(0.1 + 0.1 * (3.0 - 2.0), abs=2e-4)


def test_both_integrators_agree():
    rng = luck(1, "twins")
    told = Driving(
        rng.uniform(-0.2, 0.2, (3, 4, 2)), np.cumsum(np.full((3, 5), 0.3), axis=1) - 0.3, np.full(3, 4),
        rng.normal(size=(3, 3)), np.zeros(3),
    )  # fmt: skip
    free = move(told, BASE_M, [MotorLag(0.1), SideSlip(0.2), FloorSlope(0.01, 0.02)], np.zeros((3, 4, 2)), rng)
    no_pull = [MotorLag(0.1), SideSlip(0.2), FloorSlope(0.01, 0.02), TetherPull(9.0, 9.0, 0.0)]
    pulled = move(told, BASE_M, no_pull, np.zeros((3, 4, 2)), rng)
    np.testing.assert_allclose(pulled.poses, free.poses, atol=1e-9)


def test_mean_commands_keep_the_integral():
    told = driving((0.1, -0.1, 0.0333), (0.05, 0.2, 0.0501))
    t = np.arange(0, 0.2, 0.01)
    means = mean_commands(told.edges_s, told.wheels_m_s, t)
    np.testing.assert_allclose(means.sum(axis=1)[0] * 0.01, [0.1 * 0.0333 + 0.05 * 0.0501, -0.00333 + 0.2 * 0.0501])


def test_a_wheel_that_starts_late_loses_that_time_after_each_halt():
    y = pose_after([StartDelay(0.15)], (0.1, 0.1, 1.0), (0.05, 0.05, 1.0), (0.0, 0.0, 0.5), (0.1, 0.1, 1.0))[1]
    assert y == pytest.approx(0.1 * 0.85 + 0.05 + 0.1 * 0.85, abs=3e-4)


def textbook_overshoot(t, frequency_hz, damping):
    """Way after a step to 1 m/s: the integral of 1 - exp(-damping wn t) (cos wd t + damping wn / wd sin wd t)."""
    wn = 2 * np.pi * frequency_hz
    wd = wn * np.sqrt(1 - damping**2)
    decay = np.exp(-damping * wn * t)
    return t - 2 * damping / wn + decay * (2 * damping / wn * np.cos(wd * t) + (2 * damping**2 - 1) / wd * np.sin(wd * t))


@pytest.mark.slow
@pytest.mark.parametrize(("told", "ratio"), [((0.1, 0.1), 3.0), ((-0.1, 0.1), 1.0)])
def test_overshoot_is_the_step_response_of_the_textbook(told, ratio):
    frequency_hz, damping, t = 2.0, 0.4, np.linspace(0.1, 1.5, 8)
    wn = 2 * np.pi * frequency_hz
    cause = ControllerOvershoot(2 * damping / wn, 0.0, 1 / wn, ratio)
    seen = poses_at(t, [cause], (*told, 2.0))
    way = seen[:, 1] if told[0] > 0 else (seen[:, 2] - np.pi / 2) * BASE_M / 2
    np.testing.assert_allclose(way, 0.1 * textbook_overshoot(t, frequency_hz, damping), atol=1.5e-4)


@pytest.mark.slow
def test_in_turns_a_wheel_swings_with_the_inertia_that_it_moves_then():
    wn, t = 2 * np.pi * 2.0, np.linspace(0.1, 1.5, 8)
    cause = ControllerOvershoot(0.8 / wn, 0.0, 1 / wn, 4.0)  # half the frequency, half the damping ratio
    turned = poses_at(t, [cause], (-0.1, 0.1, 2.0))[:, 2] - np.pi / 2
    np.testing.assert_allclose(turned * BASE_M / 2, 0.1 * textbook_overshoot(t, 1.0, 0.2), atol=1.5e-4)


@pytest.mark.slow
def test_the_proportional_part_makes_a_start_lose_less_until_the_way_is_late_by_tau():
    t = np.array([0.1, 3.0])
    plain, led = (t - poses_at(t, [ControllerOvershoot(0.1, lead, 0.1)], (0.1, 0.1, 3.0))[:, 1] / 0.1 for lead in (0.0, 0.3))
    assert led[0] < 0.8 * plain[0]
    assert [plain[1], led[1]] == pytest.approx([0.1, 0.1], abs=1e-3)


def test_a_left_wheel_overshoots_alone():
    wn, t = 2 * np.pi * 2.0, np.linspace(0.1, 1.5, 8)
    seen = poses_at(t, [LeftOvershoot(2.0, 0.4)], (0.1, 0.1, 2.0))[:, 2] - np.pi / 2
    np.testing.assert_allclose(seen * BASE_M, 0.1 * (t - textbook_overshoot(t, wn / 2 / np.pi, 0.4)), atol=3e-4)


def test_lag_grows_with_speed():
    slow, fast = (pose_after([SpeedLag(0.2, 0.2)], (v, v, 3.0))[1] / v for v in (0.05, 0.2))
    assert 3.0 - slow == pytest.approx(0.05, abs=2e-3)
    assert 3.0 - fast == pytest.approx(0.2, abs=2e-3)


def test_stalls_take_the_share_of_time_that_they_last():
    turned = pose_after([Stalls(0.5, 0.2)], (0.1, 0.1, 200.0))[2] - np.pi / 2
    assert turned * BASE_M / (0.1 * 200) == pytest.approx(1 - np.exp(-0.5 * 0.2), rel=0.25)


def test_a_wheel_comes_loose_in_the_session():
    command = (0.1, 0.1, 1.0)
    assert pose_after([LooseWheel(0.1, 500.0)], command, session_s=400.0)[2] == pytest.approx(np.pi / 2)
    turned = pose_after([LooseWheel(0.1, 500.0)], command, session_s=600.0)[2] - np.pi / 2
    assert turned == pytest.approx(0.1 * 0.1 / BASE_M)


def test_each_wheel_slows_the_other():
    np.testing.assert_allclose(
        pose_after([WeakSupply(0.1, 0.2)], (0.05, 0.1, 2.0)), arc(0.05 * 0.95, 0.1 * 0.975, 2.0), atol=1e-9
    )


def test_a_swing_is_over_after_its_period():
    assert pose_after([Swing(0.1, 2.0)], (0.1, 0.1, 2.0))[2] == pytest.approx(np.pi / 2, abs=2e-4)
    half = pose_after([Swing(0.1, 2.0)], (0.1, 0.1, 2.0), at=1.0)[2] - np.pi / 2
    assert half == pytest.approx(0.1 * 2.0 / np.pi, abs=2e-4)


def test_kicks_come_as_often_as_is_said():
    told = pose_after([Kicks(0.5, 0.01)], (0.1, 0.1, 200.0))[2] - np.pi / 2
    kicks = round(told / 0.01)
    assert told == pytest.approx(0.01 * kicks, abs=1e-6)
    assert 0 < abs(kicks) < 40


def test_a_wheel_whose_counter_misses_pulses_above_a_speed_is_too_fast_there_in_both_directions():
    said = LostPulses(0.1, 0.5).command(np.array([[[0.05, -0.1], [0.2, -0.15]]]))
    np.testing.assert_allclose(said, [[[0.05, -0.1], [0.3, -0.2]]])
