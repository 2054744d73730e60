"""Which predictor a file of networks needs: found by whose networks they are."""

from __future__ import annotations

import json
from pathlib import Path

from bns.diagnose.data.bodies.cycles import CycleTracks
from bns.diagnose.data.tracks import Tracks
from bns.diagnose.predict.base import Predictor
from bns.diagnose.predict.cycle_networks import CyclePredictor
from bns.diagnose.predict.networks import NetworkPredictor
from bns.errors import DataError, ModelError
from bns.robots import load_robot, robot_names
from bns.robots.base import Robot
from bns.robots.simulator import StaticSimulator, load_simulator, static_path
from bns.robots.snake.robot import Snake
from bns.robots.snake.table import COLUMNS as OF_CYCLES
from bns.spec import robot_and_options

ENDING = ".safetensors"
OF_ROBOT = "-networks"


def networks_file(model: str, models: list[str]) -> tuple[Path, str] | None:
    """The file that ``--model`` means, and the robot if it says one: the file itself, or the static simulator of a robot (its
    options may follow). Where ``models`` with effects have the robot's name, its networks are called ROBOT-networks."""
    if model.endswith(ENDING):
        return Path(model), ""
    if model.endswith(OF_ROBOT) and model.removesuffix(OF_ROBOT) in robot_names():
        robot = model.removesuffix(OF_ROBOT)
        return static_path(robot), robot
    robot = robot_and_options(model)[0] if "+" in model else model
    models = [name for name in models if "+" not in model]
    return (static_path(robot), model) if robot in robot_names() and robot not in models else None


def network_predictor(file: Path, tracks: Tracks, robot: str = "") -> Predictor:
    """The networks of a file over these tracks; DataError or ModelError if they are not of the robot that was tracked."""
    saved = load_simulator(file)
    whose = load_robot(robot) if robot else _robot_with(saved, file)
    cycles = isinstance(tracks, CycleTracks)
    if cycles != (whose.measured_columns == OF_CYCLES):
        kind = "cycles and markers" if cycles else "wheel speeds and poses"
        raise DataError(
            f"The measurements are of {kind}, the networks of {file.name} are of {whose.name}, whose measurements have the "
            f"columns {', '.join(whose.measured_columns)}; give networks of the robot that was measured."
        )
    if isinstance(tracks, CycleTracks) and isinstance(whose, Snake):
        return CyclePredictor(tracks, saved, whose)
    return NetworkPredictor(tracks, saved, whose)


def _robot_with(saved: StaticSimulator, file: Path) -> Robot:
    """The robot that a run's networks were made for, with its options; else the one that has such networks."""
    if "spec" in saved.provenance:
        return load_robot(json.loads(saved.provenance["spec"])["robot"])
    robots = []
    for robot in map(load_robot, robot_names()):  # one by one: a broken package stops no search that ends before it
        if tuple(robot.networks) == tuple(saved.networks):
            return robot
        robots.append(robot)
    known = "; ".join(f"{robot.name}: {', '.join(robot.networks)}" for robot in robots)
    raise ModelError(f"The networks of {file} are {', '.join(saved.networks)}; no robot has these ({known}).")
