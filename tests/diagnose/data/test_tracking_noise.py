"""Noise of tracks from few poses at rest and many in motion. The motion is written here: arcs whose speed changes smoothly."""

import sys
from types import SimpleNamespace

import numpy as np
import pytest

from bns.diagnose.data import tracking_noise as module
from bns.diagnose.data.robust import robust_sd, trimmed_sd
from bns.diagnose.data.tracking_noise import noise_at_rest, tracking_noise
from bns.diagnose.settings import DEFAULTS

NOISE = np.array([0.001, 0.001, 0.005])


def driven(rng, rests_s=0.6, trials=10, uneven=False, slow=0.0, speed=0.5):
    """Tracks at about 30 Hz: 6 s of an arc under one command, then a rest whose first half second does not count.

    ``uneven``: frames come 12 ms and a random wait after each other. ``slow`` (m): a wander of the picture, correlated over 1 s.
    """
    t_s, poses, first = [], [], [0]
    for _ in range(trials):
        lasts = 6.0, 0.5 + rests_s
        gaps = 0.012 + rng.gamma(1.5, 0.0137, 2000) if uneven else np.full(2000, 0.033)
        seen_s = np.cumsum(gaps)
        seen_s = seen_s[seen_s < sum(lasts)]
        way = speed * np.minimum(seen_s, lasts[0])
        heading = rng.uniform(-3, 3) + way / 0.8
        centre = np.column_stack([0.8 * np.sin(heading), -0.8 * np.cos(heading)])
        wander = np.zeros(len(seen_s))
        for i in range(1, len(seen_s)):
            keep = np.exp(seen_s[i - 1] - seen_s[i])
            wander[i] = keep * wander[i - 1] + np.sqrt(1 - keep**2) * rng.normal()
        pose = np.column_stack([centre, heading]) + rng.normal(size=(len(seen_s), 3)) * NOISE
        pose[:, 0] += slow * wander
        t_s.append(seen_s)
        poses.append(pose)
        first.append(first[-1] + len(seen_s))
    commands = np.tile([speed, 0.0], (trials, 1))
    return SimpleNamespace(
        first=np.array(first), t_s=np.concatenate(t_s), pose=np.concatenate(poses), left_m_s=commands, right_m_s=commands,
        duration_s=np.tile(lasts, (trials, 1)),
    )  # fmt: skip


def test_few_poses_at_rest_do_not_outweigh_many_in_motion():
    """Six rests of 18 poses know the noise to 10 %; the many that are driven to 2 %."""
    rng = np.random.default_rng(0)
    worlds = [driven(rng, trials=6) for _ in range(20)]
    found = [tracking_noise(one) for one in worlds]
    assert sum(one.basis == "at rest, high frequency" for one in found) >= 19
    assert not found[0].is_lower_bound
    both = np.array([one.position_m for one in found]) / NOISE[0] - 1
    alone = np.array([noise_at_rest(one)[0].position_m for one in worlds]) / NOISE[0] - 1
    assert np.sqrt((both**2).mean()) < 0.4 * np.sqrt((alone**2).mean())


def test_where_rests_show_more_they_are_believed():
    """Slow wander follows a parabola through few frames, and a robot at rest shows it over seconds."""
    found = tracking_noise(driven(np.random.default_rng(1), rests_s=4.0, slow=0.003))
    assert found.basis == "at rest"
    assert found.position_m > 1.3 * NOISE[0]


@pytest.mark.parametrize("channel", [0, 2])
def test_both_position_and_heading_have_to_agree(channel, monkeypatch):
    tracks = driven(np.random.default_rng(2), rests_s=3.0)
    assert tracking_noise(tracks).basis == "at rest, high frequency"
    resting, freedom = noise_at_rest(tracks)
    larger = {"position_m": 1.5 * resting.position_m} if channel == 0 else {"heading_rad": 1.5 * resting.heading_rad}
    monkeypatch.setattr(module, "noise_at_rest", lambda _: (module.replace(resting, **larger), freedom))
    assert tracking_noise(tracks).basis == "at rest"


