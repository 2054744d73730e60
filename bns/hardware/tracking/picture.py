"""How a camera takes its pictures: size, exposure, focus, white balance; set, and read back, since drivers take what they like.

A camera that focuses and exposes by itself changes its lens and its colours under the calibration.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

from bns.errors import HardwareError
from bns.extras import extra

with extra("robot"):
    import cv2

SETTINGS = ("exposure", "focus", "white_balance")
_MANUAL_EXPOSURE = 1.0  # V4L2_EXPOSURE_MANUAL, as OpenCV hands it on
_PROPERTIES = {
    "exposure": (cv2.CAP_PROP_AUTO_EXPOSURE, _MANUAL_EXPOSURE, cv2.CAP_PROP_EXPOSURE),
    "focus": (cv2.CAP_PROP_AUTOFOCUS, 0.0, cv2.CAP_PROP_FOCUS),
    "white_balance": (cv2.CAP_PROP_AUTO_WB, 0.0, cv2.CAP_PROP_WB_TEMPERATURE),
}
"""Name -> the automatic, how it is switched off, the value."""
_NEAR = 0.1


def is_local(source: str) -> bool:
    """Whether a source is a camera at this computer; a stream is as whoever sends it makes it."""
    return source.isdecimal() or source.startswith("/dev/")


def set_up(
    capture: Any, source: str, size: tuple[int, int] | None, values: Mapping[str, float], insist: bool = True
) -> dict[str, float]:
    """Set size (width, height) and values, read everything back; HardwareError if a camera that is to take them does not."""
    if size is not None:
        capture.set(cv2.CAP_PROP_FOURCC, cv2.VideoWriter.fourcc(*"MJPG"))  # raw pictures of that size come a few a second
        capture.set(cv2.CAP_PROP_FRAME_WIDTH, size[0])
        capture.set(cv2.CAP_PROP_FRAME_HEIGHT, size[1])
    for name, value in values.items():
        automatic, off, place = _PROPERTIES[name]
        capture.set(automatic, off)
        capture.set(place, value)
    found = read_back(capture)
    for name, value in values.items():
        if not math.isclose(found[name], value, rel_tol=_NEAR, abs_tol=1.0):
            back = f"it reads back {found[name]:g}. Leave it out, or see v4l2-ctl -L."
            raise HardwareError(f"the camera {source} takes no {name} {value:g}: {back}")
    got = (round(found["width_px"]), round(found["height_px"]))
    if size is not None and insist and got != size:
        wrong = f"the camera {source} gives {got[0]} x {got[1]} pixels, not {size[0]} x {size[1]}"
        raise HardwareError(f"{wrong}; v4l2-ctl --list-formats-ext lists its modes.")
    return found


def read_back(capture: Any) -> dict[str, float]:
    """What the camera says of itself; a value that it does not know is what OpenCV makes of that (0 or -1)."""
    found = {"width_px": cv2.CAP_PROP_FRAME_WIDTH, "height_px": cv2.CAP_PROP_FRAME_HEIGHT}
    found |= {name: place for name, (_, _, place) in _PROPERTIES.items()}
    return {name: float(capture.get(place)) for name, place in found.items()}


def given(settings: Mapping[str, Any]) -> dict[str, float]:
    """Exposure, focus and white balance in a tracker's settings; HardwareError if one is no number."""
    found = {name: settings[name] for name in SETTINGS if settings.get(name) is not None}
    for name, value in found.items():
        if isinstance(value, bool) or not isinstance(value, int | float) or not math.isfinite(value):
            raise HardwareError(f"the tracker's {name} is {value!r}; it is a number as the camera's driver counts (v4l2-ctl -L).")
    return {name: float(value) for name, value in found.items()}
