"""The snake as a world: controllers driven on the model, seen by a camera above."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from numpy.typing import ArrayLike

from bns.engine.philox import Key, Purpose, normals
from bns.errors import ModelError
from bns.physics.snake.body import Body, Driven, OnStep
from bns.physics.snake.parameters import SnakeParameters, read_parameters, shipped_parameters
from bns.physics.snake.stability import BLEW_UP
from bns.robots.base import Robot

START_M, START_HEADING_RAD = (0.30, 0.0), 0.0
"""Middle between the markers, and the direction from yellow to green, at the start of every task (section 5.3.2)."""
_SHARED = 3
"""Rows of draws a cycle before those of the links: both markers' noise twice, and the floor's friction."""


class SnakePhysics:
    """Drives cycles on the model; the floor's friction and the camera's noise are drawn for every cycle.

    `causes` holds, after `drive`, why each driven cycle was unstable (empty: it was stable).
    """

    repeatable = True
    renderable = True

    def __init__(self, parameters: SnakeParameters, start_m: ArrayLike = START_M) -> None:
        self._parameters = parameters
        self._body = Body(parameters)
        self._start_m = np.asarray(start_m, np.float64)
        self.digest = "w" + parameters.digest[:15] + ("" if tuple(self._start_m) == START_M else f"@{self._start_m[0]:g}")
        self.causes: list[tuple[str, ...]] = []
        self.duration_s = 0.0

    def drive(
        self, commands: np.ndarray, key: Key, purpose: Purpose, step: int, on_step: OnStep | None = None
    ) -> np.ndarray:
        """Observations (m, 9) of the cycles (n, >= 4) driven: markers at the begin and end of each, and whether it was stable.

        Columns: yellow x, y and green x, y in the cycle's first posture, the same in its last, m; 1 stable or 0. The drive
        ends (m < n) with a cycle that leaves the robot on its side or back: a person would put it back. A cycle is driven
        once, whatever its repeats.
        """
        draws = normals(key, purpose, step, _SHARED + -(-int(self._parameters.links) // 4), len(commands))
        self._body.lay_straight(self._start_m, START_HEADING_RAD)
        self.causes, self.duration_s, rows = [], 0.0, []
        for i, cycle in enumerate(commands[:, :4].astype(np.float64)):
            self._body.set_friction(self._friction(draws[:, i]))
            self._body.set_tilt(*(self._parameters.floor_tilt_rad * draws[2, i, 1:3]))
            driven = self._body.drive_cycle(cycle, on_step)
            rows.append(self._seen(driven, draws[0, i], draws[1, i]))
            self.causes.append(driven.causes)
            self.duration_s += driven.duration_s
            if self._ends(driven):
                break
        return np.array(rows).reshape(-1, 9)

    def render(self, commands: np.ndarray, picture: Path) -> None:
        """Drive these cycles once more, on an even floor, and write .mp4 or .png."""
        from bns.physics.snake.render import Film  # noqa: PLC0415  # pictures need libraries that driving does not

        self._body.lay_straight(self._start_m, START_HEADING_RAD)
        self._body.set_friction(1.0)
        self._body.set_tilt(0.0, 0.0)
        film = Film(self._body.model)
        for cycle in commands[:, :4].astype(np.float64):
            if self._ends(self._body.drive_cycle(cycle, film.take)):
                break
        film.save(picture)

    @staticmethod
    def check_picture(picture: Path) -> None:
        """ModelError for a file that `render` cannot write."""
        from bns.physics.snake.render import check_ending  # noqa: PLC0415

        check_ending(picture)

    def _friction(self, draws: np.ndarray) -> np.ndarray:
        """Floor friction (links,) in a cycle, as a multiple of the parameter's: the place's times each link's."""
        p = self._parameters
        links = p.link_friction_spread * draws[_SHARED:].ravel()[: int(p.links)]
        return np.clip(1.0 + p.friction_spread * draws[2, 0], 0.2, 3.0) * np.clip(1.0 + links, 0.1, 4.0)

    def _ends(self, driven: Driven) -> bool:
        p = self._parameters
        on_side = driven.lies or bool(p.tipped_on_the_way_ends and driven.tipped)
        return BLEW_UP in driven.causes or (on_side and not p.roles_switch_on_side)

    def _seen(self, driven: Driven, noise_before: np.ndarray, noise_after: np.ndarray) -> np.ndarray:
        sigma = self._parameters.marker_noise_m
        before = driven.before_m.ravel() + sigma * noise_before
        after = driven.after_m.ravel() + sigma * noise_after
        if BLEW_UP in driven.causes:  # nobody has seen where such a body went
            after = before
        return np.concatenate([before, after, [float(not driven.causes)]])


def build(robot: Robot, model: str | None = None) -> SnakePhysics:
    """The model as shipped, or with the parameters of a file; ModelError if that cannot be read."""
    start_m = robot.start_pose()[0, :4].reshape(2, 2).mean(axis=0)
    if model is None:
        return SnakePhysics(shipped_parameters(), start_m)
    try:
        text = Path(model).read_text(encoding="utf-8")
    except OSError as error:
        raise ModelError(f"cannot read {model}: {error.strerror}; give a file like bns/physics/snake/parameters.yaml.") from error
    except UnicodeDecodeError as error:
        raise ModelError(f"{model} is not UTF-8 text; save it as UTF-8.") from error
    return SnakePhysics(read_parameters(text), start_m)
