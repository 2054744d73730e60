"""Poses from the Wii remote's events: accuracy, names of lights, what is lost."""

import os

import numpy as np
import pytest

from bns.cli.main import main
from bns.errors import HardwareError
from bns.hardware.clock import EmulatedClock, RealClock
from bns.hardware.emulators.devices.wii import WiiEmulator, defuzzed, sensed_px
from bns.hardware.emulators.faults import Fault, Faults
from bns.hardware.rig import shipped_rig
from bns.hardware.tracking.infrared.evdev import EVENT, device_file, input_devices
from bns.hardware.tracking.infrared.wii_calibration import ON_THE_START, hanging, look_at_lights
from bns.hardware.tracking.infrared.wii_pulse import Pulse, battery_of
from bns.hardware.tracking.kinds import open_tracker
from bns.hardware.tracking.rigid import best_fit, fit, placed
from bns.hardware.tracking.wii import LEDS_M, Overhead, WiiTracker, overhead

CAMERA = Overhead(2.4, 0.75)
POSE = np.array([0.2, -0.1, 0.7])


@pytest.fixture
def remote(tmp_path, clock):
    """remote(*faults) -> tracker, and a pose that can be set."""
    made = []

    def build(*faults, seed=0, camera=CAMERA, **settings):
        path = tmp_path / f"remote{len(made)}"
        pose = POSE.copy()
        emulator = WiiEmulator(path, lambda _t: pose, camera, clock, Faults(tuple(faults), seed), seed, **settings)
        tracker = WiiTracker(str(path), camera, clock, pulse=Pulse(emulator.battery, clock))
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
    for turned in (Overhead(1.8, 0.6, 0.1, -0.2, 1.1), Overhead(1.8, 0.6, 0.1, -0.2, 1.1, mirror=True)):
        np.testing.assert_allclose(turned.floor_m(turned.px(floor)), floor, atol=1e-12)
        np.testing.assert_allclose(turned.px(floor), sensed_px(floor, turned), atol=1e-9)
    np.testing.assert_allclose(CAMERA.floor_m(np.array([[512.0, 384.0]])), [[0.0, 0.0]], atol=1e-12)
    assert CAMERA.px(np.array([[0.1, 0.0]]))[0, 0] > 512
    assert CAMERA.px(np.array([[0.0, 0.1]]))[0, 1] > 384  # the kernel hands y on as the camera has it: upwards


def test_the_kernel_s_events_of_three_lights():
    """Bytes written down by hand after hid-wiimote-modules.c: a robot east and north of the middle, that looks east."""
    camera = Overhead(1.8, 0.785)  # 1.456 mm a pixel
    east, north = 512 + round(0.30 / 0.001456), 384 + round(0.20 / 0.001456)  # a pixel more is 1.456 mm further
    ahead, left, right = (round(m / 0.001456) for m in (0.060, 0.045, 0.020))
    lights = [(east + ahead, north), (east - 14, north + left), (east - 34, north - right)]  # LEDS_M, 20 and 50 mm behind
    pose, _ = best_fit(LEDS_M, camera.floor_m(np.array(lights, float)), 0.006)
    np.testing.assert_allclose(pose[:2], [0.30, 0.20], atol=0.002)
    assert abs(pose[2]) < 0.02


@pytest.mark.parametrize(
    ("new", "old", "handed_on"),
    [(500, 500, 500), (501, 500, 500), (499, 500, 499), (502, 500, 501), (497, 500, 498), (504, 500, 504), (1023, 500, 1023)],
)
def test_small_changes_are_smoothed_as_the_kernel_does(new, old, handed_on):
    assert defuzzed(new, old) == handed_on  # by hand, after input_defuzz_abs_event with a fuzz of 2


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


def test_a_robot_that_stands_without_jitter_is_seen(remote, clock):
    tracker, pose = remote(jitter_px=0.0)
    for _ in range(20):
        sight = look(tracker, clock, 0.5)
        assert clock.now_s() - sight.t_s <= 0.05
        close(sight.pose, pose)


def test_a_remote_that_does_not_answer_is_not_taken_for_a_robot_that_stands(remote, clock):
    tracker, _ = remote(Fault("stuck-marker", at_s=1.0, for_s=9.0), jitter_px=0.0)
    assert look(tracker, clock, 0.5).t_s == pytest.approx(0.5, abs=0.05)
    old = [look(tracker, clock, 1.0).t_s for _ in range(3)]
    assert max(old) <= 1.05


def test_the_remote_is_found_by_the_name_that_the_kernel_gives_it(tmp_path):
    for number, name in ((3, "Nintendo Wii Remote Accelerometer"), (12, "Nintendo Wii Remote IR"), (5, "Power Button")):
        (tmp_path / f"event{number}" / "device" / "device" / "power_supply" / "wiimote_battery_1").mkdir(parents=True)
        (tmp_path / f"event{number}" / "device" / "name").write_text(f"{name}\n")
        (tmp_path / f"event{number}" / "device" / "device" / "power_supply" / "wiimote_battery_1" / "capacity").write_text("80\n")
    assert [d.file.name for d in input_devices(tmp_path)] == ["event3", "event5", "event12"]
    assert device_file("Nintendo Wii Remote IR", tmp_path) == "/dev/input/event12"
    assert battery_of("/dev/input/event12", tmp_path).read_text() == "80\n"
    assert device_file("/dev/input/event3", tmp_path) == "/dev/input/event3"
    with pytest.raises(HardwareError, match=r"no input device is called 'Nintendo Wii'; there are: .*Wii Remote IR, Power"):
        device_file("Nintendo Wii", tmp_path)
    (tmp_path / "event5" / "device" / "name").write_text("Nintendo Wii Remote IR\n")
    with pytest.raises(HardwareError, match="2 input devices are called"):
        device_file("Nintendo Wii Remote IR", tmp_path)


