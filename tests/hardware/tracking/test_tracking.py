"""Markers in rendered frames, through a lens that was calibrated on rendered frames."""

import time
from types import SimpleNamespace

import cv2
import numpy as np
import pytest

from bns.cli.commands import camera
from bns.cli.main import main
from bns.errors import HardwareError
from bns.hardware.clock import EmulatedClock
from bns.hardware.emulators.camera import CameraEmulator
from bns.hardware.emulators.scene import Patch, Scene, disc, flat, tag
from bns.hardware.tracking.aruco import ArucoDetector
from bns.hardware.tracking.calibration import (
    Board,
    Calibration,
    calibrate,
    check_size,
    load_calibration,
)
from bns.hardware.tracking.camera import Frame, FrameTracker, StreamCamera
from bns.hardware.tracking.colour import ColourDetector, Markers
from bns.hardware.tracking.kinds import open_tracker
from bns.hardware.tracking.lens import looking_down
from bns.registry import PLATFORMS

MATRIX = np.array([[620.0, 0, 482], [0, 620, 268], [0, 0, 1]])
DISTORTION = np.array([-0.25, 0.08, 0.001, -0.0005, 0.0])
TRUE = looking_down(MATRIX, DISTORTION, (960, 540), 1.3, 0.05)
HEIGHT_M = 0.06
MARKERS = Markers(0.04, HEIGHT_M, 0.12)
YELLOW, GREEN = (30, 210, 240), (60, 180, 40)


@pytest.fixture(scope="module")
def scene():
    return Scene(TRUE, seed=1)


def view(scene, picture, board, draw):
    """The board held into the camera's view somewhere, tilted somehow."""
    turn, _ = cv2.Rodrigues(draw.uniform([-0.6, -0.6, -0.4], [0.6, 0.6, 0.4]))
    away_m = draw.uniform(0.45, 0.7)
    place = TRUE.on_plane(draw.uniform([260, 150], [700, 390])[None], 1.3 - away_m)[0]
    texture = cv2.cvtColor(picture, cv2.COLOR_GRAY2BGR)
    everywhere = np.full(picture.shape, 255, np.uint8)
    return scene.frame([Patch(texture, everywhere, board.size_m[0], turn, np.array([*place, 1.3 - away_m]))])


@pytest.fixture(scope="module")
def shots(scene):
    """Views of the board, and the board on the floor."""
    board, draw = Board(), np.random.default_rng(0)
    picture = board.picture(2500)
    floor = scene.frame([flat(picture, board.size_m[0], 0.0, 0.0, np.pi / 2, 0.0)])
    return [view(scene, picture, board, draw) for _ in range(12)], floor


@pytest.fixture(scope="module")
def calibration(shots):
    frames, floor = shots
    return calibrate(frames, [floor], Board(), "emulated")


def worn(kind, pose):
    x, y, heading = pose
    if kind == "aruco":
        return [tag(0, 0.09, x, y, heading, HEIGHT_M)]
    dx, dy = 0.06 * np.cos(heading), 0.06 * np.sin(heading)
    return [disc(YELLOW, 0.04, x - dx, y - dy, HEIGHT_M), disc(GREEN, 0.04, x + dx, y + dy, HEIGHT_M)]


def detector(kind, lens):
    return ArucoDetector(lens, 0, 0.09, HEIGHT_M) if kind == "aruco" else ColourDetector(lens, MARKERS)


KINDS = pytest.mark.parametrize("kind", ["aruco", "colour"])


def test_calibration_finds_the_lens_and_the_floor(calibration):
    lens = calibration.lens
    assert calibration.rms_px < 0.2
    assert lens.matrix[0, 0] == pytest.approx(620, rel=0.005)
    assert lens.matrix[:2, 2] == pytest.approx([482, 268], abs=3.0)
    np.testing.assert_allclose(lens.rotation, TRUE.rotation, atol=0.01)
    np.testing.assert_allclose(lens.shift_m, TRUE.shift_m, atol=0.01)


def test_calibration_file_round_trip(calibration, tmp_path):
    calibration.save(tmp_path / "camera.json")
    again = load_calibration(tmp_path / "camera.json")
    np.testing.assert_array_equal(again.lens.matrix, calibration.lens.matrix)
    assert again.camera == "emulated"
    assert (again.views, again.floor_views) == (calibration.views, 1)
    assert (again.floor_rms_m, again.floor_worst_m) == (calibration.floor_rms_m, calibration.floor_worst_m)
    assert 0.0 < again.floor_rms_m < again.floor_worst_m
    assert [f.name for f in tmp_path.iterdir()] == ["camera.json"]


@KINDS
def test_accuracy_on_noisy_distorted_frames(scene, calibration, kind):
    draw, errors = np.random.default_rng(2), []
    find = detector(kind, calibration.lens).find
    for _ in range(25):
        pose = draw.uniform([-0.75, -0.4, -3.1], [0.75, 0.4, 3.1])
        sight = find(Frame(0.0, scene.frame(worn(kind, pose))))
        if sight is not None:
            errors.append(sight.pose - pose)
    errors = np.array(errors)
    errors[:, 2] = np.angle(np.exp(1j * errors[:, 2]))
    assert len(errors) >= 22
    assert np.sqrt(np.mean(np.sum(errors[:, :2] ** 2, axis=1))) <= 0.003
    assert np.sqrt(np.mean(errors[:, 2] ** 2)) <= np.radians(1.0)


