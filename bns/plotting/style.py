"""The one style of every figure, how figures are saved, and paths on the floor.

A figure is drawn and saved inside `style`; nothing here keeps global state or opens a window.
"""

from __future__ import annotations

import io
import textwrap
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from itertools import pairwise
from pathlib import Path
from typing import TYPE_CHECKING, Any

import matplotlib as mpl
import numpy as np
from cycler import cycler
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Circle, Rectangle
from matplotlib.patheffects import withStroke
from matplotlib.ticker import MultipleLocator

from bns.robots.base import on_floor
from bns.store.disk.files import publish

if TYPE_CHECKING:  # a figure of stored results does not wait for the compiler
    from bns.bootstrap.loop import RunResult
    from bns.robots.base import Robot
    from bns.spec import RunSpec
    from bns.tasks import Task

COLUMN_IN, PAGE_IN = 3.5, 7.2
"""Widths of one column and of a page."""
NARROW_IN = 3.0
"""Width of a figure for the screen of a phone."""
TEXT_PT = 8
"""No text is smaller than this at those widths."""
OKABE_ITO = ("#0072B2", "#D55E00", "#009E73", "#CC79A7", "#E69F00", "#56B4E9", "#000000")
BLUE, RED = OKABE_ITO[:2]
GREY = "#555555"

_SIZES = (
    "font.size axes.labelsize xtick.labelsize ytick.labelsize legend.fontsize legend.title_fontsize figure.labelsize"
)
_STYLE: Mapping[Any, Any] = {
    **dict.fromkeys(_SIZES.split(), TEXT_PT),
    **dict.fromkeys(("axes.titlesize", "figure.titlesize"), TEXT_PT + 1),
    **dict.fromkeys(("axes.spines.top", "axes.spines.right", "legend.frameon"), False),
    **dict.fromkeys(("axes.grid", "axes.axisbelow", "figure.constrained_layout.use"), True),
    **{"grid.color": "#dddddd", "grid.linewidth": 0.6, "axes.linewidth": 0.8, "lines.linewidth": 1.4},
    **{"lines.markersize": 4, "legend.handlelength": 3.2, "axes.prop_cycle": cycler(color=OKABE_ITO)},
    **{"savefig.dpi": 200, "svg.hashsalt": "bns", "svg.fonttype": "path"},
}
_LINES = ("-", "--", "-.", ":", (0, (5, 1, 1, 1, 1, 1)), (0, (1, 1)))
_MARKERS = ("o", "s", "^", "D", "v", "P")
_SMALLEST_TURN_RAD, _LARGEST_TURN_RAD = 1e-3, 0.95 * 2 * np.pi
_MARGIN_M, _REACH_M = 0.12, 0.6


@contextmanager
def style() -> Iterator[None]:
    """The settings that all figures are drawn and saved under, whatever the user's matplotlibrc says.

    A context manager, and so a decorator too: ``@style()``.
    """
    with mpl.rc_context():
        mpl.rcdefaults()
        mpl.rcParams.update(_STYLE)
        yield


def ordered_styles(count: int) -> list[dict[str, Any]]:
    """Colour, line style and marker for each of ``count`` ordered values: told apart without colour, too."""
    shades = mpl.colormaps["viridis"](np.linspace(0.0, 0.85, max(count, 1)))
    return [
        {
            "color": mpl.colors.to_hex(shades[i]),
            "linestyle": _LINES[i % len(_LINES)],
            "marker": _MARKERS[i % len(_MARKERS)],
        }
        for i in range(count)
    ]


def note(figure: Figure, text: str) -> None:
    """A line or more in grey below everything else, wrapped to the figure's width."""
    # An empty line first: the layout leaves no more than a hair between the note and the axes' labels.
    letters = int((figure.get_figwidth() - 0.2) * 72 / (0.52 * TEXT_PT))
    figure.supxlabel("\n" + textwrap.fill(text, letters), x=0.01, ha="left", color=GREY, fontsize=TEXT_PT)


def save(figure: Figure, stem: Path | str) -> tuple[Path, Path]:
    """Write ``stem``.png (200 dpi) and ``stem``.svg, each all at once; the same figure gives the same bytes.

    Raises:
        StoreError: the disk does not take a file.
    """
    return put(rendered(figure), stem)


def rendered(figure: Figure) -> tuple[bytes, bytes]:
    """The contents of a PNG (200 dpi) and an SVG of a figure, always the same; its layout is settled by this."""
    with style():
        figure.draw_without_rendering()
    figure.set_layout_engine("none")  # the places are found: to find them again for each file would take as long
    made = []
    for kind, metadata in (("png", {"Software": None}), ("svg", {"Date": None, "Creator": None})):
        buffer = io.BytesIO()
        with style():
            figure.savefig(buffer, format=kind, metadata=metadata)
        made.append(buffer.getvalue())
    return made[0], made[1]


