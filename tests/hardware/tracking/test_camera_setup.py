"""A camera made ready: how it takes its pictures, the printed board's scale, the floor from several places."""

import threading
import time
from types import SimpleNamespace

import cv2
import numpy as np
import pytest

from bns.cli.main import main
from bns.errors import HardwareError
from bns.hardware import looking
from bns.hardware.emulators.scene import Patch, Scene, flat
from bns.hardware.link.hardware_log import HardwareLog, events
from bns.hardware.tracking.calibration import Board, Calibration, _laid, calibrate, check_scale
from bns.hardware.tracking.camera import FrameTracker, StreamCamera
from bns.hardware.tracking.eye import Eye
from bns.hardware.tracking.floor_pose import Corners, floor_pose
from bns.hardware.tracking.kinds import open_tracker
from bns.hardware.tracking.lens import looking_down
from bns.hardware.tracking.sight import Sight

MATRIX = np.array([[820.0, 0, 642], [0, 820, 358], [0, 0, 1]])
DISTORTION = np.array([-0.25, 0.08, 0.001, -0.0005, 0.0])


def jpeg(picture, quality=80):
    return cv2.imdecode(cv2.imencode(".jpg", picture, [cv2.IMWRITE_JPEG_QUALITY, quality])[1], cv2.IMREAD_COLOR)


@pytest.fixture(scope="module")
def high_up():
    """A camera 1.9 m up, 1280 by 720; views of the board, and the board on the floor in three places; as JPEG of quality 80."""
    lens = looking_down(MATRIX, DISTORTION, (1280, 720), 1.9, 0.06)
    room, board, draw = Scene(lens, seed=4), Board(), np.random.default_rng(3)
    picture = board.picture(2500)
    held = []
    for _ in range(14):
        turn, _ = cv2.Rodrigues(draw.uniform([-0.6, -0.6, -0.4], [0.6, 0.6, 0.4]))
        away_m = draw.uniform(0.6, 0.95)
        place = lens.on_plane(draw.uniform([320, 190], [960, 530])[None], 1.9 - away_m)[0]
        texture, everywhere = cv2.cvtColor(picture, cv2.COLOR_GRAY2BGR), np.full(picture.shape, 255, np.uint8)
        held.append(jpeg(room.frame([Patch(texture, everywhere, board.size_m[0], turn, np.array([*place, 1.9 - away_m]))])))
    lain = [(0.0, 0.0, np.pi / 2), (-0.9, 0.35, 0.6), (0.85, -0.4, 2.3)]
    return lens, held, [jpeg(room.frame([flat(picture, board.size_m[0], *place, 0.0)])) for place in lain]


def off_on_the_floor_m(found, true):
    """How far points all over the floor are put wrong, RMS."""
    px = np.stack(np.meshgrid(np.linspace(90, 1190, 9), np.linspace(90, 630, 7)), axis=-1).reshape(-1, 2)
    return np.sqrt(np.mean(np.sum((found.on_plane(px, 0.0) - true.on_plane(px, 0.0)) ** 2, axis=1)))


def test_the_floor_from_three_places(high_up):
    true, held, floors = high_up
    one, three = calibrate(held, floors[:1], Board(), "high"), calibrate(held, floors, Board(), "high")
    assert three.floor_views == 3
    assert three.floor_rms_m <= 0.0015
    assert three.floor_rms_m <= three.floor_worst_m <= 0.005
    assert off_on_the_floor_m(three.lens, true) <= 0.0025
    assert off_on_the_floor_m(three.lens, true) < off_on_the_floor_m(one.lens, true)


