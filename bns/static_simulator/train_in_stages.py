"""A static simulator in stages: random commands, the worst patterns again, the worst of evolved controllers (section 5.4.1).

Every command is driven by itself. A part of the patterns is held out for verification and takes no part in anything; another
is only watched, and training goes back to where it was best on those.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from bns import __version__
from bns.bootstrap.evolver import Evolver
from bns.bootstrap.simulators import NetworkSimulator
from bns.engine.philox import Key, Purpose, uniforms
from bns.engine.rprop import Rprop
from bns.engine.snn import initial_weights, predict
from bns.robots.base import Robot, StagedTraining
from bns.robots.simulator import StaticSimulator
from bns.spec import RunSpec
from bns.tasks import load_task, task_names
from bns.worlds.base import World
from bns.worlds.many import drive_all

VERIFICATION_SHARE, WATCHED_SHARE = 0.09, 0.09
"""The dissertation verified on 82 of 900 patterns."""
CHUNK = 100
"""Iterations between two looks at the watched patterns."""
CONTROLLERS, GENERATIONS, CYCLES = 12, 100, 4
"""Controllers evolved for their worst commands, as in section 5.5.2: twelve, of four cycles each."""
TOURNAMENT = 20 / 400
_NO_COUNTS = np.empty(0, np.float32)
Progress = Callable[[int, int], None]


@dataclass(frozen=True)
class Patterns:
    """Commands (n, components), what they did (n, networks) in SI, and a draw (n,) that says what each pattern is for."""

    commands: np.ndarray
    moved: np.ndarray
    split: np.ndarray

    @property
    def verification(self) -> np.ndarray:
        """Held out of everything, bool (n,)."""
        return self.split < VERIFICATION_SHARE

    @property
    def watched(self) -> np.ndarray:
        """Seen by the end of training only, bool (n,)."""
        return ~self.verification & (self.split < VERIFICATION_SHARE + WATCHED_SHARE)

    @property
    def learned(self) -> np.ndarray:
        """All others, bool (n,)."""
        return self.split >= VERIFICATION_SHARE + WATCHED_SHARE

    def joined(self, other: Patterns) -> Patterns:
        """These patterns, then the others."""
        pairs = ((self.commands, other.commands), (self.moved, other.moved), (self.split, other.split))
        return Patterns(*(np.concatenate(pair) for pair in pairs))


class CommandSampler:
    """Drives commands one by one and counts them, so that every drive has draws of its own."""

    def __init__(self, robot: Robot, world: World, key: Key, total: int, progress: Progress, jobs: int) -> None:
        self.robot, self.world, self.key, self._jobs = robot, world, key, jobs
        self._total, self._progress, self.driven = total, progress, 0

    def drive(self, commands: np.ndarray) -> Patterns:
        """What each command does from the start."""
        before = self.driven
        split = uniforms(self.key, Purpose.SPLIT, self.driven, 1, len(commands))[0, :, 0]
        self.driven += len(commands)
        alone = [commands[i : i + 1] for i in range(len(commands))]
        seen = drive_all(
            self.world, alone, self.key, Purpose.PRECOMPUTE, before + 1, self._jobs,
            lambda done: self._progress(before + done, self._total),
        )  # fmt: skip
        return Patterns(commands, np.array([self.robot.measured_displacements(poses)[0] for poses in seen]), split)

    def again(self, commands: np.ndarray, variants: int) -> Patterns:
        """The same commands once more, and others near each."""
        near = self.robot.perturb(np.repeat(commands, variants, axis=0), self.key, 1 + self.driven)
        return self.drive(np.concatenate([commands, near]))


def train_in_stages(
    robot: Robot, world: World, recipe: StagedTraining, seed: int, progress: Progress, jobs: int = 1
) -> StaticSimulator:
    """All stages of the recipe. Same seed, same numbers, for any number of ``jobs`` that drive."""
    key, nets = Key.of_run(seed, 0, robot.name, "precompute"), len(robot.networks)
    total = recipe.random + nets * recipe.worst * (1 + recipe.variants)
    total += recipe.evolved_worst * (1 + recipe.evolved_variants) + CONTROLLERS * CYCLES
    sampler = CommandSampler(robot, world, key, total, progress, jobs)
    patterns = sampler.drive(robot.random_controllers(key, recipe.random, 1).commands[:, 0])
    weights, _ = trained(robot, key, patterns, recipe.iterations)
    bad = [worst(robot, weights, patterns, recipe.worst, net) for net in range(nets)]
    patterns = patterns.joined(sampler.again(np.concatenate(bad), recipe.variants))
    weights, _ = trained(robot, key, patterns, recipe.iterations)
    tried = sampler.drive(evolved_commands(robot, key, weights))
    every = Patterns(tried.commands, tried.moved, np.ones(len(tried.split)))
    patterns = patterns.joined(
        sampler.again(worst(robot, weights, every, recipe.evolved_worst), recipe.evolved_variants)
    )
    weights, iterations = trained(robot, key, patterns, recipe.iterations)
    progress(total, total)
    about = _provenance(robot, world, seed, patterns, weights, iterations)
    return StaticSimulator(robot.networks, weights, np.array(recipe.noise_sd), about)


def trained(robot: Robot, key: Key, patterns: Patterns, iterations: int) -> tuple[np.ndarray, list[int]]:
    """Networks (networks, W) where they were best on the watched patterns, and after how many iterations each was."""
    weights = initial_weights(key, len(robot.networks), robot.hidden, robot.input_count, robot.nguyen_widrow)
    rule = Rprop.start(weights, "rprop+", robot.sigmoid_output, robot.flat_spot)
    X, targets, present = robot.inputs(patterns.commands), robot.targets(patterns.moved), robot.learnable(patterns.moved)
    best, at = weights.copy(), [0] * len(weights)
    for net in range(len(weights)):
        learn, watch = patterns.learned & present[net], patterns.watched & present[net]
        inputs, target = np.ascontiguousarray(X[:, learn]), np.ascontiguousarray(targets[net, learn])
        lowest = np.inf
        for done in range(CHUNK, iterations + 1, CHUNK):
            rule.train_one(net, inputs, target, _NO_COUNTS, len(target), CHUNK)
            outputs = predict(rule.weights[net : net + 1], X[:, watch], robot.sigmoid_output)[0]
            error = float(((outputs - targets[net, watch]) ** 2).sum())
            if error < lowest:
                lowest, best[net], at[net] = error, rule.weights[net], done
    return best, at


def errors(robot: Robot, weights: np.ndarray, patterns: Patterns) -> np.ndarray:
    """Absolute errors (networks, n) of the outputs; NaN where a network may not learn from a pattern."""
    outputs = predict(weights, robot.inputs(patterns.commands), robot.sigmoid_output)
    return np.where(robot.learnable(patterns.moved), np.abs(outputs - robot.targets(patterns.moved)), np.nan)


def worst(robot: Robot, weights: np.ndarray, patterns: Patterns, count: int, net: int | None = None) -> np.ndarray:
    """Commands (count, components) of the largest error in one network, or in the displacements and the rest summed up."""
    found = errors(robot, weights, patterns)
    error = np.nansum(found, axis=0) if net is None else found[net]
    ranked = np.argsort(np.where(patterns.verification | np.isnan(error), -1.0, error), kind="stable")
    return patterns.commands[ranked[::-1][:count]]


def evolving(robot: Robot) -> Robot:
    """The robot with those options that are on while controllers evolve on a static simulator."""
    if robot.recipe is None or not robot.recipe.evolving:
        return robot
    return robot.with_options(tuple(sorted({*robot.switched_on, *robot.recipe.evolving})))


def evolved_commands(robot: Robot, key: Key, weights: np.ndarray) -> np.ndarray:
    """The distinct commands of controllers evolved on the networks, for the last task."""
    task = load_task(robot.name, max(task_names(robot.name), key=lambda name: len(load_task(robot.name, name).goals_m)))
    spec = RunSpec(
        robot=robot.name,
        task=task.name,
        tournament_size=TOURNAMENT,
        generations_per_evaluation=GENERATIONS,
        max_commands=CYCLES,
    )
    own, found = evolving(robot), []
    simulator = NetworkSimulator(own, task, weights)
    for trial in range(CONTROLLERS):
        evolver = Evolver.start(own, task, Key(1 + trial, key.study), spec, simulator)
        evolver.evolve(simulator)
        found.append(evolver.fittest())
    return np.concatenate(found)


def _provenance(
    robot: Robot, world: World, seed: int, patterns: Patterns, weights: np.ndarray, iterations: list[int]
) -> dict[str, object]:
    held = patterns.verification
    measured = patterns.moved[held]
    outputs = predict(weights, robot.inputs(patterns.commands[held]), robot.sigmoid_output)
    predicted, learnable = robot.displacements(outputs), robot.learnable(measured)
    about = {
        "robot": robot.name,
        "world_digest": world.digest,
        "seed": seed,
        "training_patterns": int((~held).sum()),
        "verification_patterns": int(held.sum()),
        "stable_share": float(robot.learnable(patterns.moved)[0].mean()),
        "iterations": iterations,
        "algorithm": "rprop+",
        "inputs": robot.input_count,
        "hidden": robot.hidden,
        "bns_version": __version__,
        "verification": {"measured": measured.round(5).tolist(), "predicted": predicted.round(5).tolist()},
    }
    return about | {
        "accuracy": {
            name: accuracy(measured[learnable[net], net], predicted[learnable[net], net])
            for net, name in enumerate(robot.networks)
        }
    }


def accuracy(measured: np.ndarray, predicted: np.ndarray) -> dict[str, float]:
    """R² of prediction, the regression of predicted on measured (slope, its R²), RMSE and bias, all in the units given; the
    first three are 0 where all that was measured is the same."""
    spread, error = measured - measured.mean(), predicted - measured
    varies = float((spread**2).sum())
    return {
        "r2": float(1 - (error**2).sum() / varies) if varies else 0.0,
        "regression_r2": float(np.corrcoef(measured, predicted)[0, 1] ** 2) if varies and np.ptp(predicted) else 0.0,
        "slope": float((spread * predicted).sum() / varies) if varies else 0.0,
        "rmse": float(np.sqrt((error**2).mean())),
        "bias": float(error.mean()),
    }
