"""The compiled loops against plain matrices, and the drive they follow against the physics."""

import numpy as np
import pytest

from bns.diagnose.data.tracks import tracks_of
from bns.diagnose.predict.wheels import WheelPredictor
from bns.engine import reference
from bns.engine.pose_filter import displacements, filter_gains, innovations
from bns.physics.wheels.differential_drive import track
from tests.diagnose.worlds import FRAME_S, NOMINAL, hidden, measured

NOISE = np.array([2e-3, 8e-3, 4e-3, 2e-3, 2e-2])


@pytest.fixture(scope="module")
def followed_world():
    predictor = WheelPredictor(tracks_of(measured(hidden(motor_lag={"tau_s": 0.05}), trials=4)))
    return predictor, predictor.steps(NOMINAL)


def test_innovations_equal_a_filter_written_with_matrices():
    """The compiled one keeps its covariance in the robot's frame, the twin in the world's: alike while corrections are small."""
    predictor = WheelPredictor(tracks_of(measured(NOMINAL, trials=3, jitter=0.0, noise=(0.002, 1e-4))))
    steps, tracks = predictor.steps(NOMINAL), predictor.tracks
    noise = np.array([2e-3, 1e-4, 4e-3, 2e-3, 1e-3])
    gain, whiten, logdet = filter_gains(steps.body, tracks.is_first, predictor.way_m, noise)
    whitened = innovations(steps.body, steps.drift_m, tracks.pose, tracks.is_first, gain, whiten)
    slow, slow_logdet = reference.innovations(
        steps.body, steps.drift_m, tracks.pose, tracks.is_first, predictor.way_m, noise
    )
    np.testing.assert_allclose((whitened**2).sum(axis=1), (slow**2).sum(axis=1), rtol=2e-3, atol=2e-3)
    np.testing.assert_allclose(logdet, slow_logdet, atol=1e-4)


def test_displacements_equal_their_twin(followed_world):
    tracks = followed_world[0].tracks
    found = displacements(tracks.pose, tracks.is_first)
    np.testing.assert_allclose(found, reference.displacements(tracks.pose, tracks.is_first), atol=1e-15)
    assert (found[tracks.is_first] == 0).all()
    assert np.abs(found).max(axis=0).min() > 1e-3


@pytest.mark.parametrize("turn_rad", [0.2499, -0.2499, 0.2501, 0.1, 3.0])
def test_a_circle_of_many_frames_is_followed_to_the_last_digits(turn_rad):
    """Chords of a circle of radius 1: each the same in the frame of the pose before it, however often that was turned on."""
    heading = turn_rad * np.arange(200.0)
    poses = np.column_stack([np.sin(heading), -np.cos(heading), heading])
    found = displacements(poses, np.arange(200) == 0)[1:]
    expected = np.array([np.sin(turn_rad), 1 - np.cos(turn_rad), turn_rad])
    np.testing.assert_allclose(found, np.tile(expected, (199, 1)), rtol=0.0, atol=5e-14)


def test_a_true_model_leaves_white_noise():
    predictor = WheelPredictor(tracks_of(measured(NOMINAL, trials=12, jitter=0.0, noise=(0.002, 0.008))))
    steps = predictor.steps(NOMINAL)
    noise = np.array([2e-3, 8e-3, 1e-5, 1e-5, 1e-4])
    gain, whiten, _ = filter_gains(steps.body, predictor.tracks.is_first, predictor.way_m, noise)
    tracks = predictor.tracks
    whitened = innovations(steps.body, steps.drift_m, tracks.pose, tracks.is_first, gain, whiten)[~tracks.is_first]
    assert np.abs(whitened.mean(axis=0)).max() < 0.06
    assert np.abs(whitened.std(axis=0) - 1).max() < 0.06
    assert np.abs(np.corrcoef(whitened[1:, 0], whitened[:-1, 0])[0, 1]) < 0.06


def led_by(predictor, model):
    """Where a model's steps lead from every pose but the last, (frames - 1, 3)."""
    steps, pose = predictor.steps(model), predictor.tracks.pose
    cos, sin = np.cos(pose[:-1, 2]), np.sin(pose[:-1, 2])
    east = pose[:-1, 0] + cos * steps.body[1:, 0] - sin * steps.body[1:, 1] + steps.drift_m[1:, 0]
    north = pose[:-1, 1] + sin * steps.body[1:, 0] + cos * steps.body[1:, 1] + steps.drift_m[1:, 1]
    return np.stack([east, north, pose[:-1, 2] + steps.body[1:, 2]], axis=1)


