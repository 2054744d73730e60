"""What the colour tracker makes of a picture, and which hues would fit: for a rig's `yellow` and `green`.

A blob is a marker by its size and roundness on the floor. Hues are tried window by window, so a marker of any colour is found,
and so are its own hues. The result is a picture file: OpenCV without windows is what the extra installs.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np

from bns.errors import HardwareError
from bns.extras import extra
from bns.hardware.tracking.colour import HUE_GAP, SATURATION, VALUE, ColourDetector, Markers, in_hsv

with extra("robot"):
    import cv2

_WINDOW, _STEP = 8, 3
"""Half the width of a window of hues, and how far one is from the next."""
_MARGIN = 4
"""Hues beyond those of nearly all of a marker's pixels: light changes."""
_ALIKE_PX = 10.0
_HUES = 180
_BAR_PX = 60
_SHOWN_BGR = {"yellow": (0, 220, 255), "green": (60, 200, 60)}


@dataclass(frozen=True)
class Blob:
    """A blob in a range of hues: its outline, area as a share of a marker's, roundness (1: a circle), and whether it is one."""

    outline: np.ndarray
    area_share: float
    roundness: float
    good: bool

    def in_words(self) -> str:
        """Its middle in the picture, and what it looks like."""
        x, y = self.outline.reshape(-1, 2).mean(axis=0)
        is_one = "a marker" if self.good else "no marker"
        return f"{is_one} at pixel ({x:.0f}, {y:.0f}): {self.area_share:.2f} of its area, roundness {self.roundness:.2f}"


@dataclass(frozen=True)
class Found:
    """A marker of any colour: its middle, pixels, and the hues of nearly all of its pixels."""

    middle_px: np.ndarray
    low: int
    high: int


def blobs(picture: np.ndarray, detector: ColourDetector, hues: tuple[int, int]) -> list[Blob]:
    """What there is in a range of hues, the largest first."""
    found = []
    for outline in detector.outlines(in_hsv(picture), hues):
        shape = detector.shape(outline)
        found.append(Blob(outline, shape.area_share, shape.roundness, shape.good))
    return sorted(found, key=lambda blob: -blob.area_share)


def markers_of_any_colour(picture: np.ndarray, detector: ColourDetector) -> list[Found]:
    """Round blobs of a marker's size, whatever their hue; those that many windows see are taken once."""
    hsv, seen = in_hsv(picture), list[tuple[float, Found]]()
    for middle in range(_WINDOW, _HUES - _WINDOW, _STEP):
        for outline in detector.outlines(hsv, (middle - _WINDOW, middle + _WINDOW)):
            if detector.shape(outline).good:
                seen.append((cv2.contourArea(outline), _found(outline, hsv)))
    kept: list[Found] = []
    for _, one in sorted(seen, key=lambda each: -each[0]):
        if all(np.hypot(*(one.middle_px - other.middle_px)) > _ALIKE_PX for other in kept):
            kept.append(one)
    return kept


def _found(outline: np.ndarray, hsv: np.ndarray) -> Found:
    inside = np.zeros(hsv.shape[:2], np.uint8)
    cv2.drawContours(inside, [outline], -1, 255, cv2.FILLED)
    pixels = hsv[inside > 0]
    hues = pixels[(pixels[:, 1] >= SATURATION) & (pixels[:, 2] >= VALUE), 0]
    low, high = np.percentile(hues, [2.0, 98.0])
    return Found(outline.reshape(-1, 2).mean(axis=0), int(low), int(high))


def tuned(found: list[Found], markers: Markers) -> Markers:
    """The same markers with hues that fit two of those found: the two whose hues are nearest to the present ranges.

    HardwareError if there are fewer than two, or if their hues cannot be told apart.
    """
    best, least = None, np.inf
    for yellow in found:
        for green in found:
            off = abs(_middle(yellow) - sum(markers.yellow) / 2) + abs(_middle(green) - sum(markers.green) / 2)
            if yellow is not green and off < least:
                best, least = (yellow, green), off
    if best is None:
        raise HardwareError(
            f"{len(found)} round blobs of a marker's size are in the picture, and two are needed. Is diameter_m right, is there "
            "enough light, are the markers in the picture? Its preview shows what there is."
        )
    low, high = sorted(best, key=_middle)
    margin = max(0, min(_MARGIN, (high.low - low.high - HUE_GAP) // 2))
    of_low = max(low.low - _MARGIN, 0), low.high + margin
    of_high = high.low - margin, min(high.high + _MARGIN, _HUES - 1)
    yellow_hues, green_hues = (of_low, of_high) if low is best[0] else (of_high, of_low)
    return replace(markers, yellow=yellow_hues, green=green_hues)


def _middle(found: Found) -> float:
    return (found.low + found.high) / 2


def drawn(picture: np.ndarray, detector: ColourDetector) -> np.ndarray:
    """The picture with all blobs of both ranges (markers thick), beside it what is within the ranges, below both the hues."""
    hsv, shown = in_hsv(picture), picture.copy()
    within = (picture * 0.25).astype(np.uint8)
    for name, hues in detector.hues.items():
        for blob in blobs(picture, detector, hues):
            cv2.drawContours(shown, [blob.outline], -1, _SHOWN_BGR[name], 3 if blob.good else 1)
        mask = detector.mask(hsv, hues) > 0
        within[mask] = picture[mask]
    both = np.hstack([shown, within])
    return np.vstack([both, _histogram(hsv, detector.hues, both.shape[1])])


def _histogram(hsv: np.ndarray, ranges: Mapping[str, tuple[int, int]], width: int) -> np.ndarray:
    """How many coloured pixels have which hue (0 at the left, 179 at the right), in that hue; the ranges are the lines below."""
    coloured = hsv[(hsv[..., 1] >= SATURATION) & (hsv[..., 2] >= VALUE)][:, 0]
    counts = np.sqrt(np.bincount(coloured, minlength=_HUES)[:_HUES].astype(np.float64))
    heights = np.rint((_BAR_PX - 8) * counts / max(counts.max(), 1.0)).astype(int)
    bar = np.zeros((_BAR_PX, _HUES, 3), np.uint8)
    bar[..., 0] = np.arange(_HUES)
    for hue, height in enumerate(heights):
        bar[_BAR_PX - 8 - height : _BAR_PX - 8, hue, 1:] = 255
    found: np.ndarray = cv2.cvtColor(bar, cv2.COLOR_HSV2BGR)
    for name, (low, high) in ranges.items():
        found[-6:, low : high + 1] = _SHOWN_BGR[name]
    stretched: np.ndarray = cv2.resize(found, (width, _BAR_PX), interpolation=cv2.INTER_NEAREST)
    return stretched


def report(picture: np.ndarray, detector: ColourDetector, markers: Markers) -> str:
    """What each range holds, and lines for the rig with hues that fit; what is missing instead, if none do."""
    lines = []
    for name, hues in detector.hues.items():
        there = blobs(picture, detector, hues)
        lines.append(f"{name}, hues {hues[0]} to {hues[1]}: {sum(blob.good for blob in there)} of {len(there)} blobs is a marker")
        lines += [f"  {blob.in_words()}" for blob in there[:3]]
    try:
        fits = tuned(markers_of_any_colour(picture, detector), markers)
    except HardwareError as error:
        return "\n".join([*lines, str(error)])
    own = [f"  {name}: [{low}, {high}]" for name, (low, high) in (("yellow", fits.yellow), ("green", fits.green))]
    return "\n".join([*lines, "hues that fit the markers in this picture, for the rig's tracker:", *own])
