"""What a tracker sees, and how a camera comes to be calibrated: the work behind `bns track` and `bns calibrate`."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from pathlib import Path

import numpy as np

from bns.errors import HardwareError
from bns.extras import extra
from bns.hardware.clock import Clock
from bns.hardware.rig import Rig
from bns.hardware.tracking.calibration import Board, Calibration, calibrate, corners, load_calibration
from bns.hardware.tracking.camera import FrameTracker, StreamCamera, annotated, open_camera
from bns.hardware.tracking.colour import detector, markers_of
from bns.hardware.tracking.colour_preview import drawn, report
from bns.hardware.tracking.kinds import checked, open_tracker
from bns.hardware.tracking.sight import Sight

with extra("robot"):
    import cv2

_PICTURES = {".png", ".jpg", ".jpeg", ".bmp"}
_MOVED_PX = 25.0
_LOOK_S = 0.2


def watch(rig: Rig, clock: Clock, seconds: float, folder: Path | None, say: Callable[[str], None]) -> tuple[int, int]:
    """Look for `seconds`, say what is seen, write annotated frames into `folder`; (looks, of them seen)."""
    tracker = open_tracker(rig.tracker, clock)
    looks = seen = 0
    try:
        if folder is not None:
            if not isinstance(tracker, FrameTracker):
                raise HardwareError(f"the {rig.tracker['kind']} tracker has no pictures to write; leave --frames out.")
            folder.mkdir(parents=True, exist_ok=True)
        end_s = clock.now_s() + seconds
        while clock.now_s() < end_s:
            sight = tracker.look()
            if sight is None and (gone := str(getattr(tracker, "gone", ""))):
                raise HardwareError(gone)
            looks, seen = looks + 1, seen + (sight is not None)
            say(in_words(sight))
            if folder is not None:
                _draw(tracker, rig, sight, folder / f"frame-{looks:04d}.png")
            clock.sleep(_LOOK_S)
    finally:
        tracker.close()
    return looks, seen


def coloured(rig: Rig, clock: Clock) -> tuple[str, bytes]:
    """What the rig's colour tracker makes of a picture: in words, and drawn (PNG). HardwareError if it is of another kind."""
    if rig.tracker["kind"] != "colour":
        raise HardwareError(f"the tracker of the rig is {rig.tracker['kind']}; colours are looked at by kind: colour.")
    settings = checked(rig.tracker)
    camera = open_camera(settings, clock)
    try:
        clock.sleep(_LOOK_S)
        frame = camera.newest()
    finally:
        camera.close()
    if frame is None:
        raise HardwareError("the camera is disconnected; plug it in again.")
    find = detector(settings)
    good, coded = cv2.imencode(".png", drawn(frame.picture, find))
    assert good
    return report(frame.picture, find, markers_of(settings)), coded.tobytes()


def in_words(sight: Sight | None) -> str:
    """One line."""
    if sight is None:
        return "lost"
    x_m, y_m, heading_rad = sight.pose
    return f"x {x_m:+.3f} m  y {y_m:+.3f} m  heading {np.degrees(heading_rad):+7.1f}°  residual {1000 * sight.residual_m:.1f} mm"


def _draw(tracker: object, rig: Rig, sight: Sight | None, path: Path) -> None:
    frame = tracker.camera.newest() if isinstance(tracker, FrameTracker) else None
    if frame is None:
        return
    lens, height_m = load_calibration(Path(str(rig.tracker["calibration"]))).lens, float(rig.tracker["height_m"])
    picture = annotated(frame, sight, lambda p: lens.px(np.column_stack([p, np.full(len(p), height_m)])))
    cv2.imwrite(str(path), picture)


def pictures(folder: Path) -> list[np.ndarray]:
    """The pictures of a folder in the order of their names; HardwareError if there are none, or of different sizes."""
    files = sorted(f for f in folder.iterdir() if f.suffix.lower() in _PICTURES) if folder.is_dir() else []
    found = [picture for picture in (cv2.imread(str(f)) for f in files) if picture is not None]
    if not found:
        raise HardwareError(f"there are no pictures in {folder}; give a folder of PNG or JPEG files, or --camera.")
    if len({picture.shape for picture in found}) > 1:
        raise HardwareError(f"the pictures in {folder} differ in size; take all with the same camera in the same mode.")
    return found


def views(camera: StreamCamera, board: Board, count: int, clock: Clock, say: Callable[[str], None]) -> list[np.ndarray]:
    """So many frames that show the board, each moved against the one before."""
    kept: list[np.ndarray] = []
    last: np.ndarray | None = None
    while len(kept) < count:
        frame = camera.newest()
        if frame is None:
            raise HardwareError("the camera is disconnected; plug it in again.")
        found = corners(frame.picture, board)
        if found is not None:
            middle = found[1].reshape(-1, 2).mean(axis=0)
            if last is None or np.hypot(*(middle - last)) > _MOVED_PX:
                kept, last = [*kept, frame.picture], middle
                say(f"view {len(kept)} of {count}; move and tilt the board")
        clock.sleep(_LOOK_S)
    return kept


def from_folder(folder: Path, floors: Sequence[Path], board: Board) -> Calibration:
    """Calibration from pictures; the floor is seen in `floors`, or in the last of them."""
    found = pictures(folder)
    flat = [cv2.imread(str(path)) for path in floors] or [found[-1]]
    for path, picture in zip(floors, flat, strict=False):
        if picture is None:
            raise HardwareError(f"cannot read the picture of the floor {path}.")
    return calibrate(found, [picture for picture in flat if picture is not None], board, str(folder))
