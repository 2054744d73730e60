"""Frames of a camera: a thread keeps the newest one, because what OpenCV hands out may have waited in a buffer."""

from __future__ import annotations

import math
import threading
import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Protocol

import numpy as np

from bns.errors import HardwareError
from bns.extras import extra
from bns.hardware.clock import Clock
from bns.hardware.tracking.calibration import check_size, load_calibration
from bns.hardware.tracking.picture import SETTINGS as PICTURE
from bns.hardware.tracking.picture import given, is_local, set_up
from bns.hardware.tracking.sight import Sight

with extra("robot"):
    import cv2

_STREAM_MS = 10_000
_FIRST_FRAME_S = 10.0
_OLDEST_S = 1.0
"""A stamp that says more is by another clock."""


@dataclass(frozen=True)
class Frame:
    """A picture (height, width, 3), BGR, and when the camera's driver got it; if that does not tell, when it arrived."""

    t_s: float
    picture: np.ndarray


class Camera(Protocol):
    """Gives frames."""

    def newest(self) -> Frame | None:
        """The newest frame; None if none has come yet or the camera is gone."""

    def close(self) -> None:
        """Let the camera go."""


def _capture(source: str) -> cv2.VideoCapture:
    """Opened, if it can be; a stream that is silent is given up sooner than after OpenCV's half a minute."""
    if source.isdecimal():
        return cv2.VideoCapture(int(source))
    if "://" not in source:
        return cv2.VideoCapture(source)
    waits = [cv2.CAP_PROP_OPEN_TIMEOUT_MSEC, _STREAM_MS, cv2.CAP_PROP_READ_TIMEOUT_MSEC, _STREAM_MS]
    return cv2.VideoCapture(source, cv2.CAP_FFMPEG, waits)


class StreamCamera:
    """Any camera or stream that `cv2.VideoCapture` opens: a number, a device file, an address.

    `size` (width, height) and `values` (exposure, focus, white balance) are set if it is at this computer; `picture` is what it
    reads back. Unless `insist`, another size than asked for is taken. A picture that is the one before to the last bit is none:
    sensors are never that still, but a camera that hangs is.
    """

    def __init__(
        self,
        source: str,
        clock: Clock,
        size: tuple[int, int] | None = None,
        values: Mapping[str, float] | None = None,
        insist: bool = True,
    ) -> None:
        self._clock, self._source = clock, source
        self._capture = _capture(source)
        if not self._capture.isOpened() and "://" in source:
            raise HardwareError(
                f"the address {source} gives no stream: nothing answers there within {_STREAM_MS / 1000:g} s, or no video. Is "
                "the camera on, does a browser show a picture at that address?"
            )
        if not self._capture.isOpened():
            raise HardwareError(
                f"the camera {source} cannot be opened. Is it plugged in, used by another program, are you in the group video? "
                "Try: bns doctor"
            )
        try:
            self.picture = set_up(self._capture, source, size if is_local(source) else None, values or {}, insist)
        except HardwareError:
            self._capture.release()
            raise
        self.stamps = ""
        """Who says when a frame was taken: the camera's driver, or its arrival."""
        self.gone = ""
        """What to do about a camera that will give no picture any more; nothing while it may give some."""
        self._frame: Frame | None = None
        self._arrived, self._open = threading.Event(), True
        self._thread = threading.Thread(target=self._read, name="camera", daemon=True)
        self._thread.start()
        if not self._arrived.wait(_FIRST_FRAME_S):
            self.close()
            raise HardwareError(f"the camera {source} is open but gives no picture; plug it in again.")

    def newest(self) -> Frame | None:
        """The frame that arrived last."""
        return self._frame

    def close(self) -> None:
        """End the thread, which lets the camera go: a camera released while it is being read from takes the process with it."""
        self._open = False
        self._thread.join(timeout=5)

    def _filmed_s(self) -> float:
        """V4L2 stamps each buffer by the computer's steady clock, and OpenCV hands that on; streams count from their start."""
        now_s, age_s = self._clock.now_s(), math.inf
        if is_local(self._source):
            age_s = time.monotonic() - self._capture.get(cv2.CAP_PROP_POS_MSEC) / 1000.0
        self.stamps = "driver" if 0.0 <= age_s < _OLDEST_S else "arrival"
        return now_s - age_s if self.stamps == "driver" else now_s

    def _lost(self, how: str) -> None:
        self._frame, self.gone = None, f"the camera {self._source} {how}; bns track shows what it sees"

    def _read(self) -> None:
        try:
            self._take_frames()
        except Exception as error:  # of whoever decodes pictures; unseen, the last one would only grow old
            self._lost(f"failed ({type(error).__name__}: {str(error).strip()}). Connect it again")
        finally:
            self._capture.release()

    def _take_frames(self) -> None:
        while self._open:
            good, picture = self._capture.read()
            if not good or picture is None:  # unplugged: the last frame must not be taken for a new one
                self._lost("is gone: it was unplugged, or its stream has ended. Connect it again")
                break
            if self._frame is not None and picture.shape != self._frame.picture.shape:
                sizes = (f"{one.shape[1]} x {one.shape[0]}" for one in (self._frame.picture, picture))
                self._lost("gave pictures of {} pixels, and now gives some of {}. Keep it in one mode".format(*sizes))
                break
            if self._frame is None or not np.array_equal(picture, self._frame.picture):
                self._frame = Frame(self._filmed_s(), picture)
            self._arrived.set()
            self._clock.arrived()


