"""Films of the snake: with a renderer or without one, never a crash."""

import mujoco
import numpy as np
import pytest
from PIL import Image

from bns.errors import ModelError
from bns.physics.snake import render
from bns.physics.snake.body import Body
from bns.physics.snake.parameters import shipped_parameters


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
