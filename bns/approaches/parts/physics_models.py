"""Physics models of a robot as points in a space, and what was driven to judge them by."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from bns.bootstrap.simulators import PhysicsSimulator
from bns.engine.evolution import Population
from bns.physics.effect import Effect
from bns.physics.effects import effect_named
from bns.physics.model import Model, load_model
from bns.robots.base import TwoWheeled
from bns.tasks import Task

COMMON = ("speed-gain", "wheel-mismatch", "motor-lag", "wheelbase", "turn-slip")
"""Effects that anybody would think of first."""
CATALOGUE = (*COMMON, "command-delay", "dead-zone", "side-slip", "understeer", "yaw-bias")
"""Those, and others of the wheels and the body: what a model may have where it is to find out what it has."""
SHARE_OF_PLAUSIBLE = 20
"""A spread is a twentieth of what is plausible of a number: 5 % of the speed, 50 ms of lag."""
UNITS = np.array([0.01, 0.01, 0.05])
"""A centimetre to the side, a centimetre ahead and 3 degrees count alike in a command's error."""


@dataclass(frozen=True)
class ModelSpace:
    """A robot's drawing with effects, whose numbers are given as spreads from neutral: all 0 is the drawing itself."""

    drawing: Model
    effects: tuple[Effect, ...]

    @classmethod
    def of(cls, robot: TwoWheeled, effects: tuple[str, ...]) -> ModelSpace:
        """Around the robot's drawing, the model of its name."""
        return cls(load_model(robot.name), tuple(effect_named(name) for name in effects))

    @property
    def size(self) -> int:
        """How many numbers there are."""
        return sum(len(effect.parameters) for effect in self.effects)

    @property
    def owner(self) -> np.ndarray:
        """The effect (its place) of each number, (size,)."""
        return np.repeat(np.arange(len(self.effects)), [len(effect.parameters) for effect in self.effects])

    @property
    def bounds(self) -> tuple[np.ndarray, np.ndarray]:
        """Lowest and highest, in spreads, (size,) each: what is plausible."""
        ends = np.array([p.plausible for effect in self.effects for p in effect.parameters])
        return (ends[:, 0] - self._neutral) / self._spread, (ends[:, 1] - self._neutral) / self._spread

    def model(self, point: np.ndarray, active: np.ndarray | None = None) -> Model:
        """The model at a point (size,) of the space, cut at its bounds, with the effects that are active (effects,)."""
        values = iter(self._neutral + np.clip(point, *self.bounds) * self._spread)
        model = self.drawing
        for number, effect in enumerate(self.effects):
            own = tuple(float(next(values)) for _ in effect.parameters)
            if active is None or active[number]:
                model = model.with_active(effect, own)
        return model

    @property
    def _neutral(self) -> np.ndarray:
        return np.array([p.neutral for effect in self.effects for p in effect.parameters])

    @property
    def _spread(self) -> np.ndarray:
        ends = np.array([p.plausible for effect in self.effects for p in effect.parameters])
        return (ends[:, 1] - ends[:, 0]) / SHARE_OF_PLAUSIBLE


class Drives:
    """What a robot on two wheels did, drive by drive."""

    def __init__(self, robot: TwoWheeled, task: Task) -> None:
        """None yet."""
        self._robot, self._task = robot, task
        self._commands: list[np.ndarray] = []
        self._moved: list[np.ndarray] = []
        self._fitness: list[float] = []

    def __len__(self) -> int:
        return len(self._commands)

    def add(self, commands: np.ndarray, poses: np.ndarray) -> None:
        """Keep poses (m, 3) of commands (n, components), of which the first m were driven."""
        self._commands.append(commands[: len(poses)])
        self._moved.append(self._robot.measured_displacements(poses))
        self._fitness.append(self._robot.evaluate_path(poses, self._task)[0])

    def residuals(self, model: Model, last: int = 0) -> np.ndarray:
        """What a model gets wrong of each command's displacement, (commands, 3), in `UNITS`; of the ``last`` drives (0: all).

        Displacement by displacement, so that an error of heading does not count again in all that follows.
        """
        paths = self._simulator(model).paths(self._population(last))
        pairs = zip(paths, self._moved[-last:], strict=True)
        return np.vstack([self._robot.measured_displacements(path[: len(moved)]) - moved for path, moved in pairs]) / UNITS

    def error(self, model: Model, last: int = 0) -> float:
        """Root of the mean square of `residuals`."""
        return float(np.sqrt(np.mean(self.residuals(model, last) ** 2)))

    def fitness_error(self, model: Model, last: int = 0) -> float:
        """Mean absolute difference of the fitness on a model and in the world: equation 2.10."""
        foretold = self._simulator(model).score(self._population(last)).fitness
        return float(np.mean(np.abs(foretold - np.array(self._fitness[-last:]))))

    def _simulator(self, model: Model) -> PhysicsSimulator:
        return PhysicsSimulator(self._robot, self._task, model)

    def _population(self, last: int) -> Population:
        lists = self._commands[-last:]
        lengths = np.array([len(one) for one in lists], np.int32)
        commands = np.zeros((len(lists), int(lengths.max()), lists[0].shape[1]), np.float32)
        for row, one in zip(commands, lists, strict=True):
            row[: len(one)] = one
        return Population(commands, lengths)