@pytest.mark.parametrize("uneven", [False, True])
def test_frames_at_uneven_times_are_taken_at_their_own_times(uneven):
    """At 0.5 m/s a frame that comes 10 ms late is 5 mm further on."""
    found = tracking_noise(driven(np.random.default_rng(3), rests_s=0.0, uneven=uneven))
    assert found.basis == "high frequency"
    assert found.is_lower_bound
    assert found.position_m == pytest.approx(NOISE[0], rel=0.05)
    assert found.heading_rad == pytest.approx(NOISE[2], rel=0.05)


def test_what_is_left_of_a_polynomial_is_what_least_squares_leave():
    rng = np.random.default_rng(4)
    t_s, values = np.sort(rng.uniform(10, 11, (5, 7)), axis=1), rng.normal(size=(5, 7))
    for times, one, weights in zip(t_s, values, module._residual_makers(t_s, 2), strict=True):
        left = one - np.polyval(np.polyfit(times - 10.5, one, 2), times - 10.5)
        assert weights @ one == pytest.approx(left[3], abs=1e-9)


def test_the_noise_is_known_from_fewer_numbers_than_the_median_needs_and_faults_hardly_count():
    draws = np.random.default_rng(4).normal(size=(400, 200))
    of = {sd: np.array([float(sd(one)) for one in draws]) for sd in (robust_sd, trimmed_sd)}
    np.testing.assert_allclose([one.mean() for one in of.values()], 1.0, atol=0.01)
    assert of[trimmed_sd].std() == pytest.approx(DEFAULTS.data.trimmed_sd_se / np.sqrt(200), rel=0.1)
    assert of[robust_sd].std() > 1.4 * of[trimmed_sd].std()
    faulty = draws.ravel() * np.where(np.arange(draws.size) % 33 == 0, 30.0, 1.0)
    assert trimmed_sd(faulty) == pytest.approx(1.0, abs=0.01)
    assert robust_sd(faulty) > 1.03
    assert trimmed_sd(np.zeros(5)) == 0.0


@pytest.mark.parametrize("grid_m", [0.004, 0.012])
def test_poses_that_are_rounded_are_off_by_the_rounding_where_they_do_not_change_at_rest(grid_m, monkeypatch):
    """In degrees by halves, written in radians with five digits."""
    monkeypatch.setattr(sys.modules[__name__], "NOISE", np.array([1e-5, 1e-5, 1e-5]))
    tracks = driven(np.random.default_rng(5), rests_s=3.0)
    tracks.pose[:, :2] = grid_m * np.round(tracks.pose[:, :2] / grid_m)
    tracks.pose[:, 2] = np.round(np.radians(0.5 * np.round(np.degrees(tracks.pose[:, 2]) / 0.5)), 5)
    assert noise_at_rest(tracks)[0].position_m < 1e-9
    found = tracking_noise(tracks)
    assert found.position_m == pytest.approx(grid_m / np.sqrt(12))
    assert found.heading_rad == pytest.approx(np.radians(0.5) / np.sqrt(12), rel=1e-3)
    assert found.basis == "rounding"


def test_a_fine_grid_and_none_leave_the_noise_as_it_is():
    tracks = driven(np.random.default_rng(6), rests_s=3.0)
    noise = tracking_noise(tracks)
    assert module.rounding(tracks.pose) == 0.0
    tracks.pose[:, :2] = np.round(tracks.pose[:, :2], 4)
    assert tracking_noise(tracks).position_m == pytest.approx(noise.position_m, rel=0.01)
    assert tracking_noise(tracks).basis == noise.basis


@pytest.mark.parametrize("several", [19, 20])
def test_few_values_are_no_grid(several):
    values = np.arange(several)[:, None] * 0.01
    assert module.rounding(values) == (pytest.approx(0.01 / np.sqrt(12)) if several == 20 else 0.0)
