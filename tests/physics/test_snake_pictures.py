"""Films of the snake: with a renderer or without one, never a crash."""

import os
import subprocess
import sys

import mujoco
import numpy as np
import pytest
from PIL import Image

from bns.errors import ModelError
from bns.physics.snake import render
from bns.physics.snake.body import Body
from bns.physics.snake.parameters import shipped_parameters
from bns.physics.snake_drive import SnakePhysics


@pytest.fixture
def body():
    body = Body(shipped_parameters())
    body.lay_straight()
    return body


@pytest.fixture
def no_renderer(monkeypatch):
    def fail(*_):
        raise RuntimeError("no EGL device")

    monkeypatch.setattr(mujoco, "Renderer", fail)


def test_without_a_renderer_a_stick_figure_moves_and_says_why(no_renderer, body, tmp_path):
    with pytest.warns(UserWarning, match=r"no headless rendering here \(RuntimeError: no EGL device\).*apt-get install"):
        film = render.Film(body.model)
    mujoco.mj_step(body.model, body.data)
    film.take(body.model, body.data)
    body.lay_straight((0.3, 0.3), 1.0)
    film._next_s = 0.0
    film.take(body.model, body.data)
    assert (film.frames[0] != film.frames[1]).any()
    film.save(tmp_path / "strip.png")
    with Image.open(tmp_path / "strip.png") as strip:
        assert strip.size[0] == 1440
    film.save(tmp_path / "film.mp4")
    assert b"ftyp" in (tmp_path / "film.mp4").read_bytes()[:16]
    assert sorted(path.name for path in tmp_path.iterdir()) == ["film.mp4", "strip.png"]


def test_a_way_to_draw_that_is_not_there_costs_the_pictures_and_not_the_drive():
    """In a process of its own: what MuJoCo draws with is settled when it is imported."""
    script = (
        "from bns.physics import snake; from bns.physics.snake.body import Body\n"
        "from bns.physics.snake.parameters import shipped_parameters; from bns.physics.snake.render import camera\n"
        "body = Body(shipped_parameters()); body.lay_straight(); print(camera(body.model)(body.data).shape)"
    )
    asked = {**os.environ, "MUJOCO_GL": "crayons"}
    done = subprocess.run([sys.executable, "-c", script], env=asked, capture_output=True, text=True, check=False)
    assert (done.returncode, done.stdout) == (0, "(544, 960, 3)\n"), done.stderr
    assert "MUJOCO_GL=crayons cannot be used here: " in done.stderr
    assert "drawing a stick figure" in done.stderr


def test_the_stick_figure_has_one_scale_above_and_beside(body):
    boxes = [ax.get_window_extent() for ax in drawn_axes(body)]
    assert boxes[0].x0 == pytest.approx(boxes[1].x0, abs=1)
    assert boxes[0].width == pytest.approx(boxes[1].width, abs=1)


def drawn_axes(body):
    kept = []

    class Kept(render.Figure):
        def __init__(self, *given, **more):
            super().__init__(*given, **more)
            kept.append(self)

    with pytest.MonkeyPatch.context() as patched:
        patched.setattr(render, "Figure", Kept)
        render.stick_figure(body.model)(body.data)
    return kept[0].axes


def test_frames_are_taken_25_times_a_second(no_renderer, body, monkeypatch):
    monkeypatch.setattr(render, "stick_figure", lambda model: lambda data: np.zeros((4, 4, 3), np.uint8))
    with pytest.warns(UserWarning, match="no headless"):
        film = render.Film(body.model)
    driven = body.drive_cycle([0.3, 0.1, 1.0, 1.0], film.take)
    assert len(film.frames) == pytest.approx(driven.duration_s * 25, abs=1)


def test_other_endings_and_empty_films_are_refused(no_renderer, body, tmp_path):
    with pytest.warns(UserWarning, match="no headless"):
        film = render.Film(body.model)
    with pytest.raises(ModelError, match=r"let the name end in \.mp4 \(film\) or \.png"):
        film.save(tmp_path / "a.gif")
    with pytest.raises(ModelError, match="nothing was driven"):
        film.save(tmp_path / "a.png")
    assert list(tmp_path.iterdir()) == []


def test_without_an_encoder_a_film_is_refused_before_anything_is_driven_and_a_strip_is_not(monkeypatch, tmp_path):
    monkeypatch.setitem(sys.modules, "imageio_ffmpeg", None)
    with pytest.raises(ModelError, match=r"film\.mp4: no encoder of films\. .*or let the name end in \.png"):
        SnakePhysics.check_picture(tmp_path / "film.mp4")
    SnakePhysics.check_picture(tmp_path / "strip.png")
