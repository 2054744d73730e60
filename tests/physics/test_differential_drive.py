"""Drives whose result is known on paper."""

from dataclasses import replace

import numpy as np
import pytest

from bns.bootstrap.simulators import GROWTH, STEP_S
from bns.errors import ModelError
from bns.physics.model import Model
from bns.physics.wheels.differential_drive import observe, simulate, track
from bns.physics.wheels.grid import step_grid

B = 0.0884
IDEAL = Model(wheelbase_m=B)


def end(model, left, right, duration, **kwargs):
    return simulate(model, [[left]], [[right]], [[duration]], **kwargs)[0, -1]


def test_straight_line_along_the_heading():
    pose = end(IDEAL, 0.2, 0.2, 1.2345, start=(1.0, 2.0, np.pi / 6))
    way = 0.2 * 1.2345
    np.testing.assert_allclose(pose, [1 + way * np.cos(np.pi / 6), 2 + way / 2, np.pi / 6], atol=1e-12)


def test_turn_on_the_spot_is_counter_clockwise_and_unwrapped():
    np.testing.assert_allclose(end(IDEAL, -0.2, 0.2, 5.0), [0, 0, 0.4 / B * 5], atol=1e-12)


@pytest.mark.parametrize("dt", [0.001, 0.005, 0.1])
def test_arc_is_exact_at_any_step(dt):
    angle, radius = 0.1 / B * 1.7003, 0.15 / (0.1 / B)
    pose = end(Model(wheelbase_m=B, dt_s=dt), 0.1, 0.2, 1.7003)
    expected = [radius * np.sin(angle), radius * (1 - np.cos(angle)), angle]
    np.testing.assert_allclose(pose, expected, atol=1e-12)


def test_motor_lag_falls_short_by_speed_times_tau():
    tau, time = 0.08, 0.7013
    pose = end(IDEAL.with_effect("motor-lag", tau_s=tau), 0.2, 0.2, time)
    assert pose[0] == pytest.approx(0.2 * (time - tau * (1 - np.exp(-time / tau))), abs=1e-12)


def test_lag_carries_over_into_the_next_command():
    model = IDEAL.with_effect("motor-lag", tau_s=0.1)
    poses = simulate(model, [[0.2, 0.0]], [[0.2, 0.0]], [[2.0, 3.0]])[0]
    assert poses[1, 0] - poses[0, 0] == pytest.approx(0.2 * 0.1, abs=1e-9)
    assert poses[1, 0] == pytest.approx(0.2 * 2.0, abs=1e-9)


def test_acceleration_limit_loses_half_the_squared_speed_over_the_limit():
    model = IDEAL.with_effect("acceleration-limit", max_m_s2=0.37)
    assert end(model, 0.2, 0.2, 1.5)[0] == pytest.approx(0.2 * 1.5 - 0.2**2 / (2 * 0.37), abs=1e-12)


def test_delay_shifts_the_commands_by_a_time_that_is_no_step():
    model = IDEAL.with_effect("command-delay", delay_s=0.0313)
    poses = simulate(model, [[0.1, 0.2]], [[0.1, 0.2]], [[0.5, 0.5]])
    late = 0.5 - 0.0313
    np.testing.assert_allclose(poses[0, :, 0], [0.1 * late, 0.1 * 0.5 + 0.2 * late], atol=1e-12)


def test_gain_and_limit_and_dead_zone_on_straight_commands():
    assert end(IDEAL.with_effect("speed-gain", gain=1.1), 0.1, 0.1, 1.0)[0] == pytest.approx(0.11)
    assert end(IDEAL.with_effect("speed-limit", max_m_s=0.15), -0.2, -0.2, 1.0)[0] == pytest.approx(-0.15)
    dead = IDEAL.with_effect("dead-zone", width_m_s=0.02)
    assert end(dead, -0.1, -0.1, 1.0)[0] == pytest.approx(-0.08)
    assert end(dead, 0.01, 0.01, 1.0)[0] == 0.0


def test_mismatch_keeps_the_mean_speed_and_turns_to_the_smaller_wheel():
    pose = end(IDEAL.with_effect("wheel-mismatch", ratio=1.02), 0.1, 0.1, 1.0)
    difference = 0.1 * 2 * (1.02 - 1) / (1 + 1.02)
    assert pose[2] == pytest.approx(difference / B)
    chord = 0.1 * np.sinc(pose[2] / 2 / np.pi)
    assert np.hypot(pose[0], pose[1]) == pytest.approx(chord, abs=1e-12)