class FrameTracker:
    """Implements `Tracker` over a camera and a detector; each frame is looked at once."""

    def __init__(self, camera: Camera, find: Callable[[Frame], Sight | None]) -> None:
        self.camera, self._find = camera, find
        self.facts: Mapping[str, Any] = {"picture": getattr(camera, "picture", {}), "stamps": getattr(camera, "stamps", "")}
        self._last: tuple[float, Sight | None] = (-1.0, None)
        self.picture_s: float | None = None
        """When the newest picture came, whatever it shows."""

    def look(self) -> Sight | None:
        """What the newest frame shows."""
        frame = self.camera.newest()
        if frame is None:
            return None
        self.picture_s = frame.t_s
        if frame.t_s != self._last[0]:
            self._last = (frame.t_s, self._find(frame))
        return self._last[1]

    @property
    def gone(self) -> str:
        """That the camera will show nothing any more, and what to do about it; else nothing."""
        return str(getattr(self.camera, "gone", ""))

    def close(self) -> None:
        """Let the camera go."""
        self.camera.close()


def open_camera(settings: Mapping[str, Any], clock: Clock) -> StreamCamera:
    """The camera of a rig, if its frames are those that the rig's calibration was made for."""
    calibration = load_calibration(Path(str(settings["calibration"])))
    taken = {name: value for name, value in calibration.picture.items() if name in PICTURE}
    source = str(settings["camera"])
    values = taken | given(settings) if is_local(source) else {}
    camera = StreamCamera(source, clock, calibration.lens.size, values)
    frame = camera.newest()
    try:
        if frame is not None:
            check_size(calibration, frame.picture)
    except HardwareError:
        camera.close()
        raise
    return camera


def annotated(frame: Frame, sight: Sight | None, px_of: Callable[[np.ndarray], np.ndarray]) -> np.ndarray:
    """The picture with what was found drawn in; `px_of` takes floor points (n, 2) to pixels."""
    picture = frame.picture.copy()
    if sight is None:
        cv2.putText(picture, "lost", (12, 32), cv2.FONT_HERSHEY_SIMPLEX, 1.0, (0, 0, 255), 2, cv2.LINE_AA)
        return picture
    x_m, y_m, heading_rad = sight.pose
    ahead = np.array([[x_m, y_m], [x_m + 0.15 * np.cos(heading_rad), y_m + 0.15 * np.sin(heading_rad)]])
    tail, tip = (tuple(np.rint(p).astype(int).tolist()) for p in px_of(ahead))
    cv2.arrowedLine(picture, tail, tip, (255, 0, 255), 2, cv2.LINE_AA)
    for point in px_of(np.array(list(sight.points.values())).reshape(-1, 2)):
        cv2.circle(picture, tuple(np.rint(point).astype(int).tolist()), 4, (255, 0, 0), 2, cv2.LINE_AA)
    text = f"x {x_m:.3f} m  y {y_m:.3f} m  heading {np.degrees(heading_rad):.1f} deg"
    cv2.rectangle(picture, (0, 0), (560, 40), (255, 255, 255), -1)
    cv2.putText(picture, text, (12, 28), cv2.FONT_HERSHEY_SIMPLEX, 0.7, (0, 0, 0), 1, cv2.LINE_AA)
    return picture
