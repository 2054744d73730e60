"""How often a list of commands can succeed at all in the substitute world, if its static simulator and its noise were known.

`python -m analysis.ceiling [--seeds N] [--out FILE.csv]`: for each task, lists are evolved on the static simulator itself, for
the mean over noisy simulations, and then improved by a local search on the rate of success. Of all seeds the best list, by the
draws it was searched with, is judged with new ones. No approach could do this: it is a lower bound of what is possible.
"""

from __future__ import annotations

import argparse
from collections.abc import Sequence
from pathlib import Path

import numpy as np
import pandas as pd

from analysis.intervals import wilson
from bns.approaches.parts.noisy import NoisySimulator, most_certain
from bns.bootstrap.simulators import NetworkSimulator
from bns.engine.evolution import Population, rank, tournament_cdf
from bns.engine.philox import Key
from bns.robots import load_robot
from bns.robots.base import RandomStream
from bns.robots.simulator import load_static_simulator
from bns.tasks import Task, load_task

ROBOT, STATIC = load_robot("khepera"), load_static_simulator("khepera")
TASKS = ("circle", "infinity", "complex")
SIZE, GENERATIONS, ROWS, LONGEST, SHORTEST = 400, 1000, 8, 30, 4
STEPS, PROPOSALS, DRAWS, RENEWED = 500, 48, 1500, 25
"""Of the local search: steps, lists tried in each, noisy simulations of each list, and after how many steps these are new."""
JUDGED = 20_000
_SPAN = (ROBOT.bounds.high - ROBOT.bounds.low).astype(np.float64)


def success(lists: Sequence[np.ndarray], task: Task, drives: int, stream: RandomStream) -> np.ndarray:
    """Share of noisy drives (lists,) in which each list of commands (n, 3) passes all goals within 7 cm."""
    lengths = np.array([len(one) for one in lists], np.int32)
    commands = np.zeros((len(lists), lengths.max(), 3), np.float32)
    for row, one in zip(commands, lists, strict=True):
        row[: len(one)] = one
    population = Population(commands, lengths)
    outputs = ROBOT.score(population, STATIC.weights, task).outputs
    return np.asarray(ROBOT.expected(population, outputs, task, STATIC.noise_sd, drives, stream).success)


def evolved(task: Task, seed: int, generations: int = GENERATIONS) -> np.ndarray:
    """The list (n, 3) that a genetic algorithm ends with, on the static simulator under its noise."""
    key = Key.of_run(seed, 0, ROBOT.name, f"{task.name}, ceiling")
    simulator = NoisySimulator(NetworkSimulator(ROBOT, task, STATIC.weights), STATIC.noise_sd, ROWS)
    population, cdf = ROBOT.initial_population(key, SIZE, SHORTEST, LONGEST), tournament_cdf(SIZE, 0.1)
    spare = Population(np.zeros_like(population.commands), np.zeros_like(population.lengths))
    scores = simulator.score(population, RandomStream(key, 0))
    for generation in range(1, generations + 1):
        rate = 0.1 if generation < generations / 2 else 0.05
        ROBOT.breed(key, population, rank(scores.fitness), cdf, rate, SHORTEST, generation, spare)
        population, spare = spare, population
        scores = simulator.score(population, RandomStream(key, generation), scores)
    best = most_certain(simulator, population, rank(scores.fitness), task, key, generations + 1)
    return population.controller(best)


def improved(commands: np.ndarray, task: Task, seed: int, steps: int = STEPS) -> tuple[np.ndarray, float]:
    """A list that succeeds at least as often under the draws of the search, and that rate: a step is smaller where none helps."""
    key, random = Key.of_run(seed, 1, ROBOT.name, f"{task.name}, ceiling"), np.random.default_rng(seed)
    size, rate = 0.05, 0.0
    for step in range(steps):
        tried = [commands, *(_changed(commands, size, random) for _ in range(PROPOSALS))]
        rates = success(tried, task, DRAWS, RandomStream(key, step // RENEWED))
        best = int(np.argmax(rates))
        size = min(size * 1.1, 0.1) if rates[best] > rates[0] else max(size * 0.97, 0.002)
        commands, rate = (tried[best], float(rates[best])) if rates[best] > rates[0] else (commands, float(rates[0]))
    return commands, rate


def _changed(commands: np.ndarray, size: float, random: np.random.Generator) -> np.ndarray:
    """Few components moved, or all of them a little; in 15 of 100 lists, a command left out or two joined."""
    kind, n = random.random(), len(commands)
    if kind < 0.85 or n <= SHORTEST:
        few = kind < 0.5
        which = random.random((n, 3)) < max(0.1, 0.5 / n) if few else np.ones((n, 3), bool)
        scale = size * random.choice([0.2, 1.0, 3.0] if few else [0.1, 0.3])
        moved = commands + which * random.standard_normal((n, 3)) * scale * _SPAN
    elif kind < 0.95:
        moved = np.delete(commands, random.integers(n), axis=0)
    else:
        moved = _joined(commands, int(random.integers(n - 1)))
    return np.clip(moved, ROBOT.bounds.low, ROBOT.bounds.high).astype(np.float32)


def _joined(commands: np.ndarray, at: int) -> np.ndarray:
    """Two commands as one: mean speeds, both durations."""
    one, other = commands[at].astype(np.float64), commands[at + 1].astype(np.float64)
    lasts = one[2] + other[2]
    both = (one * one[2] + other * other[2]) / lasts
    both[2] = lasts
    return np.vstack([commands[:at], both, commands[at + 2 :]])


def judged(commands: np.ndarray, task: Task) -> float:
    """Rate of success with draws that no search has seen."""
    return float(success([commands], task, JUDGED, RandomStream(Key(0, 0), 1))[0])


def summary(lists: pd.DataFrame) -> pd.DataFrame:
    """By task: commands, per cent of success with its 95 % Wilson interval; ``lists``: the file of `main`."""
    rows = []
    for name in TASKS:
        own = lists[lists.task == name].sort_values("step")
        rate = judged(own[list(ROBOT.command_columns)].to_numpy(np.float32), load_task("khepera", name))
        low, high = wilson(round(rate * JUDGED), JUDGED)
        rows.append({"task": name, "commands": len(own), "success": 100 * rate, "low": 100 * low, "high": 100 * high})
    return pd.DataFrame(rows)


def main(arguments: Sequence[str] | None = None) -> int:
    """Search, write the best list of each task, and print how often it succeeds."""
    parser = argparse.ArgumentParser(prog="python -m analysis.ceiling", description=__doc__.split("\n\n", maxsplit=1)[0])
    parser.add_argument("--seeds", type=int, default=6, help="searches for each task (6)")
    parser.add_argument("--out", type=Path, default=Path("ceiling.csv"), help="CSV file for the lists (ceiling.csv)")
    wanted = parser.parse_args(arguments)
    found = []
    for task in (load_task("khepera", name) for name in TASKS):
        searched = [improved(evolved(task, seed), task, seed) for seed in range(wanted.seeds)]
        best = max(searched, key=lambda one: one[1])[0]
        table = pd.DataFrame(best, columns=list(ROBOT.command_columns))
        found.append(table.assign(task=task.name, step=np.arange(1, len(best) + 1)))
    lists = pd.concat(found, ignore_index=True)[["task", "step", *ROBOT.command_columns]]
    lists.to_csv(wanted.out, index=False)
    print(summary(lists).round(1).to_string(index=False))
    return 0


if __name__ == "__main__":
    raise SystemExit(main())