def test_a_wider_wheelbase_turns_less():
    assert end(IDEAL.with_effect("wheelbase", factor=1.25), 0.1, 0.2, 1.0)[2] == pytest.approx(0.1 / B / 1.25)


@pytest.mark.parametrize(("left", "right", "outward"), [(0.1, 0.14, -1), (0.14, 0.1, 1), (-0.1, -0.14, -1)])
def test_side_slip_goes_outwards(left, right, outward):
    slipping = IDEAL.with_effect("side-slip", slip_s=0.03)
    moved = end(slipping, left, right, 0.05) - end(IDEAL, left, right, 0.05)
    speed, omega = (left + right) / 2, (right - left) / B
    assert np.sign(moved[1]) == outward
    assert abs(moved[1]) == pytest.approx(0.03 * abs(speed * omega) * 0.05, rel=1e-3)
    assert moved[2] == 0


def test_turn_slip_shortens_the_arc_and_never_reverses():
    slip = IDEAL.with_effect("turn-slip", slip_s=0.05)
    omega = 0.1 / B
    assert end(slip, 0.1, 0.2, 1.0)[0] == pytest.approx(end(IDEAL, 0.1, 0.2, 1.0)[0] * (1 - 0.05 * omega))
    assert end(IDEAL.with_effect("turn-slip", slip_s=1.0), 0.0, 0.2, 0.05)[0] == 0.0


def test_bias_and_slope_act_while_the_wheels_turn_and_not_at_rest():
    model = IDEAL.with_effect("yaw-bias", rate_rad_s=0.1).with_effect("floor-slope", x_m_s=0.0, y_m_s=-0.01)
    poses = simulate(model, [[0.0, 0.1]], [[0.0, 0.1]], [[2.0, 1.0]])[0]
    np.testing.assert_array_equal(poses[0], 0.0)
    assert poses[1, 2] == pytest.approx(0.1)
    assert poses[1, 1] == pytest.approx(-0.01 + (1 - np.cos(0.1)) / 0.1 * 0.1, abs=1e-9)


def test_tether_draws_a_turning_robot_home_exponentially():
    model = IDEAL.with_effect("tether-pull", pull_per_s=0.5, anchor_x_m=1.0, anchor_y_m=0.0)
    pose = end(model, -0.1, 0.1, 2.0, start=(3.0, 4.0, 0.0))
    np.testing.assert_allclose(pose[:2], [1 + 2 * np.exp(-1), 4 * np.exp(-1)], atol=1e-12)


def test_marker_offset_turns_with_the_robot_and_needs_observing():
    model = IDEAL.with_effect("marker-offset", forward_m=0.03, left_m=0.01)
    np.testing.assert_allclose(observe([1.0, 1.0, np.pi / 2], None, model), [0.99, 1.03, np.pi / 2])
    np.testing.assert_array_equal(end(model, 0.1, 0.2, 1.0), end(IDEAL, 0.1, 0.2, 1.0))


def test_jitter_scales_each_wheel_once_a_command():
    model = Model(wheelbase_m=B, jitter_relative=0.02)
    normals = np.array([[[1.0, -2.0], [0.0, 0.5]]])
    got = simulate(model, [[0.1, 0.2]], [[0.1, 0.2]], [[1.0, 0.5]], normals=normals)
    expected = simulate(IDEAL, [[0.102, 0.2]], [[0.096, 0.202]], [[1.0, 0.5]])
    np.testing.assert_allclose(got, expected, atol=1e-15)


def test_noise_is_the_normals_times_the_model_and_0_without():
    model = Model(wheelbase_m=B, noise_position_m=0.002, noise_heading_rad=0.01)
    poses = np.zeros((2, 3))
    seen = observe(poses, [[1.0, -1, 2], [0, 0, 0]], model)
    np.testing.assert_allclose(seen, [[0.002, -0.002, 0.02], [0, 0, 0]])
    np.testing.assert_array_equal(observe(poses, None, model), poses)
    np.testing.assert_array_equal(poses, 0.0)


