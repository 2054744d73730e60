"""Moving pictures of the snake, as .mp4 or as a strip of frames in .png; a stick figure where nothing can be rendered."""

from __future__ import annotations

import warnings
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure

from bns.errors import ModelError
from bns.extras import extra
from bns.physics.snake import UNUSABLE
from bns.physics.snake.body import OnStep

with extra("snake"):
    import mujoco

WIDTH_PX, HEIGHT_PX, FRAMES_A_SECOND = 960, 544, 25
VIEW_M = 2.3
"""Distance of the camera: the whole surface of the tasks, and a body that has just left it, are in sight."""
STRIP_FRAMES = 6
"""Frames of a picture: from the first to the last, equally spaced in time."""
Draw = Callable[[mujoco.MjData], np.ndarray]


class Film:
    """Gathers frames while a body is driven: pass `take` as ``on_step``, then `save`."""

    def __init__(self, model: mujoco.MjModel) -> None:
        self._draw = camera(model)
        self.frames: list[np.ndarray] = []
        self._next_s = 0.0

    @property
    def take(self) -> OnStep:
        """Called with every integration step; keeps every 25th of a second."""

        def on_step(_: mujoco.MjModel, data: mujoco.MjData) -> None:
            if data.time >= self._next_s - 1e-6:
                self._next_s += 1.0 / FRAMES_A_SECOND
                self.frames.append(self._draw(data))

        return on_step

    def save(self, path: Path) -> None:
        """Write .mp4 or .png; ModelError for another ending or an empty film."""
        check_ending(path)
        if not self.frames:
            raise ModelError(f"nothing was driven, so there is no picture for {path}; drive at least one cycle.")
        part = path.with_name(f".{path.stem}.part{path.suffix}")
        path.parent.mkdir(parents=True, exist_ok=True)
        (_write_mp4 if path.suffix == ".mp4" else _write_strip)(self.frames, part)
        part.replace(path)


def check_ending(path: Path) -> None:
    """ModelError unless the name ends in .png, or in .mp4 where films can be written."""
    if path.suffix not in {".mp4", ".png"}:
        raise ModelError(f"cannot render to {path}; let the name end in .mp4 (film) or .png (strip of frames).")
    if path.suffix == ".mp4":
        _check_encoder(path)


def _check_encoder(path: Path) -> None:
    try:
        with extra("snake"):
            import imageio_ffmpeg  # noqa: PLC0415  # brings its own encoder; only films need it

        imageio_ffmpeg.get_ffmpeg_exe()
    except (ImportError, RuntimeError) as error:
        raise ModelError(f"cannot render to {path}: no encoder of films. {error}, or let the name end in .png.") from error


def camera(model: mujoco.MjModel) -> Draw:
    """Function from a state to a frame (544, 960, 3) uint8: rendered, or drawn as a stick figure with a warning that says so."""
    try:
        return _rendered(model)
    except Exception as error:  # drivers fail in many ways, and none of them may end a run
        warnings.warn(
            f"no headless rendering here ({type(error).__name__}: {error}); drawing a stick figure. "
            "On Debian: apt-get install libegl1 libgl1-mesa-dri",
            stacklevel=2,
        )
        return stick_figure(model)


def _rendered(model: mujoco.MjModel) -> Draw:
    if UNUSABLE:
        raise RuntimeError(UNUSABLE)
    renderer, view = mujoco.Renderer(model, HEIGHT_PX, WIDTH_PX), mujoco.MjvCamera()
    view.lookat[:], view.distance, view.azimuth, view.elevation = (0.0, 0.0, 0.0), VIEW_M, 90.0, -60.0

    def draw(data: mujoco.MjData) -> np.ndarray:
        renderer.update_scene(data, view)
        return np.asarray(renderer.render()).copy()

    return draw


def stick_figure(model: mujoco.MjModel) -> Draw:
    """As `camera`, with lines: from above, and from the side with the height; a link is the redder the further it has rolled."""
    sites = [model.site(name).id for name in ("yellow", "green")]

    def draw(data: mujoco.MjData) -> np.ndarray:
        figure = Figure(figsize=(WIDTH_PX / 100, HEIGHT_PX / 100), dpi=100, layout="constrained")
        above, beside = figure.subplots(2, 1, height_ratios=[1.85, 0.3], sharex=True)
        body, markers = data.xpos[1:], data.site_xpos[sites]
        above.plot(body[:, 0], body[:, 1], "-", color="#444444", linewidth=4)
        upright = data.xmat[1:, 8]  # how far up a link's own upward axis points: 1 upright, 0 on its side, -1 on its back
        above.scatter(body[:, 0], body[:, 1], c=-upright, cmap="YlOrRd", vmin=-1, vmax=1, edgecolors="#444444", s=45, zorder=2)
        above.scatter(markers[:, 0], markers[:, 1], c=["#e6c200", "#1a9e3b"], s=80, zorder=3)
        beside.plot(body[:, 0], body[:, 2], "o-", color="#444444")
        above.set(xlim=(-1.35, 1.35), ylim=(-0.925, 0.925), aspect="equal", ylabel="y, north (m)")
        beside.set(ylim=(0, 0.3), yticks=(0, 0.3), aspect="equal", xlabel="x, east (m)", ylabel="height (m)")  # one scale
        canvas = FigureCanvasAgg(figure)
        canvas.draw()
        return np.asarray(canvas.buffer_rgba())[..., :3].copy()

    return draw


def _write_mp4(frames: list[np.ndarray], path: Path) -> None:
    import imageio_ffmpeg  # noqa: PLC0415  # as above

    writer: Any = imageio_ffmpeg.write_frames(str(path), (WIDTH_PX, HEIGHT_PX), fps=FRAMES_A_SECOND, ffmpeg_log_level="error")
    writer.send(None)
    for frame in frames:
        writer.send(np.ascontiguousarray(frame))
    writer.close()


def _write_strip(frames: list[np.ndarray], path: Path) -> None:
    shown = np.linspace(0, len(frames) - 1, min(STRIP_FRAMES, len(frames))).astype(int)
    down = -(-len(shown) // 2)
    figure = Figure(figsize=(7.2, 2.2 * down), dpi=200, layout="constrained")
    axes = figure.subplots(down, 2 if len(shown) > 1 else 1, squeeze=False).ravel()
    for ax in axes:
        ax.set_axis_off()
    for ax, number in zip(axes, shown, strict=False):
        ax.imshow(frames[number])
        ax.set_title(f"{number / FRAMES_A_SECOND:.1f} s", fontsize=8)
    figure.savefig(path)
