"""Frames as a camera would take them of flat things: markers on robots, boards; with the lens's distortion, blur and noise."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from bns.extras import extra
from bns.hardware.tracking.lens import Lens

with extra("robot"):
    import cv2

_OVER = 3  # samples a pixel and axis: edges come out grey where they should
_FLOOR_BGR = (120, 125, 130)
_SHIFTS = 64
_LARGE = 100_000


@dataclass(frozen=True)
class Patch:
    """A flat picture in the scene: BGR texture (h, w, 3), mask (h, w) of what of it is there, its width in metres.

    `turn` (3, 3): its axes (to the right, up, towards the viewer) as columns in the floor's frame; `middle_m` (3,).
    """

    texture: np.ndarray
    mask: np.ndarray
    width_m: float
    turn: np.ndarray
    middle_m: np.ndarray


def flat(
    texture: np.ndarray,
    width_m: float,
    x_m: float,
    y_m: float,
    up_rad: float,
    height_m: float,
    mask: np.ndarray | None = None,
) -> Patch:
    """A patch that lies level: `up_rad` is the direction of its top edge, counter-clockwise from x."""
    cos, sin = np.cos(up_rad), np.sin(up_rad)
    turn = np.array([[sin, cos, 0.0], [-cos, sin, 0.0], [0.0, 0.0, 1.0]])
    everywhere = np.full(texture.shape[:2], 255, np.uint8)
    return Patch(_bgr(texture), everywhere if mask is None else mask, width_m, turn, np.array([x_m, y_m, height_m]))


def disc(colour_bgr: tuple[int, int, int], diameter_m: float, x_m: float, y_m: float, height_m: float) -> Patch:
    """A round marker of one colour."""
    mask = np.zeros((128, 128), np.uint8)
    cv2.circle(mask, (64, 64), 62, 255, -1)
    return flat(np.full((128, 128, 3), colour_bgr, np.uint8), diameter_m * 128 / 124, x_m, y_m, 0.0, height_m, mask)


def tag(number: int, side_m: float, x_m: float, y_m: float, heading_rad: float, height_m: float) -> Patch:
    """An ArUco marker with its white border; its top edge is ahead."""
    words = cv2.aruco.getPredefinedDictionary(cv2.aruco.DICT_4X4_50)
    framed = np.full((160, 160), 255, np.uint8)
    framed[20:140, 20:140] = cv2.aruco.generateImageMarker(words, number, 120)
    return flat(framed, side_m * 160 / 120, x_m, y_m, heading_rad, height_m)


class Scene:
    """Renders patches through a lens; noise is drawn from a seeded generator."""

    def __init__(self, lens: Lens, blur_px: float = 0.7, noise: float = 4.0, seed: int = 0) -> None:
        self._lens, self._blur_px = lens, blur_px
        self._draw = np.random.default_rng([seed, 5])
        width, height = lens.size
        px = np.stack(np.meshgrid(np.arange(width), np.arange(height)), axis=-1).reshape(-1, 2)
        self._straight = lens.straightened(px).reshape(height, width, 2)
        # Drawing noise takes longer than all the rest: one sheet, larger than a frame, is cut out anew for every frame.
        sheet = noise * self._draw.standard_normal((height + _SHIFTS, width + _SHIFTS, 3), np.float32)
        self._sheet = np.rint(sheet).astype(np.int16)

    def frame(self, patches: list[Patch]) -> np.ndarray:
        """One frame (height, width, 3), BGR."""
        width, height = self._lens.size
        picture: np.ndarray = np.empty((height, width, 3), np.uint8)
        picture[:] = _FLOOR_BGR
        for patch in patches:
            self._paint(picture, patch)
        if self._blur_px > 0:
            picture = cv2.GaussianBlur(picture, (0, 0), self._blur_px)
        down, across = self._draw.integers(_SHIFTS, size=2)
        noisy = picture + self._sheet[down : down + height, across : across + width]
        return np.clip(noisy, 0, 255, out=noisy).astype(np.uint8)

    def _paint(self, picture: np.ndarray, patch: Patch) -> None:
        (top, bottom), (left, right) = self._window(patch)
        if bottom <= top or right <= left:
            return
        local = self._local(patch, slice(top, bottom), slice(left, right)).astype(np.float32)
        rows, columns = patch.mask.shape
        scale = columns / patch.width_m
        u, v = columns / 2 + local[..., 0] * scale - 0.5, rows / 2 - local[..., 1] * scale - 0.5
        mask = cv2.remap(patch.mask, u, v, cv2.INTER_LINEAR, borderMode=cv2.BORDER_CONSTANT, borderValue=0)
        texture = cv2.remap(patch.texture, u, v, cv2.INTER_LINEAR, borderMode=cv2.BORDER_REPLICATE)
        there = mask[..., None].astype(np.float32) / 255.0
        size = (right - left, bottom - top)
        ink = cv2.resize(there * texture, size, interpolation=cv2.INTER_AREA)
        share = cv2.resize(there, size, interpolation=cv2.INTER_AREA)[..., None]
        part = picture[top:bottom, left:right]
        part[:] = np.rint(ink + (1.0 - share) * part).astype(np.uint8)

    def _window(self, patch: Patch) -> tuple[tuple[int, int], tuple[int, int]]:
        """Rows and columns of pixels that the patch can reach: it is small, the picture is not."""
        rows, columns = patch.mask.shape
        half = np.array([patch.width_m, patch.width_m * rows / columns]) / 2
        edge = np.stack(np.meshgrid(np.linspace(-1, 1, 5), np.linspace(-1, 1, 5)), axis=-1).reshape(-1, 2)
        px = self._lens.px(patch.middle_m + (edge * half) @ patch.turn[:, :2].T)
        margin = 4 + 0.05 * np.ptp(px, axis=0)
        low, high = np.floor(px.min(axis=0) - margin), np.ceil(px.max(axis=0) + margin)
        (left, top), (right, bottom) = (np.clip(end, 0, self._lens.size).astype(int) for end in (low, high))
        return (top, bottom), (left, right)

    def _local(self, patch: Patch, rows: slice, columns: slice) -> np.ndarray:
        """Coordinates on the patch, m, of the canvas's samples."""
        straight = self._straight[rows, columns]
        over = _OVER if straight.size < _LARGE else 2
        # The lens is smooth: straightened at every pixel and interpolated in between.
        rays = cv2.resize(straight, None, fx=over, fy=over, interpolation=cv2.INTER_LINEAR)
        return self._lens.rays_hit(rays.reshape(-1, 2), patch.turn, patch.middle_m).reshape(rays.shape)


def _bgr(texture: np.ndarray) -> np.ndarray:
    return texture if texture.ndim == 3 else cv2.cvtColor(texture, cv2.COLOR_GRAY2BGR)
