"""Figures 5.7 to 5.10: displacements that a static simulator predicts against measured ones, and its stability table."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
import pandas as pd
from matplotlib.axes import Axes

from analysis.figure_result import FigureResult
from analysis.intervals import wilson
from analysis.results import NoDataError, Results
from bns.errors import ModelError
from bns.plotting.style import BLUE, GREY, RED, lettered, note, panels, style
from bns.robots import load_robot, robot_names

if TYPE_CHECKING:
    from bns.robots.simulator import StaticSimulator

NAME = "simulator-accuracy"
PAPER = "figures 5.7 to 5.10"
STABLE = "stable"
SOURCE = {"dx_yellow": (0.84, 0.85), "dy_yellow": (0.17, 0.28), "dx_green": (0.75, 0.90), "dy_green": (0.05, 0.25)}
"""R² and slope of the dissertation's regression lines (section 5.5.1)."""
BRACKETS = "In brackets: the dissertation's R² and slope."
SOURCE_STABILITY = {"stable": 0.94, "unstable": 0.58}
"""Shares of stable and unstable verification cycles that the dissertation's network got right."""


def draw(store: Results) -> list[FigureResult]:
    ran = store.query("SELECT DISTINCT robot FROM runs WHERE status = 'ok' ORDER BY 1").robot
    found = [one for one in map(_shipped, sorted(set(ran) & set(robot_names()))) if "verification" in one.provenance]
    if not found:
        raise NoDataError(
            "no robot with finished runs has a static simulator that holds its verification patterns; "
            "run bns sweep snake, or: bns run --robot snake"
        )
    return [_draw(simulator) for simulator in found]


def _shipped(robot: str) -> StaticSimulator:
    from bns.robots.simulator import load_static_simulator  # noqa: PLC0415  # brings the compiler, for which no other figure waits

    try:
        return load_static_simulator(robot)
    except ModelError as missing:
        raise NoDataError(str(missing)) from missing


@style()
def _draw(simulator: StaticSimulator) -> FigureResult:
    robot, about = load_robot(simulator.provenance["robot"]), simulator.provenance
    measured, predicted = (np.array(about["verification"][kind]) for kind in ("measured", "predicted"))
    learnable = robot.learnable(measured)
    names = [name for name in simulator.networks if name != STABLE]
    figure, axes = panels(len(names), 3.3)
    for number, (name, ax) in enumerate(zip(names, axes[:, 0], strict=True)):
        shown = learnable[number]
        _scatter(ax, 100 * measured[shown, number], 100 * predicted[shown, number])
        ax.set_title(lettered(number, len(names), _title(name, about["accuracy"][name])))
    figure.legend(*axes[0, 0].get_legend_handles_labels(), loc="outside upper center", ncols=3)
    rows = pd.DataFrame([_row(name, about["accuracy"][name]) for name in names])
    table = pd.concat([rows, _stability(simulator.networks, measured, predicted)], ignore_index=True)
    n = int(learnable[0].sum())
    took = f"{n} stable cycles of {len(measured)} that took no part in training; each point one cycle."
    note(figure, f"{took} {BRACKETS} {_said(table)}")
    shows = (
        f"Displacement in a cycle as the static simulator of the {robot.name} predicts it, against that in the physics "
        f"world, for n = {n} stable verification cycles. Dashed: prediction is right; solid: regression of predicted on "
        f"measured. Its R² and slope are above each panel, the dissertation's in brackets."
    )
    see = "The dissertation predicted x well (R² 0.84 and 0.75) and y hardly at all (0.17 and 0.05)."
    columns = [f"{kind}_{net}" for kind in ("measured", "predicted") for net in simulator.networks]
    data, title = pd.DataFrame(np.hstack([measured, predicted]), columns=columns), f"Static simulator of the {robot.name}"
    return FigureResult(f"{NAME}-{robot.name}", title, figure, shows, 1, (), see=see, data=data, table=table)


def _scatter(ax: Axes, measured: np.ndarray, predicted: np.ndarray) -> None:
    ends = np.array([min(measured.min(), predicted.min()), max(measured.max(), predicted.max())])
    slope, intercept = np.polyfit(measured, predicted, 1)
    ax.plot(ends, ends, "--", color=GREY, linewidth=1, label="predicted = measured")
    ax.plot(measured, predicted, "o", color=BLUE, markersize=2.5, label="a verification cycle")
    ax.plot(ends, slope * ends + intercept, "-", color=RED, label="regression")
    ax.set(xlabel="measured displacement (cm)", ylabel="predicted displacement (cm)")


def _title(name: str, got: dict[str, float]) -> str:
    axis, marker = name.split("_")
    r2, slope = SOURCE.get(name, (np.nan, np.nan))
    return (
        f"{marker} marker, Δ{axis[1:]}\nR² {got['regression_r2']:.2f} ({r2:.2f}), slope {got['slope']:.2f} ({slope:.2f})"
    )


def _row(name: str, got: dict[str, float]) -> dict[str, Any]:
    r2, slope = SOURCE.get(name, (np.nan, np.nan))
    return {
        "network": name,
        "R² of the regression": round(got["regression_r2"], 2),
        "in the dissertation": r2,
        "slope": round(got["slope"], 2),
        "slope in the dissertation": slope,
        "RMSE, cm": round(100 * got["rmse"], 1),
    }


def _stability(networks: tuple[str, ...], measured: np.ndarray, predicted: np.ndarray) -> pd.DataFrame:
    """What became of stable and of unstable cycles, with the dissertation's shares."""
    net, rows = networks.index(STABLE), []
    for kind, truth in (("stable", measured[:, net] >= 0.5), ("unstable", measured[:, net] < 0.5)):
        right = (predicted[truth, net] >= 0.5) == (kind == "stable")
        low, high = wilson(int(right.sum()), max(len(right), 1))
        rows.append(
            {
                "network": f"{kind} cycles",
                "called stable": int((predicted[truth, net] >= 0.5).sum()),
                "called unstable": int((predicted[truth, net] < 0.5).sum()),
                "right": f"{right.mean():.0%} ({low:.0%} to {high:.0%})" if len(right) else "none",
                "right in the dissertation": f"{SOURCE_STABILITY[kind]:.0%}",
            }
        )
    return pd.DataFrame(rows)


def _said(table: pd.DataFrame) -> str:
    kinds = table.dropna(subset=["right"])
    return "Stability called right: " + "; ".join(
        f"{row['network']} {row['right']}, in the dissertation {row['right in the dissertation']}" for _, row in kinds.iterrows()
    ) + "."