def test_views_without_tilt_are_refused(high_up):
    """They fit well, to a lens of a third of the focal length under a camera of a third of the height."""
    lens, _, floors = high_up
    room, board, draw = Scene(lens, seed=4), Board(), np.random.default_rng(3)
    texture = cv2.cvtColor(board.picture(2500), cv2.COLOR_GRAY2BGR)
    held = []
    for _ in range(9):
        turn, _ = cv2.Rodrigues(np.array([0.0, 0.0, draw.uniform(-0.4, 0.4)]))
        place = np.array([*draw.uniform([-0.2, -0.1], [0.2, 0.1]), 1.1])
        everywhere = np.full(texture.shape[:2], 255, np.uint8)
        held.append(room.frame([Patch(texture, everywhere, board.size_m[0], turn, place)]))
    with pytest.raises(HardwareError, match=r"differ in tilt by [0-3] degrees at most; .*less than 15 .*tilted by 20 to 40"):
        calibrate(held, floors, board, "high")
    with pytest.raises(HardwareError, match=r"differ in tilt by 0 degrees at most"):
        calibrate(held[:1] * 9, floors, board, "high")


def test_a_floor_of_another_size_is_refused(high_up):
    _, held, floors = high_up
    taller = cv2.copyMakeBorder(floors[0], 120, 120, 0, 0, cv2.BORDER_REPLICATE)
    with pytest.raises(HardwareError, match=r"picture of the floor has 1280 x 960 pixels, the views have 1280 x 720"):
        calibrate(held, [taller], Board(), "high")


def test_a_floor_that_does_not_fit_is_refused(high_up, monkeypatch):
    _, held, floors = high_up

    def bent(frame, board):
        view = _laid(frame, board)
        px = view.px.copy()
        px[3::4] += 40.0
        return Corners(view.board_m, px)

    monkeypatch.setattr("bns.hardware.tracking.calibration._laid", bent)
    with pytest.raises(HardwareError, match=r"kept back are off by \d+ mm RMS, more than 10: is the board flat"):
        calibrate(held, floors, Board(), "high")


def test_kept_back_corners_have_no_part_in_the_floor(high_up):
    true, _, floors = high_up
    seen = [_laid(frame, Board()) for frame in floors]
    found = floor_pose(seen, true.matrix, true.distortion, true.size)
    spoilt = [view.px.copy() for view in seen]
    for px in spoilt:
        px[3::4] += 40.0
    moved = [Corners(view.board_m, px) for view, px in zip(seen, spoilt, strict=True)]
    other = floor_pose(moved, true.matrix, true.distortion, true.size)
    np.testing.assert_array_equal(other.lens.shift_m, found.lens.shift_m)
    assert other.rms_m > 0.05 > 10 * found.rms_m


def test_a_board_printed_to_another_scale_is_refused(tmp_path, capsys):
    check_scale(Board(), 0.4085)
    with pytest.raises(HardwareError, match=r"396 mm wide, not 408: printed at 97.1%.*--square-mm 66.00"):
        check_scale(Board(), 0.396)
    assert main(["calibrate", "--frames", str(tmp_path), "--measured-mm", "396"]) == 2
    assert "Print it without scaling" in capsys.readouterr().err


class Webcam:
    """A `cv2.VideoCapture` of a camera with modes and ranges of its own, as V4L2 drivers have them."""

    modes = ((640, 480), (1280, 720))

    def __init__(self, _source):
        self.values = {cv2.CAP_PROP_FRAME_WIDTH: 640.0, cv2.CAP_PROP_FRAME_HEIGHT: 480.0, cv2.CAP_PROP_EXPOSURE: 157.0}
        self.asked, self.count = {}, 0

    def isOpened(self):  # noqa: N802
        return True

    def set(self, what, value):
        self.asked[what] = value
        if what in {cv2.CAP_PROP_FRAME_WIDTH, cv2.CAP_PROP_FRAME_HEIGHT}:
            fits = [m for m in self.modes if m[what != cv2.CAP_PROP_FRAME_WIDTH] <= value]
            self.values[cv2.CAP_PROP_FRAME_WIDTH], self.values[cv2.CAP_PROP_FRAME_HEIGHT] = fits[-1]
        elif what == cv2.CAP_PROP_EXPOSURE:
            self.values[what] = value if self.asked.get(cv2.CAP_PROP_AUTO_EXPOSURE) == 1 else 157.0
        elif what != cv2.CAP_PROP_FOCUS:  # this one has a fixed focus
            self.values[what] = value
        return True

    def get(self, what):
        return self.values.get(what, 0.0)

    def read(self):
        self.count += 1
        time.sleep(0.01)
        width, height = (int(self.values[p]) for p in (cv2.CAP_PROP_FRAME_WIDTH, cv2.CAP_PROP_FRAME_HEIGHT))
        return True, np.full((height, width, 3), self.count % 250, np.uint8)

    def release(self):
        pass