def put(contents: tuple[bytes, bytes], stem: Path | str) -> tuple[Path, Path]:
    """Write what was `rendered` as ``stem``.png and ``stem``.svg, each all at once.

    Raises:
        StoreError: the disk does not take a file.
    """
    stem = Path(stem)
    png, svg = (stem.with_name(f"{stem.name}.{kind}") for kind in ("png", "svg"))
    for content, place in zip(contents, (png, svg), strict=True):
        publish(content, place.with_name(f".{place.name}.part"), place)
    return png, svg


def arcs(poses: np.ndarray, step_rad: float = 0.05) -> np.ndarray:
    """Points (m, 2) on the path through ``poses`` (n, 3: x_m, y_m, heading_rad, not wrapped).

    A command holds both wheel speeds, so the robot drives an arc that turns by the change of heading. A turn of
    about a full circle or more leaves the arc undetermined by its chord, and the chord is drawn.
    """
    points = [poses[:1, :2]]
    for before, after in pairwise(poses):
        turn = after[2] - before[2]
        if not _SMALLEST_TURN_RAD < abs(turn) < _LARGEST_TURN_RAD:
            points.append(after[None, :2])
            continue
        turned = np.linspace(0, turn, int(abs(turn) / step_rad) + 2)[1:]
        # Chord from the start to where the robot has turned so far, relative to the whole chord.
        part = np.sin(turned / 2) / np.sin(turn / 2) * np.exp(0.5j * (turned - turn))
        ahead = part * complex(*(after[:2] - before[:2]))
        points.append(before[:2] + np.column_stack([ahead.real, ahead.imag]))
    return np.vstack(points)


def goal_reach(robot: Robot, task: Task) -> tuple[float, bool]:
    """How far a goal reaches from its middle, m, and whether it is a square (else a disc)."""
    return (task.region_m / 2, True) if task.region_m else (robot.radii_m[0], False)


def floor_poses(robot: Robot, poses: np.ndarray) -> np.ndarray:
    """x_m, y_m, heading_rad (n + 1, 3) of a robot's own poses, with the start before them."""
    return on_floor(robot, np.vstack([robot.start_pose(), poses]))


def draw_paths(
    ax: Axes,
    goals_m: np.ndarray,
    radius_m: float,
    world_poses: np.ndarray,
    snn_poses: np.ndarray,
    square: bool = False,
    repeats: Sequence[np.ndarray] = (),
) -> None:
    """Robot's path (solid) and the simulator's idea of it (dashed) among the goals, in cm.

    With `repeats`, paths of several drives, each is drawn thin, and the robot's path is their mean.

    Poses are (n, 3), x_m, y_m, heading_rad, first the start, then the end of each command (dots). A simulator that is
    far off runs out of the picture rather than shrink it. Among square goals commands are joined by straight lines.
    """
    draw_goals(ax, goals_m, radius_m, square)
    drawn = _chords if square else arcs
    for number, poses in enumerate(repeats):
        path, label = 100 * drawn(poses), "each drive" if number == 0 else "_each drive"
        ax.plot(path[:, 0], path[:, 1], label=label, color=OKABE_ITO[0], linewidth=0.7, alpha=0.6)
    for poses, label, color, line in (
        (world_poses, "robot, mean" if repeats else "robot", OKABE_ITO[0], "-"),
        (snn_poses, "simulator", OKABE_ITO[1], "--"),
    ):
        path = 100 * drawn(poses)
        ax.plot(path[:, 0], path[:, 1], label=label, color=color, linestyle=line)
        ax.plot(100 * poses[1:, 0], 100 * poses[1:, 1], "o", color=color, markersize=2.2)
    x, y, heading = world_poses[0]
    ax.plot(
        100 * x,
        100 * y,
        marker=(3, 0, np.degrees(heading) - 90),
        color="black",
        markersize=8,
        linestyle="none",
        label="start",
    )
    _frame(ax, goals_m, radius_m, np.vstack([drawn(poses) for poses in (world_poses, *repeats)]))


def _chords(poses: np.ndarray) -> np.ndarray:
    return poses[:, :2]


def draw_goals(ax: Axes, goals_m: np.ndarray, radius_m: float, square: bool = False) -> None:
    """Goals (n, 2) as discs (or squares) of the reach that counts, numbered in order; one visited twice carries both numbers."""
    places, first = np.unique(goals_m, axis=0, return_index=True)
    centre = places.mean(axis=0)
    for place in goals_m[np.sort(first)]:
        numbers = ", ".join(str(i + 1) for i in np.flatnonzero((goals_m == place).all(axis=1)))
        ax.add_patch(_goal(100 * place, 100 * radius_m, square))
        # Outside the disc, where a path that reaches the goal does not end: away from the middle, or to the right.
        outward = place - centre
        length = np.linalg.norm(outward)
        central = length <= radius_m
        outward = np.array([1.0, 0.0]) if central else outward / length
        x, y = 100 * (place + outward * (radius_m + (0.01 if central else 0.045)))
        ax.text(
            x,
            y,
            numbers,
            ha="left" if central else "center",
            va="center",
            zorder=5,
            fontweight="bold",
            path_effects=[withStroke(linewidth=2, foreground="white")],
        )