def test_the_pulse_of_a_driver_s_file_is_felt_in_a_thread(tmp_path, monkeypatch):
    monkeypatch.setattr("bns.hardware.tracking.infrared.wii_pulse._SYSFS", str(tmp_path))
    battery, clock = tmp_path / "capacity", RealClock()
    os.mkfifo(battery)  # a remote that takes its time to answer
    pulse = Pulse(battery, clock)
    began_s = clock.now_s()
    assert pulse.last_s(began_s - 1.0) == began_s - 1.0
    assert clock.now_s() - began_s < 0.5  # nobody waits
    battery.write_text("80\n")  # until somebody reads
    while pulse.last_s(-1.0) < 0:
        assert clock.now_s() - began_s < 20.0
        clock.sleep(0.01)
    pulse.close()


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
    with pytest.raises(HardwareError, match="mirror is 'no'; it is true or false"):
        open_tracker({"kind": "wii", "device": "/x", "height_m": 1, "view_rad": 1, "mirror": "no"}, clock)
    with pytest.raises(HardwareError, match=r"cannot open the Wii remote .*Press 1\+2"):
        open_tracker({"kind": "wii", "device": str(tmp_path / "none"), "height_m": 1, "view_rad": 1}, clock)


@pytest.mark.parametrize("mirror", [False, True])
@pytest.mark.parametrize("up_rad", [-2.5, 0.0, 1.6])
def test_how_the_remote_hangs_is_found_from_a_robot_on_its_start(remote, clock, up_rad, mirror):
    hangs = Overhead(1.8, 0.75, 0.12, -0.07, up_rad, mirror)
    tracker, pose = remote(camera=hangs)
    pose[:] = [0.0, 0.0, np.pi / 2]
    found = hanging(look_at_lights(tracker, clock), pose, 1.8)
    assert found.camera.mirror is mirror
    assert abs(np.angle(np.exp(1j * (found.camera.up_rad - up_rad)))) < 0.02
    assert found.camera.view_rad == pytest.approx(0.75, rel=0.03)
    np.testing.assert_allclose([found.camera.x_m, found.camera.y_m], [0.12, -0.07], atol=0.006)
    assert found.mirrored_rms_m > 3 * found.rms_m
    assert f"mirror: {str(mirror).lower()}" in found.in_words()


def test_lights_that_tell_nothing_of_how_it_hangs(remote, clock):
    alike = np.array([[0.0, 0.06], [-0.05, -0.03], [0.05, -0.03]])
    with pytest.raises(HardwareError, match=r"do not fit the LEDs clearly.*sides must differ"):
        hanging(CAMERA.px(placed(alike, POSE)), POSE, 2.4, alike)
    with pytest.raises(HardwareError, match="2 lights are seen; 3 are needed"):
        hanging(np.zeros((2, 2)), POSE, 2.4)
    tracker, pose = remote()
    pose[0] = 9.0
    with pytest.raises(HardwareError, match="3 lights were seen in 0 of 500 looks"):
        look_at_lights(tracker, clock)


def test_calibrate_asks_for_the_rig_and_writes_what_it_found(tmp_path, monkeypatch, capsys):
    clock = EmulatedClock(np.inf)
    start = ON_THE_START
    emulator = WiiEmulator(tmp_path / "remote", lambda _t: start, Overhead(1.8, 0.7, mirror=True), clock)
    rig = tmp_path / "rig.yaml"
    text = "robot: khepera\nport: x\nsurface_m: {x: [-0.5, 0.5], y: [-0.5, 0.5]}\n"
    rig.write_text(f"{text}tracker: {{kind: wii, device: {emulator.path}, height_m: 1.8, view_rad: 0.5}}\n")
    monkeypatch.setattr("bns.cli.commands.camera.RealClock", lambda: clock)
    monkeypatch.setattr("builtins.input", lambda _text: "")
    assert main(["calibrate", "--wii", "--rig", str(rig)]) == 0
    said = capsys.readouterr().out
    assert "mirror: true" in said
    assert "at that height the camera sees 1.3" in said
    assert main(["calibrate", "--wii"]) == 2
    assert "--wii needs --rig FILE" in capsys.readouterr().err
    emulator.close()


def test_the_shipped_camera_sees_the_shipped_surface():
    rig = shipped_rig("khepera")
    camera = overhead(rig.tracker)
    edge = rig.limits.surface
    corners = np.array([[x, y] for x in (edge.x_low_m, edge.x_high_m) for y in (edge.y_low_m, edge.y_high_m)])
    px = sensed_px(corners, camera)
    assert ((px >= 0) & (px <= [1023, 767])).all()


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
