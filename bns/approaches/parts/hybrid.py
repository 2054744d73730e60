"""Physics first: a model of two wheels predicts every command, and networks learn what it gets wrong.

Untrained networks add nothing, so that a run begins with the model instead of with noise. The model must have no memory (no
lag, no delay): then a command's motion is one arc, which a first short step of it gives away, and a population costs a
thousandth of what it costs to integrate. What a model's memory would explain is left to the networks, which see the command
before.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import cast

import numpy as np

from bns.approaches.parts.base import Setting
from bns.bootstrap.simulators import NetworkSimulator, PhysicsSimulator
from bns.engine.evolution import Population
from bns.engine.snn import predict
from bns.errors import SpecError
from bns.physics.model import Model, load_model
from bns.physics.wheels.differential_drive import simulate
from bns.robots.base import RandomStream, Scores, TwoWheeled
from bns.tasks import Task

NO_MODEL = "none"
MODELS = (NO_MODEL, "khepera", "khepera-world")
STEP_S = 0.01
"""The short step that gives an arc away."""
TOLERATED_M = 0.001
"""By how much a path of ten commands may differ from the integrated one before the model is said to have a memory."""


@dataclass(frozen=True)
class Arcs:
    """A model without memory, command by command."""

    robot: TwoWheeled
    model: Model

    def displacements(self, commands: np.ndarray) -> np.ndarray:
        """What commands (n, components) do, (n, networks), as the robot defines displacements."""
        left, right, duration = self.robot.wheel_speeds_m_s(commands.astype(np.float64))
        model, start = replace(self.model, dt_s=STEP_S), self.robot.start_pose()
        steps = np.full((1, len(commands)), STEP_S)
        short = np.vstack([start, simulate(model, left[None], right[None], steps, start=start[0])[0]])
        moved = rotated(np.diff(short[:, :2], axis=0), -short[:-1, 2])
        turn, times = np.diff(short[:, 2]), duration / STEP_S
        moved = _stretched(moved, turn, times)
        # End to end, as one long path: the robot itself defines what the displacements of a path are.
        heading = start[0, 2] + np.concatenate([[0.0], np.cumsum(turn * times)])
        places = start[0, :2] + np.cumsum(rotated(moved, heading[:-1]), axis=0)
        return self.robot.measured_displacements(np.column_stack([places, heading[1:]]))


def rotated(points: np.ndarray, turn_rad: np.ndarray) -> np.ndarray:
    """Points (n, 2), each turned counter-clockwise by its own angle (n,)."""
    x, y, cos, sin = *points.T, np.cos(turn_rad), np.sin(turn_rad)
    return np.column_stack([x * cos - y * sin, x * sin + y * cos])


def _stretched(chords: np.ndarray, turn: np.ndarray, times: np.ndarray) -> np.ndarray:
    """Chords (n, 2) of short arcs, which turn by ``turn``, drawn out along their circles so many times as long."""
    # Chords of one circle: 2 r sin(half the turn), in the direction of half the turn.
    longer = times * np.sinc(turn * times / (2 * np.pi)) / np.sinc(turn / (2 * np.pi))
    return rotated(chords * longer[:, None], turn * (times - 1) / 2)


def arcs_of(setting: Setting) -> Arcs | None:
    """The model that predicts first, where one is chosen. SpecError for a robot without wheels, or a model with a memory."""
    name, robot = setting.chosen("model"), setting.robot
    if name == NO_MODEL:
        return None
    if not robot.two_wheeled or robot.sigmoid_output:
        raise SpecError(f"approach bns+model={name}: it is a model of two wheels, and the {robot.name} has none; leave it out.")
    arcs = Arcs(cast(TwoWheeled, robot), load_model(name))
    _check_memory(arcs, setting)
    return arcs


def _check_memory(arcs: Arcs, setting: Setting) -> None:
    robot = arcs.robot
    commands = robot.random_controllers(setting.own_key("memory"), 1, 10).controller(0)
    integrated = PhysicsSimulator(robot, setting.task, arcs.model).poses(commands)
    off_m = np.abs(robot.poses(arcs.displacements(commands), commands) - integrated)[:, :2].max()
    if off_m > TOLERATED_M:
        active = ", ".join(one.effect.name for one in arcs.model.effects)
        raise SpecError(
            f"approach bns+model={setting.chosen('model')}: the model has a memory (after ten commands {1000 * off_m:.0f} mm; "
            f"effects: {active}); take effects such as motor-lag and command-delay out, the networks learn them."
        )


@dataclass(frozen=True)
class HybridSimulator:
    """A model without memory, and networks that add what it gets wrong."""

    robot: TwoWheeled
    task: Task
    arcs: Arcs
    networks: NetworkSimulator
    foretells: bool = True

    def score(self, population: Population, stream: RandomStream | None = None, parents: Scores | None = None) -> Scores:
        """The robot's walk along the sum; what is handed on to children is what the networks said."""
        learned = self.networks.score(population, stream, parents)
        scores = self.robot.walk(population, self._moved(population, learned), self.task, stream)
        return scores._replace(outputs=learned.outputs)

    def predicted_outputs(self, population: Population, scores: Scores) -> np.ndarray:
        """What each command of these scores does, in units of targets (networks, commands)."""
        return self.robot.targets(self._moved(population, scores))

    def _moved(self, population: Population, scores: Scores) -> np.ndarray:
        """Displacements (commands, networks), SI: the model's, and what the networks said."""
        if scores.outputs is None:
            raise SpecError(f"robot {self.robot.name} does not say what its networks said; use bns without a model.")
        there = np.arange(population.commands.shape[1]) < population.lengths[:, None]
        return self.arcs.displacements(population.commands[there]) + self.robot.displacements(scores.outputs)

    def plan(self, controller: np.ndarray, stream: RandomStream | None = None) -> np.ndarray:
        """A controller is driven as it is."""
        return self.robot.plan(controller, None, self.task)

    def poses(self, commands: np.ndarray) -> np.ndarray:
        """One command's displacement after the other."""
        learned = self.robot.displacements(predict(self.networks.weights, self.robot.inputs(commands)))
        return self.robot.poses(self.arcs.displacements(commands) + learned, commands)
