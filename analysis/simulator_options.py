"""What each option of a robot's simulator buys: errors on drives that no network has learned from."""

from __future__ import annotations

from itertools import combinations
from pathlib import Path

import numpy as np
import pandas as pd

from analysis.drawn import Drawn
from analysis.store import NoDataError, Store
from bns.diagnose.cycle_networks import CyclePredictor
from bns.diagnose.cycles import CycleTracks
from bns.diagnose.horizons import errors_of
from bns.diagnose.intake import load_measured
from bns.physics.model import Model
from bns.plotting import OKABE_ITO, lettered, note, panels, style
from bns.robots import load_robot, robot_names
from bns.robots.simulator import load_static_simulator
from bns.robots.snake.robot import Snake
from bns.spec import OPTION_MARK
from bns.validation import measurements_path

NAME = "simulator-options"
PAPER = "beyond the source"
_AS_SOURCE = "the simulator as in the source"


def draw(store: Store) -> list[Drawn]:
    tables = {name: measurements_path(store.results, name) for name in robot_names()}
    found = {name: path for name, path in tables.items() if path.is_file()}
    if not found:
        raise NoDataError("no random controllers were driven to hold a simulator against; run bns validate --robot snake")
    return [_draw(name, path) for name, path in found.items()]


def variants(robot: str) -> list[str]:
    """The robot without options, with each, with all, as a spec names them."""
    options = load_robot(robot).options
    chosen = [one for many in range(len(options) + 1) for one in combinations(sorted(options), many)]
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


@style()
def _draw(robot: str, path: Path) -> Drawn:
    tracks = load_measured(path).tracks
    assert isinstance(tracks, CycleTracks)
    data = errors(robot, tracks)
    kinds = (
        ("position_m", 100.0, "where the middle is", "cm"),
        ("heading_rad", 180 / np.pi, "where it faces", "degrees"),
        ("gap_m", 100.0, "how far apart\nthe markers are", "cm"),
    )
    figure, axes = panels(len(kinds), 3.3)
    horizons = list(dict.fromkeys(data.horizon))
    for panel, ((column, unit, what, name_of_unit), ax) in enumerate(zip(kinds, axes[:, 0], strict=True)):
        names = list(dict.fromkeys(data.simulator))
        for number, name in enumerate(names):
            rows = data[data.simulator == name].set_index("horizon").reindex(horizons)
            error = 1.96 * unit * rows.position_se_m if column == "position_m" else None
            place = np.arange(len(horizons)) + (number - (len(names) - 1) / 2) * 0.17
            title = _AS_SOURCE if name == robot else f"with {' and '.join(name.split(OPTION_MARK)[1:])}"
            look = {"fmt": "osD^"[number % 4], "color": OKABE_ITO[number], "capsize": 2}
            ax.errorbar(place, unit * rows[column], error, label=title, **look)
        ax.set(ylim=(0, 1.05 * ax.get_ylim()[1]), ylabel=f"error ({name_of_unit})")
        ax.set_title(lettered(panel, len(kinds), what))
        ax.set_xticks(range(len(horizons)), [_in_two_lines(one) for one in horizons])
    figure.legend(*axes[0, 0].get_legend_handles_labels(), loc="outside upper center", ncols=2)
    said = f"{len(tracks)} random controllers, {int(tracks.stable.sum())} stable cycles of {len(tracks.stable)}"
    note(figure, f"{said}; root mean square; bars: 95 %, by controller. Cycles are predicted from where the markers were seen.")
    shows = (
        f"Errors of the static simulator of the {robot} on {said}, driven in the physics world and learned from by nothing: over "
        "one cycle, over the change to the next, over three cycles and the changes between them, over all stable cycles that a "
        "controller began with. changes: the change of posture moves the markers; rigid: the markers are on one body."
    )
    see = "An option is worth what it takes off the first of each group."
    title = f"What options of the simulator buy, {robot}"
    return Drawn(f"{NAME}-{robot}", title, figure, shows, len(tracks), (), see=see, data=data)


def _in_two_lines(horizon: str) -> str:
    return horizon.replace("trial", "whole\ntrial").replace(" cycles", "\ncycles")
