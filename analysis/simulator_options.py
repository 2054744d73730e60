"""What each option of a robot's simulator buys: errors on drives that no network has learned from."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from analysis.figure_result import FigureResult
from analysis.results import NoDataError, Results
from bns.plotting.style import OKABE_ITO, lettered, note, panels, style
from bns.spec import OPTION_MARK

NAME = "simulator-options"
PAPER = "beyond the dissertation"
_AS_SOURCE = "the simulator as in the dissertation"


def draw(store: Results) -> list[FigureResult]:
    from analysis.option_errors import driven_tables  # noqa: PLC0415  # brings the compiler, for which no other figure waits

    found = driven_tables(store.results)
    if not found:
        raise NoDataError("no random controllers were driven to compare a simulator with; run bns validate --robot snake")
    return [_draw(name, path) for name, path in found.items()]


@style()
def _draw(robot: str, path: Path) -> FigureResult:
    from analysis.option_errors import errors, tracks_of  # noqa: PLC0415

    tracks = tracks_of(path)
    data = errors(robot, tracks)
    kinds = (
        ("position_m", 100.0, "position of the middle", "cm"),
        ("heading_rad", 180 / np.pi, "heading", "degrees"),
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
        f"Errors of the static simulator of the {robot} on {said}, driven in the physics world, from which no network has "
        "learned: over one cycle, over the change to the next, over three cycles and the changes between them, over all stable "
        "cycles that a controller began with. changes: the change of posture moves the markers; rigid: the markers are on one "
        "body."
    )
    see = "The gain of an option is its difference to the first bar of each group."
    title = f"What options of the simulator gain, {robot}"
    return FigureResult(f"{NAME}-{robot}", title, figure, shows, len(tracks), (), see=see, data=data)


def _in_two_lines(horizon: str) -> str:
    return horizon.replace("trial", "whole\ntrial").replace(" cycles", "\ncycles")
