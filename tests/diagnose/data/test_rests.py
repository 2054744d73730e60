"""When a robot rests: the poses in which it coasts are left out, and none where nothing coasts.

The worlds are written here: wheels that follow their commands within a limit or with a lag, and a tracker's noise of 1 mm.
"""

from types import SimpleNamespace

import numpy as np
import pytest

from bns.diagnose.data import tracking_noise as module
from bns.diagnose.data.rests import FEWEST_LEFT, SETTLED_S, Rest, settled, told_to_stand
from bns.diagnose.data.tracking_noise import noise_at_rest, tracking_noise

NOISE = np.array([0.001, 0.001, 0.004])
STEP_S = 0.01


def driven(
    rng, limit=None, lag_s=None, rest_s=(1.0, 3.0), trials=16, drives=2, memory=0.0, creep_m_s=0.0, held=1, noise=NOISE,
    spin=False,
):  # fmt: skip
    """Tracks at 25 Hz of a robot that drives any way and stands, in turn.

    ``limit`` (m/s^2): wheels ramp; ``lag_s``: they lag; ``memory``: correlation of the noise from pose to pose;
    ``creep_m_s``: speed along x at all times; ``held``: the tracker repeats each pose so often; ``spin``: it turns on the spot.
    """
    t_s, poses, commands, durations, first = [], [], [], [], [0]
    for _ in range(trials):
        speed = np.ravel([[rng.uniform(0.1, 0.6) * rng.choice([-1, 1]), 0.0] for _ in range(drives)])
        ways = np.array([-1.0, 1.0]) if spin else rng.uniform(0.4, 1.0, 2)
        lasts = np.ravel([[rng.uniform(0.6, 2.0), rng.uniform(*rest_s)] for _ in range(drives)])
        steps = int(lasts.sum() / STEP_S)
        told = speed[np.searchsorted(np.cumsum(lasts), np.arange(steps) * STEP_S, side="right").clip(max=len(lasts) - 1)]
        wheels = np.outer(followed(told, limit, lag_s), ways)
        heading = rng.uniform(-3, 3) + np.cumsum((wheels[:, 1] - wheels[:, 0]) / 0.3) * STEP_S
        ahead = wheels.mean(axis=1)
        x = np.cumsum(ahead * np.cos(heading) + creep_m_s) * STEP_S
        y = np.cumsum(ahead * np.sin(heading)) * STEP_S
        seen_s = np.arange(rng.uniform(0, 0.04), lasts.sum() - STEP_S, 0.04)
        true = np.column_stack([x, y, heading])[(seen_s / STEP_S).astype(int)]
        pose = true + correlated(rng, len(seen_s), memory) * noise
        poses.append(pose[np.arange(len(pose)) // held * held])
        t_s.append(seen_s)
        commands.append(np.outer(ways, speed))
        durations.append(lasts)
        first.append(first[-1] + len(seen_s))
    left, right = np.moveaxis(np.array(commands), 1, 0)
    return SimpleNamespace(
        first=np.array(first), t_s=np.concatenate(t_s), pose=np.concatenate(poses), left_m_s=left, right_m_s=right,
        duration_s=np.array(durations),
    )  # fmt: skip


def followed(told, limit, lag_s):
    """A speed that ramps or lags behind what it is told."""
    if limit is None and lag_s is None:
        return told
    out, speed = np.empty(len(told)), 0.0
    for i, wanted in enumerate(told):
        change = wanted - speed
        speed += change * STEP_S / lag_s if limit is None else np.clip(change, -limit * STEP_S, limit * STEP_S)
        out[i] = speed
    return out


def correlated(rng, frames, memory):
    """Standard normal numbers (frames, 3), each of which shares ``memory`` with the one before."""
    out = rng.normal(size=(frames, 3))
    for i in range(1, frames):
        out[i] = memory * out[i - 1] + np.sqrt(1 - memory**2) * out[i]
    return out


def with_all_poses(monkeypatch, tracks):
    """The noise as it would be if all poses of a rest counted."""
    with monkeypatch.context() as patch:
        patch.setattr(module, "settled", list)
        return noise_at_rest(tracks)[0]


def kept(tracks):
    """The fraction of poses that count."""
    rests = list(told_to_stand(tracks))
    return sum(len(rest.t_s) for rest in settled(rests)) / sum(len(rest.t_s) for rest in rests)


@pytest.mark.parametrize(("coasts", "within"), [({"limit": 0.6}, 0.08), ({"limit": 0.3}, 0.1), ({"lag_s": 0.2}, 0.12)])
@pytest.mark.parametrize("spin", [False, True])
def test_a_robot_that_coasts_adds_little_to_the_noise(coasts, within, spin, monkeypatch):
    """A ramp ends; a lag never quite does."""
    tracks = driven(np.random.default_rng(2), rest_s=(1.0, 2.0), spin=spin, **coasts)
    noise, before = noise_at_rest(tracks)[0], with_all_poses(monkeypatch, tracks)
    assert noise.position_m == pytest.approx(NOISE[0], rel=within)
    assert noise.heading_rad == pytest.approx(NOISE[2], rel=within)
    assert (before.heading_rad / NOISE[2] if spin else before.position_m / NOISE[0]) > 1.0 + within


def test_rests_that_are_too_short_to_settle_do_not_count():
    tracks = driven(np.random.default_rng(3), lag_s=0.5, rest_s=(0.8, 1.1))
    assert sum(len(rest.t_s) for rest in told_to_stand(tracks)) > 200
    noise = tracking_noise(tracks)
    assert noise.basis == "high frequency"
    assert noise.position_m == pytest.approx(NOISE[0], rel=0.1)


@pytest.mark.parametrize(("memory", "least"), [(0.0, 0.99), (0.5, 0.99), (0.9, 0.98)])
def test_noise_of_a_robot_that_does_not_coast_is_not_cut_to_fit(memory, least, monkeypatch):
    """Where noise happens to be large it must not be left out: on average the estimate is the same."""
    rng = np.random.default_rng(4)
    worlds = [driven(rng, memory=memory) for _ in range(12)]
    after = np.mean([noise_at_rest(one)[0].position_m for one in worlds])
    assert np.mean([kept(one) for one in worlds]) >= least - 0.01
    assert least <= after / np.mean([with_all_poses(monkeypatch, one).position_m for one in worlds]) <= 1.005


def test_a_robot_that_creeps_after_driving_any_way_still_rests():
    tracks = driven(np.random.default_rng(5), creep_m_s=0.02)
    assert kept(tracks) > 0.95
    assert noise_at_rest(tracks)[0].position_m == pytest.approx(NOISE[0], rel=0.08)


def test_repeated_poses_count_once():
    """A tracker slower than the log: with one rest, nothing else tells how large its noise is."""
    rng = np.random.default_rng(6)
    assert np.mean([kept(driven(rng, held=5, trials=1, drives=1)) for _ in range(100)]) > 0.99


def test_of_a_few_rests_that_all_go_on_none_counts():
    """All go on as far: no change goes back, and quick noise alone tells how large noise is."""
    t_s, rng = np.arange(0.0, 0.8, 0.04), np.random.default_rng(7)
    coasting = np.outer(-0.1 * np.exp(-t_s / 0.5), [1.0, 0.0, 0.0])
    rests = [Rest(t_s, coasting + rng.normal(size=(20, 3)) * NOISE, np.array([0.1, 0.0, 0.0])) for _ in range(4)]
    assert settled(rests) == []
    back = [Rest(rest.t_s, rest.pose, -rest.way) for rest in rests]
    assert len(settled(back)) == 4  # it comes back: no robot coasts so


@pytest.mark.parametrize("poses", [5, 20])
def test_steady_motion_hides_no_motion(poses):
    """Neither the ends of rests nor the steps from pose to pose may count it as noise."""
    t_s, rng, way = np.arange(poses) / 25, np.random.default_rng(12), np.array([0.2, 0.0, 0.0])
    rests = [Rest(t_s, np.outer(t_s, way) + rng.normal(size=(poses, 3)) * NOISE, way) for _ in range(4)]
    assert settled(rests) == []


def test_what_is_left_of_a_rest_is_its_end():
    t_s, rng = np.arange(0.0, 4.0, 0.04), np.random.default_rng(8)
    coasting = np.outer(-0.2 * np.maximum(1 - t_s / 0.8, 0.0) ** 2, [0.6, 0.8, 0.0])
    rest = Rest(t_s, coasting + rng.normal(size=(100, 3)) * NOISE, np.array([0.06, 0.08, 0.0]))
    (left,) = settled([rest])
    assert 0.5 < left.t_s[0] < 2.5
    assert left.t_s[-1] == t_s[-1]
    assert (left.pose[-1] == rest.pose[-1]).all()


def test_a_rest_that_was_cut_counts_only_with_enough_poses():
    rng = np.random.default_rng(9)
    for poses in range(5, 40):
        jump = np.outer(np.where(np.arange(poses) < poses // 3, -0.1, 0.0), [1.0, 0.0, 0.0])
        rest = Rest(np.arange(poses) / 25, jump + rng.normal(size=(poses, 3)) * NOISE, np.array([0.1, 0.0, 0.0]))
        assert bool(settled([rest])) == (poses - poses // 3 >= FEWEST_LEFT)


def test_a_robot_without_noise_rests_whatever_the_rounding():
    still = driven(np.random.default_rng(10), noise=np.zeros(3))
    assert kept(still) == 1
    t_s, way = np.arange(20) / 25, np.array([0.1, 0.0, 0.0])
    assert len(settled([Rest(t_s, np.outer(1e-8 * t_s, way), way)] * 4)) == 4


def test_rests_that_no_drive_led_to_say_nothing_of_those_after_drives():
    rng, t_s, way = np.random.default_rng(13), np.arange(20) / 25, np.array([0.1, 0.0, 0.0])
    coasting = np.outer(-0.005 * np.exp(-t_s / 0.2), [1.0, 0.0, 0.0])
    after = [Rest(t_s, coasting + rng.normal(size=(20, 3)) * NOISE, way) for _ in range(2)]
    begin = [Rest(t_s, rng.normal(size=(20, 3)) * NOISE, np.zeros(3)) for _ in range(50)]
    assert [len(rest.t_s) for rest in settled(begin)] == [20] * 50
    assert settled([*begin, *after])[:50] == begin
    assert sum(len(rest.t_s) for rest in settled([*begin, *after])[50:]) < 40


@pytest.mark.parametrize(("before", "moved"), [(0.0, False), (0.2, True)])
def test_a_rest_begins_after_the_stop_and_knows_the_way_that_led_to_it(before, moved):
    """The robot goes on at 0.1 m/s under the command of zero, which only one that drove before can do by coasting."""
    t_s = np.arange(0.0, 4.0, 0.1)
    tracks = SimpleNamespace(
        first=np.array([0, 40]), t_s=t_s, pose=np.column_stack([0.1 * t_s, np.zeros(40), -0.5 * t_s]),
        duration_s=np.array([[1.0, 2.0, 1.0]]), left_m_s=np.array([[before, 0.0, 0.1]]), right_m_s=np.array([[before, 0.0, 0.0]]),
    )  # fmt: skip
    rest = list(told_to_stand(tracks))[-1]
    assert rest.t_s[0] == pytest.approx(1.0 + SETTLED_S, abs=0.1)
    assert rest.t_s[-1] == pytest.approx(3.0, abs=0.1)
    assert rest.way == pytest.approx(np.array([0.04, 0.0, -0.2]) * moved)


def test_where_poses_begin_with_the_rest_they_tell_the_way_themselves():
    t_s = np.arange(5.03, 7.0, 0.1)
    tracks = SimpleNamespace(
        first=np.array([0, 20]), t_s=t_s, pose=np.column_stack([-0.1 * t_s, np.zeros(20), np.zeros(20)]),
        duration_s=np.array([[5.0, 2.0]]), left_m_s=np.array([[-0.3, 0.0]]), right_m_s=np.array([[-0.3, 0.0]]),
    )  # fmt: skip
    (rest,) = told_to_stand(tracks)
    assert rest.way == pytest.approx([-0.04, 0.0, 0.0])