def test_padding_is_harmless_wherever_it_stands_and_no_command_at_all_is_allowed():
    model = IDEAL.with_effect("motor-lag", tau_s=0.08).with_effect("command-delay", delay_s=0.03)
    plain = simulate(model, [[0.1, 0.2]], [[0.2, 0.1]], [[0.6, 0.7]])[0]
    padded = simulate(model, [[0.1, 9.0, 0.2, 0]], [[0.2, 9.0, 0.1, 0]], [[0.6, 0.0, 0.7, 0]])[0]
    np.testing.assert_array_equal(padded, plain[[0, 0, 1, 1]])
    assert simulate(model, np.empty((2, 0)), np.empty((2, 0)), np.empty((2, 0))).shape == (2, 0, 3)


def test_track_agrees_with_the_ends_and_is_nan_after_a_trial():
    commands = ([[0.1, 0.2], [0.1, 0.0]], [[0.2, 0.1], [0.1, 0.0]], [[0.5, 0.5], [0.5, 0.0]])
    ends, dense = simulate(IDEAL, *commands), track(IDEAL, *commands, dense_dt_s=0.1)
    assert dense.poses.shape == (2, 11, 3)
    np.testing.assert_allclose(dense.poses[0, [5, 10]], ends[0], atol=1e-9)
    np.testing.assert_allclose(dense.poses[1, :6, 0], 0.1 * dense.t_s[1, :6], atol=1e-12)
    assert np.isnan(dense.poses[1, 6:]).all()
    assert np.isnan(dense.t_s[1, 6:]).all()


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"duration_s": [[-1.0]]}, "duration_s holds -1"),
        ({"left_m_s": [[np.nan]]}, "left_m_s holds nan"),
        ({"left_m_s": [0.1]}, r"shapes \(1,\), \(1, 1\) and \(1, 1\)"),
        ({"start": (0, 0)}, r"start has the shape \(2,\)"),
        ({"normals": [[0.0, 0.0]]}, r"normals have the shape \(1, 2\); they must be \(1, 1, 2\)"),
    ],
)
def test_what_cannot_be_driven_is_refused(change, message):
    with pytest.raises(ModelError, match=message):
        simulate(IDEAL, **({"left_m_s": [[0.1]], "right_m_s": [[0.1]], "duration_s": [[1.0]]} | change))


def test_what_cannot_be_seen_is_refused():
    with pytest.raises(ModelError, match="dense_dt_s is 0"):
        track(IDEAL, [[0.1]], [[0.1]], [[1.0]], dense_dt_s=0)
    with pytest.raises(ModelError, match=r"last axis must be x_m, y_m, heading_rad"):
        observe([0.0, 1.0], None, IDEAL)


def test_few_steps_that_grow_within_a_command_lose_tenths_of_a_millimetre():
    rng = np.random.default_rng(2)
    model = Model(B).with_effect("motor-lag", tau_s=0.1).with_effect("turn-slip", slip_s=0.05)
    left, right = rng.uniform(0.02, 0.2, (2, 60, 10))
    duration = rng.uniform(0.4, 3.0, (60, 10))
    duration[::3, 7:] = 0.0  # short lists

    few = simulate(replace(model, dt_s=STEP_S), left, right, duration, growth=GROWTH)
    off_mm = 1000 * np.hypot(*(few - simulate(model, left, right, duration))[:, -1, :2].T)
    assert np.median(off_mm) < 0.2
    assert off_mm.max() < 0.5
    grid = step_grid(left, right, duration, STEP_S, GROWTH)
    assert grid.step_s.shape[1] < step_grid(left, right, duration, 0.05).step_s.shape[1] / 3
    ends_s = np.take_along_axis(grid.node_s, grid.ends, axis=1)
    np.testing.assert_allclose(ends_s, np.cumsum(duration, axis=1), atol=1e-12)  # no time is lost or added


@pytest.mark.parametrize("growth", [1.0, 1.4])
def test_a_command_of_whole_steps_has_no_empty_step_more(growth):
    edges = STEP_S * (growth ** np.arange(1, 6) - 1) / (growth - 1) if growth > 1 else STEP_S * np.arange(1, 6)
    grid = step_grid(np.ones((5, 1)), np.ones((5, 1)), edges[:, None], STEP_S, growth)
    assert grid.ends[:, 0].tolist() == [1, 2, 3, 4, 5]
    np.testing.assert_allclose(grid.step_s.sum(axis=1), edges)