def test_parallax_is_taken_out_at_the_marker_s_height(scene):
    pose = np.array([0.6, 0.3, 0.5])
    frame = Frame(0.0, scene.frame(worn("aruco", pose)))
    wrong = ArucoDetector(TRUE, 0, 0.09, 0.0).find(frame)
    assert np.hypot(*(wrong.pose - pose)[:2]) > 0.02
    assert np.hypot(*(ArucoDetector(TRUE, 0, 0.09, HEIGHT_M).find(frame).pose - pose)[:2]) < 0.002


@KINDS
def test_nothing_there_is_lost(scene, kind):
    assert detector(kind, TRUE).find(Frame(0.0, scene.frame([]))) is None
    half = worn(kind, (0.0, 0.0, 0.0))[:1] if kind == "colour" else [tag(3, 0.09, 0, 0, 0, HEIGHT_M)]
    assert detector(kind, TRUE).find(Frame(0.0, scene.frame(half))) is None


@pytest.mark.parametrize(
    "stranger",
    [
        disc(YELLOW, 0.04, 0.3, 0.2, HEIGHT_M),
        disc(GREEN, 0.04, -0.3, 0.2, HEIGHT_M),
    ],
)
def test_a_second_marker_of_a_colour_is_not_guessed_away(scene, stranger):
    frame = scene.frame([*worn("colour", (0.0, 0.0, 0.4)), stranger])
    assert detector("colour", TRUE).find(Frame(0.0, frame)) is None


@pytest.mark.parametrize("diameter_m", [0.012, 0.12])
def test_things_of_another_size_are_no_markers(scene, diameter_m):
    frame = scene.frame([*worn("colour", (0.0, 0.0, 0.4)), disc(YELLOW, diameter_m, 0.3, 0.2, HEIGHT_M)])
    np.testing.assert_allclose(detector("colour", TRUE).find(Frame(0.0, frame)).pose, [0, 0, 0.4], atol=0.01)


def test_long_things_are_no_markers(scene):
    stripe = flat(np.full((20, 90, 3), YELLOW, np.uint8), 0.075, 0.3, 0.2, 0.3, HEIGHT_M)
    frame = scene.frame([*worn("colour", (0.0, 0.0, 0.4)), stripe])
    np.testing.assert_allclose(detector("colour", TRUE).find(Frame(0.0, frame)).pose, [0, 0, 0.4], atol=0.01)


def test_markers_at_the_wrong_distance_are_not_the_robot(scene):
    apart = [disc(YELLOW, 0.04, -0.2, 0.0, HEIGHT_M), disc(GREEN, 0.04, 0.2, 0.0, HEIGHT_M)]
    frame = Frame(0.0, scene.frame(apart))
    assert ColourDetector(TRUE, MARKERS).find(frame) is None
    free = ColourDetector(TRUE, Markers(0.04, HEIGHT_M)).find(frame)
    assert free.points["green"][0] - free.points["yellow"][0] == pytest.approx(0.4, abs=0.003)


def test_colours_too_close_are_refused():
    with pytest.raises(HardwareError, match=r"marker colours are too close: hues \(20, 38\) and \(40, 60\) leave 2"):
        Markers(0.04, 0.06, green=(40, 60))


def test_calibrations_that_do_not_fit(tmp_path, shots):
    with pytest.raises(HardwareError, match=r"has no calibration.*bns calibrate"):
        load_calibration(tmp_path / "none.json")
    (tmp_path / "bad.json").write_text("{}")
    with pytest.raises(HardwareError, match=r"is no calibration.*make it again"):
        load_calibration(tmp_path / "bad.json")
    with pytest.raises(HardwareError, match="960 x 540 pixels, the camera gives 640 x 480: another camera"):
        check_size(Calibration(TRUE, 0.1, 12, "cam"), np.zeros((480, 640, 3)))
    frames, floor = shots
    with pytest.raises(HardwareError, match="seen in 0 of 3 frames; at least 8"):
        calibrate([np.zeros_like(floor)] * 3, [floor], Board(), "cam")
    with pytest.raises(HardwareError, match="not seen in the picture of the floor"):
        calibrate(frames, [np.zeros_like(floor)], Board(), "cam")


def test_calibrate_and_board_from_the_command_line(tmp_path, shots, capsys):
    frames, floor = shots
    (tmp_path / "views").mkdir()
    for i, frame in enumerate([*frames, floor]):
        cv2.imwrite(str(tmp_path / "views" / f"{i:02d}.png"), frame)
    out = tmp_path / "camera.json"
    assert main(["calibrate", "--frames", str(tmp_path / "views"), "-o", str(out)]) == 0
    assert "the camera is 1.30 m above the floor" in capsys.readouterr().out
    assert load_calibration(out).views >= 12
    assert main(["calibrate", "--print-board", str(tmp_path / "board.png")]) == 0
    assert "408 x 272 mm" in capsys.readouterr().out
    assert cv2.imread(str(tmp_path / "board.png")).shape == (3213, 4819, 3)
    assert main(["calibrate", "--frames", str(tmp_path / "none")]) == 2
    assert "there are no pictures" in capsys.readouterr().err


