"""The kernels of one robot, made for its networks and its rules."""

from __future__ import annotations

from functools import cache
from importlib import import_module
from typing import Any

from bns.robots import load_robot


@cache
def kernels_of(robot: str) -> Kernels:
    """The kernels of a robot, by its name."""
    return Kernels(load_robot(robot), robot)


class Kernels:
    """Made once, and loaded only here: numba's CUDA support need not be there if nobody asks for it."""

    def __init__(self, robot: Any, name: str) -> None:
        load = import_module
        self.cuda = load("numba.cuda")
        own, training = load(f"bns.cuda.robots.{name}"), load("bns.cuda.on_device.training")
        evolution, measuring = load("bns.cuda.on_device.evolution"), load("bns.cuda.on_device.measuring")
        networks = len(robot.networks)
        squashed = robot.sigmoid_output
        self.train = training.training_kernel(robot.hidden, squashed, robot.repeats_inputs)
        self.restart, self.warp = training.restart, training.WARP
        self.merge = load("bns.cuda.on_device.merging").merge
        self.evolve = evolution.evolution_kernel(own, networks, robot.hidden)
        self.measure = measuring.measuring_kernel(robot.bounds, networks, robot.hidden, squashed)
        self.drive, self.driven, self.measured = own.drive, own.DRIVEN, measuring.MEASURED
        self.driving_grid, self.steps = own.driving_grid, own.STEPS
        self.evals_of = load("bns.cuda.on_device.rows").evals_of
