"""Poses from the Wii remote's events: accuracy, names of lights, what is lost."""

import os

import numpy as np
import pytest

from bns.errors import HardwareError
from bns.hardware.emulators.faults import Fault, Faults
from bns.hardware.emulators.wii import WiiEmulator
from bns.hardware.tracking.kinds import open_tracker
from bns.hardware.tracking.rigid import best_fit, fit, placed
from bns.hardware.tracking.wii import EVENT, LEDS_M, Overhead, WiiTracker

CAMERA = Overhead(2.4, 0.75)
POSE = np.array([0.2, -0.1, 0.7])


@pytest.fixture
def remote(tmp_path, clock):
    """remote(*faults) -> tracker, and a pose that can be set."""
    made = []

    def build(*faults, seed=0):
        path = tmp_path / f"remote{len(made)}"
        pose = POSE.copy()
        emulator = WiiEmulator(path, lambda _t: pose, CAMERA, clock, Faults(tuple(faults), seed), seed)
        tracker = WiiTracker(str(path), CAMERA, clock)
        made.append((emulator, tracker))
        return tracker, pose

    yield build
    for emulator, tracker in made:
        emulator.close()
        tracker.close()


def look(tracker, clock, seconds=0.02):
    clock.sleep(seconds)
    return tracker.look()


def close(pose, to):
    np.testing.assert_allclose(pose[:2], to[:2], atol=0.004)
    assert abs(np.angle(np.exp(1j * (pose[2] - to[2])))) < 0.06


@pytest.mark.parametrize("heading", [-3.0, 0.0, 1.5, 3.1])
def test_fit_is_the_inverse_of_placing(heading):
    pose = np.array([0.3, -0.2, heading])
    found, rms = fit(LEDS_M, placed(LEDS_M, pose))
    np.testing.assert_allclose(found, pose, atol=1e-12)
    assert rms < 1e-12


def test_ahead_and_right_are_where_the_robot_s_frame_says():
    north = placed(np.array([[0.0, 0.1], [0.1, 0.0]]), np.array([1.0, 2.0, np.pi / 2]))
    np.testing.assert_allclose(north, [[1.0, 2.1], [1.1, 2.0]], atol=1e-12)


def test_lights_may_change_places_and_strangers_be_among_them():
    seen = np.vstack([placed(LEDS_M, POSE)[[2, 0, 1]], [[0.25, -0.05]]])
    pose, _ = best_fit(LEDS_M, seen, 0.006)
    np.testing.assert_allclose(pose, POSE, atol=1e-9)


def test_a_mirrored_triangle_is_not_the_robot():
    mirrored = placed(LEDS_M * [-1, 1], POSE)
    assert best_fit(LEDS_M, mirrored, 0.006) is None
    assert best_fit(LEDS_M, mirrored[:2], 0.006) is None


def test_pixels_and_floor_are_inverse():
    floor = np.array([[0.3, -0.2], [-0.5, 0.4]])
    turned = Overhead(1.8, 0.6, 0.1, -0.2, 1.1)
    np.testing.assert_allclose(turned.floor_m(turned.px(floor)), floor, atol=1e-12)
    np.testing.assert_allclose(CAMERA.floor_m(np.array([[512.0, 384.0]])), [[0.0, 0.0]], atol=1e-12)
    assert CAMERA.px(np.array([[0.1, 0.0]]))[0, 0] > 512
    assert CAMERA.px(np.array([[0.0, 0.1]]))[0, 1] < 384


def test_accuracy_on_jittered_events(remote, clock):
    tracker, pose = remote()
    draw, errors = np.random.default_rng(1), []
    for _ in range(300):
        pose[:] = draw.uniform([-0.7, -0.5, -3.1], [0.7, 0.5, 3.1])
        errors.append(look(tracker, clock).pose - pose)
    errors = np.array(errors)
    errors[:, 2] = np.angle(np.exp(1j * errors[:, 2]))
    position_m, heading_rad = np.sqrt(np.mean(np.sum(errors[:, :2] ** 2, axis=1))), np.sqrt(np.mean(errors[:, 2] ** 2))
    assert position_m <= 0.003
    assert heading_rad <= np.radians(1.0)


@pytest.mark.parametrize("kind", ["swapped-markers", "reflection"])
def test_swapped_lights_and_reflections_do_no_harm(remote, clock, kind):
    tracker, pose = remote(Fault(kind, rate=1.0))
    for _ in range(50):
        sight = look(tracker, clock)
        close(sight.pose, pose)


def test_a_lost_light_is_a_lost_robot(remote, clock):
    tracker, _ = remote(Fault("lost-marker", at_s=1.0, for_s=1.0))
    assert look(tracker, clock) is not None
    clock.sleep(1.0)
    assert look(tracker, clock, 0.1) is None
    clock.sleep(2.0)
    assert look(tracker, clock) is not None


def test_off_the_picture_is_lost(remote, clock):
    tracker, pose = remote()
    assert look(tracker, clock) is not None
    pose[0] = 3.0
    assert look(tracker, clock) is None


def test_a_picture_that_stands_still_keeps_its_time(remote, clock):
    tracker, pose = remote(Fault("stuck-marker", at_s=0.5, for_s=9.0))
    assert look(tracker, clock).t_s == pytest.approx(0.02)
    clock.sleep(1.0)
    pose[0] += 0.3
    stuck = [look(tracker, clock, 0.5).t_s for _ in range(3)]
    assert len(set(stuck)) == 1


def test_events_the_kernel_threw_away(remote, clock):
    tracker, pose = remote()
    for _ in range(800):  # more than the pipe holds
        clock.sleep(0.02)
    pose[:] = [0.4, 0.3, 1.0]
    sight = look(tracker, clock)
    close(sight.pose, pose)


def test_an_event_is_the_kernel_s_24_bytes():
    assert EVENT.size == 24
    assert EVENT.pack(1, 2, 3, 0x10, 512).hex() == "0100000000000000" "0200000000000000" "0300" "1000" "00020000"


def test_settings_and_devices_that_cannot_be_used(tmp_path, clock):
    with pytest.raises(HardwareError, match=r"unknown kind of tracker 'wi'. Did you mean 'wii'"):
        open_tracker({"kind": "wi"}, clock)
    with pytest.raises(HardwareError, match="lacks height_m, view_rad"):
        open_tracker({"kind": "wii", "device": "x"}, clock)
    with pytest.raises(HardwareError, match=r"unknown setting 'hight_m'. Did you mean 'height_m'"):
        open_tracker({"kind": "wii", "device": "x", "height_m": 1, "view_rad": 1, "hight_m": 2}, clock)
    with pytest.raises(HardwareError, match=r"cannot open the Wii remote .*Press 1\+2"):
        open_tracker({"kind": "wii", "device": str(tmp_path / "none"), "height_m": 1, "view_rad": 1}, clock)


def test_half_an_event_waits_for_its_other_half(tmp_path, clock):
    path = tmp_path / "fifo"
    os.mkfifo(path)
    tracker = WiiTracker(str(path), CAMERA, clock)
    lights = np.rint(CAMERA.px(placed(LEDS_M, POSE))).astype(int)
    stream = b"".join(EVENT.pack(0, 0, 3, 0x10 + 2 * i + a, int(lights[i, a])) for i in range(3) for a in range(2))
    stream += EVENT.pack(0, 0, 0, 0, 0)
    with path.open("wb", buffering=0) as end:
        end.write(stream[:31])
        assert tracker.look() is None
        end.write(stream[31:])
        close(tracker.look().pose, POSE)
    tracker.close()