def test_a_camera_is_set_and_read_back(monkeypatch, tmp_path, clock):
    monkeypatch.setattr(cv2, "VideoCapture", Webcam)
    lens = looking_down(MATRIX, DISTORTION, (1280, 720), 1.3, 0.05)
    Calibration(lens, 0.1, 12, "0", picture={"exposure": 300.0, "white_balance": 4600.0}).save(tmp_path / "c.json")
    settings = {"kind": "aruco", "camera": 0, "calibration": str(tmp_path / "c.json"), "side_m": 0.09, "height_m": 0.06}
    tracker = open_tracker(settings | {"exposure": 250}, clock)
    journal = HardwareLog(tmp_path / "j.jsonl", clock)
    Eye(tracker, clock, journal, 0.0).close()
    journal.close()
    (noted,) = events(tmp_path / "j.jsonl", "tracker")
    wanted = {"width_px": 1280.0, "height_px": 720.0, "exposure": 250.0, "focus": 0.0, "white_balance": 4600.0}
    assert noted["picture"] == wanted
    for change, message in (
        ({"focus": 30}, "takes no focus 30: it reads back 0"),
        ({"focus": 5}, "takes no focus 5: it reads back 0"),
        ({"exposure": "bright"}, "exposure is 'bright'; it is a number"),
    ):
        with pytest.raises(HardwareError, match=message):
            open_tracker(settings | change, clock)
    with pytest.raises(HardwareError, match="gives 1280 x 720 pixels, not 1920 x 1080"):
        StreamCamera("0", clock, (1920, 1080))
    camera = StreamCamera("0", clock, (1920, 1080), insist=False)
    assert camera.picture["width_px"] == 1280
    camera.close()


@pytest.mark.parametrize(
    ("then", "gone"),
    [
        ((False, None), "the camera 0 is gone: it was unplugged"),
        ((True, None), "the camera 0 is gone: it was unplugged"),
        (cv2.error("a picture that is none"), "the camera 0 failed (error: a picture that is none). Connect it again"),
        ((True, np.zeros((600, 800, 3), np.uint8)), "the camera 0 gave pictures of 1280 x 720 pixels, and now gives some of 800"),
    ],
)
def test_a_camera_that_is_unplugged_fails_or_changes_its_size_shows_nothing_more_and_says_why(monkeypatch, clock, then, gone):
    class Changing(Webcam):
        def read(self):
            if changed.is_set() and isinstance(then, Exception):
                raise then
            return super().read() if not changed.is_set() else then

    changed = threading.Event()
    monkeypatch.setattr(cv2, "VideoCapture", Changing)
    camera = StreamCamera("0", clock, (1280, 720))
    tracker = FrameTracker(camera, lambda frame: Sight(frame.t_s, np.zeros(3)))
    assert tracker.look() is not None
    assert tracker.gone == ""
    changed.set()
    camera._thread.join(timeout=30)
    assert tracker.look() is None
    assert tracker.gone.startswith(gone)
    rig = SimpleNamespace(tracker={"kind": "aruco"})
    monkeypatch.setattr(looking, "open_tracker", lambda *_: tracker)
    with pytest.raises(HardwareError, match=r"^the camera 0 "):
        looking.watch(rig, clock, 1.0, None, lambda _text: None)