def test_a_stream_is_read_newest_first_and_its_end_is_noticed(scene):
    shown = [0.0]

    def render():
        shown[0] += 0.01
        return scene.frame(worn("aruco", (shown[0], 0.0, 0.3)))

    clock = EmulatedClock(2.0)
    with CameraEmulator(render, clock, rate_hz=20) as camera:
        reader = StreamCamera(camera.address, clock)
        tracker = FrameTracker(reader, ArucoDetector(TRUE, 0, 0.09, HEIGHT_M).find)
        for _ in range(3):
            clock.sleep(0.31)
            sight = tracker.look()
            assert abs(sight.pose[0] - shown[0]) < 0.005  # a buffer of old frames would lag behind by a centimetre and more
            assert 0 <= clock.now_s() - sight.t_s < 1 / 20 + 0.01
        camera.close()
        deadline = time.monotonic() + 5
        while tracker.look() is not None and time.monotonic() < deadline:
            time.sleep(0.05)
        assert tracker.look() is None
        tracker.close()


def test_a_camera_that_hangs_shows_nothing_new(scene):
    shown = [scene.frame([]), scene.frame([])]  # alike but for the noise
    clock = EmulatedClock(np.inf)
    with CameraEmulator(lambda: shown[0] if clock.now_s() < 1.0 else shown[1], clock, rate_hz=10) as camera:
        reader = StreamCamera(camera.address, clock)
        began_s = reader.newest().t_s
        clock.sleep(0.5)
        assert reader.newest().t_s == began_s
        clock.sleep(0.6)
        assert reader.newest().t_s > 1.0
        reader.close()


def test_track_shows_what_is_seen(tmp_path, capsys):
    rig = tmp_path / "rig.yaml"
    rig.write_text(
        "robot: khepera\nport: x\nsurface_m: {x: [-0.9, 0.9], y: [-0.7, 0.7]}\n"
        "tracker: {kind: aruco, camera: 0, calibration: c.json, side_m: 0.09, height_m: 0.07}\n"
    )
    asked = ["track", "--rig", str(rig), "--emulated", "--seconds", "1", "--frames", str(tmp_path / "frames")]
    assert main(asked) == 0
    said = capsys.readouterr().out
    assert "heading   +90." in said or "heading   +89." in said
    assert len(list((tmp_path / "frames").glob("*.png"))) >= 4
    assert main(["track"]) == 2


@pytest.mark.parametrize(("named", "said"), [([], ""), (["--robot", "khepera"], "a rig for snake, and the trial is for khepera")])
def test_the_robot_is_that_of_the_rig(tmp_path, capsys, named, said):
    rig = tmp_path / "rig.yaml"
    rig.write_text(PLATFORMS.load("snake").RIG.read_text())
    asked = ["track", "--rig", str(rig), "--emulated", "--seconds", "0.5s", *named]
    assert main(asked) == (2 if said else 0)
    assert said in capsys.readouterr().err
    colours = ["calibrate", "--colours", str(tmp_path / "seen.png"), "--rig", str(rig), "--emulated", *named]
    assert main(colours) == (2 if said else 0)
    assert said in capsys.readouterr().err
    assert camera._robot(SimpleNamespace(robot=None, rig=rig)) == "snake"
    assert camera._robot(SimpleNamespace(robot=None, rig=None)) == "khepera"
    assert camera._robot(SimpleNamespace(robot="khepera", rig=rig)) == "khepera"


def test_a_camera_that_is_not_there(tmp_path, clock):
    Calibration(TRUE, 0.1, 12, "cam").save(tmp_path / "c.json")
    settings = {"kind": "aruco", "camera": str(tmp_path / "none"), "calibration": str(tmp_path / "c.json")}
    with pytest.raises(HardwareError, match=r"camera .*none cannot be opened"):
        open_tracker(settings | {"side_m": 0.09, "height_m": 0.06}, clock)


def test_a_viewer_that_takes_no_frames_is_waited_for_once(scene, monkeypatch):
    monkeypatch.setattr("bns.hardware.emulators.camera._LONGEST_WAY_S", 0.05)
    clock, waits = EmulatedClock(np.inf), []
    with CameraEmulator(lambda: scene.frame([]), clock, rate_hz=10) as camera:
        camera._watched(1)  # it looks on and takes nothing
        wait_for = clock.arrivals.wait_for
        monkeypatch.setattr(clock.arrivals, "wait_for", lambda *a, **k: waits.append(wait_for(*a, **k)))
        for _ in range(3):
            camera.film()
        assert len(waits) == 1
        clock.arrived()  # somebody took one: frames are waited for again
        camera.film()
        assert len(waits) == 2
        camera._watched(-1)
