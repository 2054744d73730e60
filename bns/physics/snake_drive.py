"""The snake as a world: controllers driven on the model, seen by a camera above."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from bns.engine.philox import Key, Purpose, normals
from bns.errors import ModelError
from bns.physics.snake.body import Body, Driven, OnStep
from bns.physics.snake.parameters import SnakeParameters, read_parameters, shipped_parameters
from bns.physics.snake.stability import BLEW_UP, TIPPED
from bns.robots.base import Robot

START_M, START_HEADING_RAD = (0.30, 0.0), 0.0
"""Middle between the markers, and the direction from yellow to green, at the start of every task (section 5.3.2)."""
ENDING = frozenset({TIPPED, BLEW_UP})
"""Causes after which a person would stop the robot and put it back."""


class SnakePhysics:
    """Drives cycles on the model; the floor's friction and the camera's noise are drawn for every cycle.

    `causes` holds, after `drive`, why each driven cycle was unstable (empty: it was stable).
    """

    repeatable = True
    renderable = True

    def __init__(self, parameters: SnakeParameters) -> None:
        self._parameters = parameters
        self._body = Body(parameters)
        self.digest = "w" + parameters.digest[:15]
        self.causes: list[tuple[str, ...]] = []
        self.duration_s = 0.0

    def drive(
        self, commands: np.ndarray, key: Key, purpose: Purpose, step: int, on_step: OnStep | None = None
    ) -> np.ndarray:
        """Observations (m, 9) of the cycles (n, >= 4) driven: markers at the begin and end of each, and whether it was stable.

        Columns: yellow x, y and green x, y in the cycle's first posture, the same in its last, m; 1 stable or 0. The drive
        ends (m < n) with a cycle that leaves the robot on its side or back. A cycle is driven once, whatever its repeats.
        """
        p, draws = self._parameters, normals(key, purpose, step, 3, len(commands))
        self._body.lay_straight(START_M, START_HEADING_RAD)
        self.causes, self.duration_s, rows = [], 0.0, []
        for i, cycle in enumerate(commands[:, :4].astype(np.float64)):
            self._body.set_friction(float(np.clip(1.0 + p.friction_spread * draws[2, i, 0], 0.2, 3.0)))
            driven = self._body.drive_cycle(cycle, on_step)
            rows.append(self._seen(driven, draws[0, i], draws[1, i]))
            self.causes.append(driven.causes)
            self.duration_s += driven.duration_s
            if ENDING & set(driven.causes):
                break
        return np.array(rows).reshape(-1, 9)

    def render(self, commands: np.ndarray, picture: Path) -> None:
        """Drive these cycles once more, on a floor of even friction, and write .mp4 or .png."""
        from bns.physics.snake.render import Film  # noqa: PLC0415  # pictures need libraries that driving does not

        self._body.lay_straight(START_M, START_HEADING_RAD)
        self._body.set_friction(1.0)
        film = Film(self._body.model)
        for cycle in commands[:, :4].astype(np.float64):
            if ENDING & set(self._body.drive_cycle(cycle, film.take).causes):
                break
        film.save(picture)

    @staticmethod
    def check_picture(picture: Path) -> None:
        """ModelError for a file that `render` cannot write."""
        from bns.physics.snake.render import check_ending  # noqa: PLC0415

        check_ending(picture)

    def _seen(self, driven: Driven, noise_before: np.ndarray, noise_after: np.ndarray) -> np.ndarray:
        sigma = self._parameters.marker_noise_m
        before = driven.before_m.ravel() + sigma * noise_before
        after = driven.after_m.ravel() + sigma * noise_after
        if BLEW_UP in driven.causes:  # nobody has seen where such a body went
            after = before
        return np.concatenate([before, after, [float(not driven.causes)]])


def build(robot: Robot, model: str | None = None) -> SnakePhysics:
    """The model as shipped, or with the parameters of a file; ModelError if that cannot be read."""
    if model is None:
        return SnakePhysics(shipped_parameters())
    try:
        text = Path(model).read_text(encoding="utf-8")
    except OSError as error:
        raise ModelError(f"cannot read {model}: {error.strerror}; give a file like bns/physics/snake/parameters.yaml.") from error
    except UnicodeDecodeError as error:
        raise ModelError(f"{model} is not UTF-8 text; save it as UTF-8.") from error
    return SnakePhysics(read_parameters(text))
