"""The snake's body fitted to what the dissertation published of its random cycles: a few parameters, within justified ranges.

Least squares of (statistic - target) / tolerance over the logarithms of the parameters, from finite differences that are wide
enough to see past single cycles that tip or not; every body drives the same cycles under the same draws.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from importlib import resources
from pathlib import Path
from typing import Any

import numpy as np
import yaml
from scipy.optimize import least_squares

from bns.errors import ModelError, unknown_name
from bns.physics.snake.parameters import SnakeParameters
from bns.robots.base import Robot
from bns.static_simulator.body_statistics import STATISTICS, Cycles, driven

STEP = 0.25
"""Difference quotients are taken over this much of a logarithm: single cycles that tip or not would drown smaller ones."""
Progress = Callable[[int, int], None]


@dataclass(frozen=True)
class Recipe:
    """What is fitted to what: ranges by parameter, (value, tolerance) by statistic, how many cycles, and how many looks."""

    ranges: Mapping[str, tuple[float, float]]
    targets: Mapping[str, tuple[float, float]]
    cycles: int
    repeated: int
    looks: int


@dataclass(frozen=True)
class Calibration:
    """Parameters before and after, what both bodies' cycles did, and 95 % intervals (parameters, 2) of the fitted values."""

    recipe: Recipe
    before: SnakeParameters
    after: SnakeParameters
    cycles_before: Cycles
    cycles_after: Cycles
    intervals: np.ndarray


def shipped_recipe() -> Recipe:
    """The recipe beside the parameters in the package."""
    return read_recipe((Path(str(resources.files("bns.physics.snake"))) / "calibration.yaml").read_text())


def read_recipe(text: str) -> Recipe:
    """A recipe from YAML; ModelError names an entry that is missing, unknown, without its reason or without a range."""
    try:
        content = yaml.safe_load(text)
        ranges = {name: _range(name, entry) for name, entry in content["parameters"].items()}
        targets = {name: _target(name, entry) for name, entry in content["targets"].items()}
        counts = [int(content[name]) for name in ("cycles", "repeated", "looks")]
    except (yaml.YAMLError, KeyError, TypeError, AttributeError) as fault:
        raise ModelError(
            f"the recipe of a calibration cannot be read ({fault}); it needs parameters, targets, cycles, repeated and looks, "
            "as bns/physics/snake/calibration.yaml has them."
        ) from fault
    if not 2 <= counts[1] < counts[0] or counts[2] < 1:
        raise ModelError(f"cycles, repeated and looks are {counts}; give at least 2 repeated, more cycles, and 1 look.")
    return Recipe(ranges, targets, *counts)


def _range(name: str, entry: Mapping[str, Any]) -> tuple[float, float]:
    if name not in SnakeParameters.__dataclass_fields__:
        raise ModelError(unknown_name("parameter of the snake", name, SnakeParameters.__dataclass_fields__))
    low, high = float(entry["low"]), float(entry["high"])
    if not 0 < low < high or not entry["reason"]:
        raise ModelError(f"the range of {name} is {low:g} to {high:g}; give 0 < low < high, and a reason.")
    return low, high


def _target(name: str, entry: Mapping[str, Any]) -> tuple[float, float]:
    if name not in STATISTICS:
        raise ModelError(unknown_name("statistic of cycles", name, STATISTICS))
    value, tolerance = float(entry["value"]), float(entry["tolerance"])
    if tolerance <= 0 or not entry["derived"]:
        raise ModelError(f"the target {name} has tolerance {tolerance:g}; give one above 0, and how the value is derived.")
    return value, tolerance


def calibrate(
    robot: Robot,
    parameters: SnakeParameters,
    recipe: Recipe,
    seed: int = 0,
    jobs: int = 1,
    progress: Progress = lambda done, of: None,
) -> Calibration:
    """Fit the recipe's parameters, from where they are; same seed, same numbers for any number of ``jobs``."""
    names = list(recipe.ranges)
    low, high = np.log(np.array(list(recipe.ranges.values()))).T
    wanted, tolerance = np.array([recipe.targets[name] for name in recipe.targets]).T
    which = [STATISTICS.index(name) for name in recipe.targets]
    most, done = recipe.looks * (1 + len(names)), 0

    def body(logs: np.ndarray) -> SnakeParameters:
        return replace(parameters, **dict(zip(names, np.exp(logs).tolist(), strict=True)))

    def off(logs: np.ndarray) -> np.ndarray:
        nonlocal done
        done += 1
        progress(min(done, most), most)
        found = driven(robot, body(logs), recipe.cycles, recipe.repeated, seed, jobs).statistics()[which]
        # A body of which hardly a cycle is stable is as far off as can be told.
        return np.clip((found - wanted) / tolerance, -100, 100)

    begin = np.clip(np.log([max(getattr(parameters, name), 1e-9) for name in names]), low, high)
    begin = np.clip(begin, low + 1e-6, high - 1e-6)
    fit = least_squares(off, begin, bounds=(low, high), diff_step=STEP / np.abs(begin), max_nfev=recipe.looks)
    after = body(fit.x)
    first, last = (driven(robot, one, recipe.cycles, recipe.repeated, seed, jobs) for one in (parameters, after))
    return Calibration(recipe, parameters, after, first, last, _intervals(fit.x, fit.jac, low, high))


def _intervals(logs: np.ndarray, jacobian: np.ndarray, low: np.ndarray, high: np.ndarray) -> np.ndarray:
    """95 % intervals of the parameters, cut at their ranges, which count as what was known of them beforehand."""
    prior = np.diag(1 / ((high - low) / 4) ** 2)
    sd = np.sqrt(np.diag(np.linalg.inv(jacobian.T @ jacobian + prior)))
    return np.exp(np.clip(logs[:, None] + 1.96 * sd[:, None] * np.array([-1, 1]), low[:, None], high[:, None]))


def describe(found: Calibration) -> str:
    """Two tables: statistics with targets, before and after; parameters before and after, with intervals."""
    lines = ["                     target           before                  after"]
    sides = [(cycles.statistics(), cycles.intervals()) for cycles in (found.cycles_before, found.cycles_after)]
    for name, (value, tolerance) in found.recipe.targets.items():
        i = STATISTICS.index(name)
        shown = "".join(f"  {one[i]:.3f} ({many[i, 0]:.3f} to {many[i, 1]:.3f})" for one, many in sides)
        lines.append(f"  {name:18s} {value:.3f} ± {tolerance:.3f}{shown}")
    for name, (low, high) in zip(found.recipe.ranges, found.intervals, strict=True):
        before, after = getattr(found.before, name), getattr(found.after, name)
        lines.append(f"  {name:22s} {before:.4g} -> {after:.4g} ({low:.4g} to {high:.4g})")
    return "\n".join(lines)


def with_values(text: str, found: Calibration) -> str:
    """A file of parameters whose fitted entries have the new values; their reasons stay, and the basis says `fitted`."""
    lines = []
    for line in text.splitlines():
        name = line.split(":")[0]
        if name in found.recipe.ranges:
            reason = line.split("reason:", 1)[1]
            lines.append(f"{name + ':':20s} {{value: {getattr(found.after, name):.4g}, basis: fitted, reason:{reason}")
        else:
            lines.append(line)
    return "\n".join(lines) + "\n"