@pytest.mark.parametrize(
    "effects",
    [
        {},
        {"motor_lag": {"tau_s": 0.08}, "turn_slip": {"slip_s": 0.05}},
        {"marker_offset": {"forward_m": 0.02, "left_m": -0.01}, "camera_scale": {"factor": 1.05}},
        {"clock_offset": {"offset_s": 0.06}, "wheelbase": {"factor": 1.05}},
        {"floor_slope": {"x_m_s": 0.004, "y_m_s": -0.002}},
        {"battery_sag": {"rate_per_s": 0.01, "per_volt": 0.0}, "camera_rotation": {"angle_rad": 0.1}},
    ],
    ids=lambda e: "+".join(e) or "none",
)
def test_steps_are_those_of_the_simulated_drive(effects):
    """Without noise, a model's steps lead from each frame to the next."""
    model = hidden(**effects)
    table = measured(model, trials=1, noise=(0.0, 0.0), jitter=0.0)
    predictor = WheelPredictor(tracks_of(table))
    led, pose = led_by(predictor, model), predictor.tracks.pose
    np.testing.assert_allclose(led[:, :2], pose[1:, :2], atol=6e-5)
    np.testing.assert_allclose(led[:, 2], pose[1:, 2], atol=1e-4)


def test_a_pull_is_that_of_the_way_between_poses_however_far_apart_they_are():
    model = hidden(tether_pull={"anchor_x_m": 0.4, "anchor_y_m": 0.3, "pull_per_s": 0.02})
    predictor = WheelPredictor(tracks_of(measured(model, trials=4, noise=(0.0, 0.0), jitter=0.0, ends_only=True)))
    within = ~predictor.tracks.is_first[1:]
    # at the place midway it would be 0.8 mm, at the earlier pose 4 mm
    assert np.abs(led_by(predictor, model) - predictor.tracks.pose[1:])[within].max() < 1e-4


def test_a_marker_mistaken_at_the_start_does_not_lose_the_trial(followed_world):
    predictor, steps = followed_world
    tracks = predictor.tracks
    gain, whiten, _ = filter_gains(steps.body, tracks.is_first, predictor.way_m, NOISE)
    pose = tracks.pose.copy()
    pose[0, :2] += 0.3
    whitened = innovations(steps.body, steps.drift_m, pose, tracks.is_first, gain, whiten)
    assert np.linalg.norm(whitened[1:4], axis=1).min() > 20
    assert np.linalg.norm(whitened[8 : tracks.first[1]], axis=1).max() < 20


def standing(frames=60, begins=(0,)):
    """A robot that stands before a camera, and a filter for it: poses (frames, 3), and what the filter says of them."""
    pose = np.random.default_rng(8).normal(size=(frames, 3)) * [2e-3, 2e-3, 8e-3]
    nothing, first = np.zeros((frames, 3)), np.isin(np.arange(frames), begins)
    gain, whiten, _ = filter_gains(nothing, first, np.zeros(frames), NOISE)
    return pose, lambda seen: innovations(nothing, nothing[:, :2], seen, first, gain, whiten)


def begun_anew(whitened):
    """Frames that were taken as they are."""
    return np.flatnonzero((whitened == 0).all(axis=1)).tolist()


def test_single_mistaken_markers_do_not_begin_a_trial_anew_and_four_in_a_row_do():
    pose, filtered = standing()
    assert begun_anew(filtered(pose)) == [0]
    single, row = pose.copy(), pose.copy()
    single[[10, 20, 30, 40, 50], 0] += 0.4
    row[10:14, 0] += 0.4
    assert begun_anew(filtered(single)) == [0]
    assert begun_anew(filtered(row)) == [0, 14]


def test_mistaken_markers_at_the_end_of_a_trial_say_nothing_of_the_next():
    pose, filtered = standing(begins=(0, 30))
    pose[27:30, 0] += 0.4
    pose[31, 0] -= 0.4
    assert begun_anew(filtered(pose)) == [0, 30]


def test_a_heading_that_is_given_a_round_more_is_the_same_heading():
    pose, filtered = standing()
    more = pose.copy()
    more[20:40, 2] += 2 * np.pi
    more[40:, 2] -= 4 * np.pi
    np.testing.assert_allclose(filtered(more), filtered(pose), atol=1e-9)


def test_the_clock_shifts_a_track_along_itself():
    late = track(hidden(clock_offset={"offset_s": 2 * FRAME_S}), [[0.1]], [[0.12]], [[2.0]], dense_dt_s=FRAME_S).poses[
        0
    ]
    true = track(NOMINAL, [[0.1]], [[0.12]], [[2.0]], dense_dt_s=FRAME_S).poses[0]
    np.testing.assert_allclose(late[2:], true[:-2], atol=1e-9)
    np.testing.assert_allclose(late[:2], true[:1].repeat(2, 0), atol=1e-12)
