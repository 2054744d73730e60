"""The static simulator: networks trained beforehand on random commands, as the dissertation did from its robot (section 4.5).

Random commands drive the physics world trial by trial; networks learn from three quarters of the trials; the rest verifies
them. The residuals on the verification trials give the noise of the substitute world.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from bns import __version__
from bns.engine.philox import Key, Purpose, uniforms
from bns.engine.rprop import Rprop
from bns.engine.snn import INPUTS, initial_weights, predict
from bns.robots.base import Robot
from bns.robots.simulator import StaticSimulator
from bns.static_simulator.train_in_stages import train_in_stages
from bns.worlds.base import World
from bns.worlds.many import drive_all

TRIALS, COMMANDS = 300, 10
"""3000 commands: about 85 minutes of driving."""
ROUNDS, ITERATIONS = 20, 1000
"""20,000 iterations of Rprop, a round at a time."""
VERIFICATION_SHARE = 0.25


@dataclass(frozen=True)
class Patterns:
    """Inputs (inputs, n), targets (networks, n) and whether each pattern is for verification (n,)."""

    inputs: np.ndarray
    targets: np.ndarray
    verification: np.ndarray


def collect(robot: Robot, world: World, key: Key, jobs: int = 1) -> Patterns:
    """Drive random controllers in the world; whole trials are held out for verification."""
    controllers = robot.random_controllers(key, TRIALS, COMMANDS)
    drives = [controllers.controller(trial) for trial in range(TRIALS)]
    driven = drive_all(world, drives, key, Purpose.PRECOMPUTE, 1, jobs)
    inputs = [robot.inputs(commands) for commands in drives]
    targets = [robot.targets(robot.measured_displacements(poses)) for poses in driven]
    held_out = uniforms(key, Purpose.SPLIT, 0, TRIALS, 1)[:, 0, 0] < VERIFICATION_SHARE
    return Patterns(np.hstack(inputs), np.hstack(targets), np.repeat(held_out, COMMANDS))


def precompute(
    robot: Robot,
    world: World,
    seed: int = 0,
    progress: Callable[[int, int], None] = lambda done, of: None,
    jobs: int = 1,
) -> StaticSimulator:
    """Collect, train, verify. Same seed, same numbers, for any number of ``jobs`` that drive."""
    if robot.recipe is not None:
        return train_in_stages(robot, world, robot.recipe, seed, progress, jobs)
    key = Key.of_run(seed, 0, robot.name, "precompute")
    patterns = collect(robot, world, key, jobs)
    learn = ~patterns.verification
    X, y = np.ascontiguousarray(patterns.inputs[:, learn]), np.ascontiguousarray(patterns.targets[:, learn])
    rule = Rprop.start(initial_weights(key, len(robot.networks), robot.hidden), "rprop+")
    for done in range(ROUNDS):
        progress(done, ROUNDS)
        rule.train(X, y, X.shape[1], ITERATIONS)
    progress(ROUNDS, ROUNDS)
    residuals, accuracy = verify(robot, rule.weights, patterns)
    provenance = {
        "robot": robot.name,
        "world_digest": world.digest,
        "seed": seed,
        "trials": TRIALS,
        "commands_a_trial": COMMANDS,
        "training_patterns": int(learn.sum()),
        "verification_patterns": int(patterns.verification.sum()),
        "iterations": ROUNDS * ITERATIONS,
        "algorithm": "rprop+",
        "inputs": INPUTS,
        "hidden": robot.hidden,
        "bns_version": __version__,
        "accuracy": accuracy,
    }
    return StaticSimulator(robot.networks, rule.weights, residuals.std(axis=0), provenance)


def verify(robot: Robot, weights: np.ndarray, patterns: Patterns) -> tuple[np.ndarray, dict[str, dict[str, float]]]:
    """Residuals (n, networks) in SI on verification patterns; per network R², slope of predicted on measured, RMSE, bias."""
    X = np.ascontiguousarray(patterns.inputs[:, patterns.verification])
    measured = robot.displacements(patterns.targets[:, patterns.verification])
    predicted = robot.displacements(predict(weights, X))
    residuals = predicted - measured
    accuracy = {}
    for i, name in enumerate(robot.networks):
        spread = measured[:, i] - measured[:, i].mean()
        accuracy[name] = {
            "r2": float(1 - (residuals[:, i] ** 2).sum() / (spread**2).sum()),
            "slope": float((spread * predicted[:, i]).sum() / (spread**2).sum()),
            "rmse": float(np.sqrt((residuals[:, i] ** 2).mean())),
            "bias": float(residuals[:, i].mean()),
        }
    return residuals, accuracy


def describe(simulator: StaticSimulator) -> str:
    """The accuracy on verification data as a table in words."""
    made = simulator.provenance
    lines = [
        f"static simulator of {made['robot']}: {made['training_patterns']} training and "
        f"{made['verification_patterns']} verification patterns, {made['iterations']} iterations, {simulator.digest}"
    ]
    for name, noise in zip(simulator.networks, simulator.noise_sd, strict=True):
        got = made["accuracy"][name]
        unit = {"dtheta": " rad", "stable": ""}.get(name, " m")
        lines.append(
            f"  {name:9s} R² {got['r2']:.4f}  slope {got['slope']:.4f}  RMSE {got['rmse']:.5f}{unit}  "
            f"bias {got['bias']:+.5f}{unit}  noise of the substitute world {noise:.5f}{unit}"
        )
    return "\n".join(lines)