def _goal(place: np.ndarray, reach: float, square: bool) -> Circle | Rectangle:
    look: dict[str, Any] = {"facecolor": "#c8c8c8", "edgecolor": "#777777", "zorder": 1}
    if square:
        return Rectangle((place[0] - reach, place[1] - reach), 2 * reach, 2 * reach, **look)
    return Circle((place[0], place[1]), reach, **look)


def _frame(ax: Axes, goals_m: np.ndarray, radius_m: float, path: np.ndarray) -> None:
    low, high = goals_m.min(axis=0) - radius_m, goals_m.max(axis=0) + radius_m
    seen = np.clip(path[np.isfinite(path).all(axis=1)], low - _REACH_M, high + _REACH_M)
    low = 100 * (np.vstack([seen, low[None]]).min(axis=0) - _MARGIN_M)
    high = 100 * (np.vstack([seen, high[None]]).max(axis=0) + _MARGIN_M)
    ax.set(
        xlim=(low[0], high[0]), ylim=(low[1], high[1]), aspect="equal", xlabel="x, east (cm)", ylabel="y, north (cm)"
    )
    _tick_alike(ax)


def frame_alike(axes: Sequence[Axes]) -> None:
    """Show the same floor in all panels of paths: as much as the largest of them."""
    for name in ("xlim", "ylim"):
        ends = np.array([getattr(ax, f"get_{name}")() for ax in axes])
        for ax in axes:
            ax.set(**{name: (ends[:, 0].min(), ends[:, 1].max())})
    for ax in axes:
        _tick_alike(ax)


def _tick_alike(ax: Axes) -> None:
    step = next((step for step in (20, 50, 100) if np.ptp(ax.get_xlim()) <= 5 * step), 200)
    for axis in (ax.xaxis, ax.yaxis):
        axis.set_major_locator(MultipleLocator(step))


@style()
def path_figure(spec: RunSpec, task: Task, robot: Robot, result: RunResult, stem: Path) -> Path:
    """Draw and save the path of a run's fittest controller at its end, a column wide; the path of the PNG."""
    figure = Figure(figsize=(COLUMN_IN, COLUMN_IN + 0.4))
    ax = figure.subplots()
    path_axes(ax, spec, task, robot, result)
    figure.legend(*ax.get_legend_handles_labels(), loc="outside lower center", ncols=3)
    return save(figure, stem)[0]


def path_axes(ax: Axes, spec: RunSpec, task: Task, robot: Robot, result: RunResult) -> None:
    """The same on axes that are there, without a legend."""
    driven, simulated = floor_poses(robot, result.world_poses), floor_poses(robot, result.snn_poses)
    reach_m, square = goal_reach(robot, task)
    draw_paths(ax, task.goals_m, reach_m, driven, simulated, square)
    success = bool(result.tables["evals"]["success"][-1])
    ax.set_title(f"{task.title}, seed {spec.seed}\nevaluation {spec.evaluations}: {outcome(success)}")


def outcome(success: bool) -> str:
    """What a path came to, in words for a title."""
    return "all goals" if success else "not all goals"


def lettered(number: int, count: int, title: str) -> str:
    """Title of panel ``number`` (from 0) of ``count``: with its letter, unless it is the only one."""
    return f"({chr(ord('a') + number)}) {title}" if count > 1 else title


def panels(
    count: int,
    height_in: float,
    columns: int = 3,
    rows_each: int = 1,
    ratios: Sequence[float] | None = None,
    *,
    wide: bool = False,
) -> tuple[Figure, np.ndarray]:
    """Figure with ``count`` panels (count, rows_each): a column wide if there is one and not ``wide``, else a page wide.

    ``rows_each`` axes stand above each other in a panel, of relative heights ``ratios``; ``height_in`` is the
    height of one row of panels. Rows are filled from the left; places that stay empty are blank.
    """
    across = min(count, 2 if count == 4 else columns)
    down = -(-count // across)
    figure = Figure(figsize=(COLUMN_IN if count == 1 and not wide else PAGE_IN, height_in * down))
    heights = list(ratios or [1] * rows_each) * down
    grid = figure.subplots(down * rows_each, across, squeeze=False, gridspec_kw={"height_ratios": heights})
    axes = np.array(
        [[grid[(i // across) * rows_each + row, i % across] for row in range(rows_each)] for i in range(down * across)]
    )
    for blank in axes[count:].ravel():
        blank.set_axis_off()
    return figure, axes[:count]
