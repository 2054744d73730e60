"""The first trials of a proposed experiment, as each competing model predicts them."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.patches import Rectangle
from numpy.typing import NDArray

from bns.diagnose.data.tracks import Tracks
from bns.diagnose.design.planned import noise_free_predictor, planned_tracks
from bns.diagnose.design.proposal import Proposal
from bns.diagnose.settings import DEFAULTS
from bns.plotting.style import GREY, OKABE_ITO, lettered, panels, save, style

_FRAME_S = DEFAULTS.report.frame_s
_SHOWN = DEFAULTS.report.planned_trials


@style()
def plan_figure(p: Proposal, path: Path) -> Path:
    """One panel a trial: the arena, the start, and where each explanation says that the robot goes."""
    shown = min(_SHOWN, len(p.plan))
    seen = foreseen(p, np.arange(shown))
    figure, axes = panels(shown, 2.6, wide=True)
    for trial, (axis,) in enumerate(axes):
        _draw_trial(axis, p, seen, trial)
        axis.set_ylabel("y, north (cm)" if trial == 0 else "")
        axis.set_title(lettered(trial, shown, f"trial {trial}, {p.plan.lasting_s[trial]:.0f} s"))
    figure.legend(*axes[0][0].get_legend_handles_labels(), loc="outside lower center", ncols=3)
    return save(figure, path)[0]


def trial_axes(axis: Axes, p: Proposal, trial: int) -> None:
    """One trial of the plan on axes that are there."""
    _draw_trial(axis, p, foreseen(p, np.array([trial])), 0)
    axis.set_title(f"trial {trial}, {p.plan.lasting_s[trial]:.0f} s")
    axis.legend()


def foreseen(p: Proposal, trials: NDArray[np.int64]) -> list[Tracks]:
    """What each explanation says of these trials (numbers from 0): tracks with a frame every so many milliseconds."""
    plan = p.plan.only(trials)
    tracks = planned_tracks(plan, p.arena.start, _FRAME_S, np.zeros(len(plan)))
    return [noise_free_predictor(competitor.fit.model, tracks).tracks for competitor in p.competing_models]


def _draw_trial(axis: Axes, p: Proposal, seen: list[Tracks], trial: int) -> None:
    a = p.arena
    size = (100 * (a.x_high_m - a.x_low_m), 100 * (a.y_high_m - a.y_low_m))
    axis.add_patch(Rectangle((100 * a.x_low_m, 100 * a.y_low_m), *size, fill=False, edgecolor=GREY, linestyle=":"))
    for number, (competitor, each) in enumerate(zip(p.competing_models, seen, strict=True)):
        pose = 100 * each.pose[each.first[trial] : each.first[trial + 1], :2]
        look: dict[str, Any] = {
            "color": OKABE_ITO[number % len(OKABE_ITO)],
            "linestyle": ("-", "--", "-.", ":")[number % 4],
        }
        axis.plot(*pose.T, label=competitor.title, **look)
        axis.plot(*pose[-1], "o", color=look["color"])
    axis.plot(100 * a.start[0], 100 * a.start[1], "k^")
    axis.set(aspect="equal", xlabel="x, east (cm)", ylabel="y, north (cm)")
