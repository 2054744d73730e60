"""The surest controller made surer: a local search on how often a list of commands succeeds under noise.

Evolution finds a way through the task. How often it succeeds then hangs on small changes of all commands at once, which crossover
and mutation hardly ever make, and a few simulations of each controller cannot tell 90 from 95 %.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from bns.approaches.parts.base import Setting
from bns.approaches.parts.noisy import NoisySimulator
from bns.engine.evolution import Population
from bns.errors import SpecError
from bns.robots.base import RandomStream
from bns.tasks import Task

PROPOSALS = 24
"""Lists that are tried in each step."""
FIRST, SMALLEST, LARGEST = 0.05, 0.002, 0.1
"""Size of a change, as a share of a component's range: at first, and its limits."""
GROWTH, DECAY = 1.1, 0.97
"""Factor of this size after a step that helped, and after one that did not."""
REMOVALS, FEW = 0.1, 0.45
"""Shares of the lists that are tried: those that lose a command, those with few changed components; in the rest, all change."""


def check_polish(setting: Setting) -> None:
    """SpecError for a search for success under noise where there is no noise."""
    if setting.options["polish"] and not setting.options["noise"]:
        raise SpecError("approach bns+polish: it searches for success under noise, and there is none; add noise=16.")


def polished(simulator: NoisySimulator, lists: Sequence[np.ndarray], setting: Setting, number: int) -> np.ndarray:
    """The end (m, components) of a search from the surest of lists (n, components); ``number`` of the round: its draws.

    In this round's draws it succeeds at least as often as each of them.
    """
    stream, random = RandomStream(setting.own_key("polishing"), number), setting.generator(number)
    best, size = lists[_surest(simulator, lists, setting.task, stream)], FIRST
    for _ in range(setting.whole("polish")):
        tried = [best, *(_changed(best, size, setting, random) for _ in range(PROPOSALS))]
        found = _surest(simulator, tried, setting.task, stream)
        size = min(size * GROWTH, LARGEST) if found else max(size * DECAY, SMALLEST)
        best = tried[found]
    return best.copy()


def _surest(simulator: NoisySimulator, lists: Sequence[np.ndarray], task: Task, stream: RandomStream) -> int:
    """Which list succeeds most often; the first of equals."""
    lengths = np.array([len(one) for one in lists], np.int32)
    commands = np.zeros((len(lists), lengths.max(), lists[0].shape[1]), np.float32)
    for row, one in zip(commands, lists, strict=True):
        row[: len(one)] = one
    return int(np.argmax(simulator.success(Population(commands, lengths), task, stream)[0]))


def _changed(commands: np.ndarray, size: float, setting: Setting, random: np.random.Generator) -> np.ndarray:
    """A command left out, few components moved, or all of them a little."""
    robot: Any = setting.robot
    low, high = robot.bounds.low, robot.bounds.high
    n, kind = len(commands), random.random()
    if kind < REMOVALS and n > setting.spec.min_commands:
        return np.delete(commands, random.integers(n), axis=0)
    few = kind < REMOVALS + FEW
    which = random.random(commands.shape) < max(0.1, 0.5 / n) if few else np.ones(commands.shape, bool)
    scale = size * random.choice([0.2, 1.0, 3.0] if few else [0.1, 0.3])
    moved = commands + which * random.standard_normal(commands.shape) * scale * (high - low).astype(np.float64)
    return np.clip(moved, low, high).astype(np.float32)
