"""Errors of a static simulator with each of its options on random controllers that it has learned nothing from."""

from __future__ import annotations

from itertools import combinations
from pathlib import Path

import numpy as np
import pandas as pd

from bns.diagnose.data.bodies.cycles import CycleTracks
from bns.diagnose.data.load import load_measured
from bns.diagnose.predict.cycle_networks import CyclePredictor
from bns.diagnose.predict.horizons import errors_of
from bns.physics.model import Model
from bns.robots import load_robot, robot_names
from bns.robots.simulator import load_static_simulator
from bns.robots.snake.options import BEYOND
from bns.robots.snake.robot import Snake
from bns.spec import OPTION_MARK
from bns.static_simulator.transfer_trials import measurements_path


def driven_tables(results: Path) -> dict[str, Path]:
    """Measurements of random controllers there are in a folder of results, by robot."""
    tables = {name: measurements_path(results, name) for name in robot_names()}
    return {name: path for name, path in tables.items() if path.is_file()}


def tracks_of(path: Path) -> CycleTracks:
    """The cycles of such a table."""
    tracks = load_measured(path).tracks
    assert isinstance(tracks, CycleTracks)
    return tracks


def variants(robot: str) -> list[str]:
    """The robot without options, with each, with all, as a spec names them."""
    chosen = [one for many in range(len(BEYOND) + 1) for one in combinations(BEYOND, many)]
    return [OPTION_MARK.join([robot, *names]) for names in chosen]


def errors(robot: str, tracks: CycleTracks) -> pd.DataFrame:
    """A row an option and horizon: root mean square errors of the middle (m, with standard error), of the direction (rad) and of
    the distance between the markers (m)."""
    rows = []
    for name in variants(robot):
        variant = load_robot(name)
        assert isinstance(variant, Snake)
        predictor = CyclePredictor(tracks, load_static_simulator(robot), variant)
        steps = predictor.steps(Model(wheelbase_m=1.0, name=name))
        for horizon in predictor.horizons:
            found = errors_of(predictor, steps, horizon).summary(len(tracks))
            if found["windows"]:
                gap = float(np.sqrt(np.mean(predictor.gap_errors(horizon) ** 2)))
                rows.append({"simulator": name, "horizon": horizon, **found, "gap_m": gap})
    return pd.DataFrame(rows)
