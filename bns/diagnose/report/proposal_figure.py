"""The first trials of a proposed experiment, as each competing model predicts them."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Rectangle
from numpy.typing import NDArray

from bns.diagnose.data.tracks import Tracks
from bns.diagnose.design.planned import noise_free_predictor, planned_tracks
from bns.diagnose.design.proposal import Proposal
from bns.diagnose.design.repeats import Repeats
from bns.diagnose.estimate.stretch_noise import predicted_since_begin
from bns.diagnose.settings import DEFAULTS
from bns.errors import DataError
from bns.plotting.style import GREY, NARROW_IN, OKABE_ITO, PAGE_IN, lettered, panels, save, style

_FRAME_S = DEFAULTS.report.frame_s
_SHOWN = DEFAULTS.report.planned_trials
_LEGEND_CHARACTERS = DEFAULTS.report.legend_characters


@style()
def plan_figure(p: Proposal, path: Path, *, narrow: bool = False) -> Path:
    """One panel per trial: the start, the path that each explanation predicts, the arena unless paths are much smaller.

    ``narrow``: for a phone, the panels below each other.
    """
    if isinstance(p.plan, Repeats):
        return _repeats_figure(p, p.plan, path, narrow=narrow)
    shown = min(_SHOWN, len(p.plan))
    seen = foreseen(p, np.arange(shown))
    figure, axes = _panels(shown, narrow=narrow)
    for trial, (axis,) in enumerate(axes):
        _draw_trial(axis, p, seen, trial)
        axis.set_ylabel("y, north (cm)" if trial == 0 or narrow else "")
        axis.set_title(lettered(trial, shown, f"trial {trial}, {p.plan.lasting_s[trial]:.0f} s"))
    _legend_below(figure, axes[0][0])
    return save(figure, path)[0]


def _panels(shown: int, *, narrow: bool) -> tuple[Figure, NDArray[Any]]:
    """Side by side, or below each other."""
    figure, axes = panels(shown, 2.6, columns=1 if narrow else 3, wide=True)
    if narrow:
        figure.set_figwidth(NARROW_IN)
    return figure, axes


def _legend_below(figure: Figure, axes: Axes) -> None:
    """Explanations by name, in as many columns as the longest name leaves room for."""
    handles, names = axes.get_legend_handles_labels()
    room = _LEGEND_CHARACTERS * figure.get_figwidth() / PAGE_IN
    ncols = max(1, min(3, int(room / max(map(len, names)))))
    figure.legend(handles, names, loc="outside lower center", ncols=ncols)


def _repeats_figure(p: Proposal, plan: Repeats, path: Path, *, narrow: bool) -> Path:
    """One panel a repeated cycle: where each explanation says that it ends, from its begin."""
    shown = min(_SHOWN, len(plan))
    figure, axes = _panels(shown, narrow=narrow)
    for trial, (axis,) in enumerate(axes):
        _draw_repeat(axis, p, plan, trial)
        axis.set_ylabel("to its left (cm)" if trial == 0 or narrow else "")
        axis.set_title(lettered(trial, shown, f"trial {trial}, {plan.lasting_s[trial]:.0f} s"))
    _legend_below(figure, axes[0][0])
    return save(figure, path)[0]


def _draw_repeat(axis: Axes, p: Proposal, plan: Repeats, trial: int) -> None:
    tracks, chosen = plan.tracks, plan.chosen[trial]
    frames = np.flatnonzero(tracks.stretch == chosen)
    for number, competitor in enumerate(p.competing_models):
        predictor = p.predictor
        assert predictor is not None
        assert predictor.luck is not None
        pose = 100 * predicted_since_begin(predictor.luck, tracks.pose, predictor.steps(competitor.fit.model))[frames, :2]
        color = OKABE_ITO[number % len(OKABE_ITO)]
        axis.plot(*pose.T, label=competitor.title, color=color, linestyle=("-", "--", "-.", ":")[number % 4])
        axis.plot(*pose[-1], "o", color=color)
    axis.plot(0, 0, "k^")
    axis.set(aspect="equal", xlabel="ahead (cm)")


def trial_axes(axis: Axes, p: Proposal, trial: int) -> None:
    """One trial of the plan on axes that are there."""
    if isinstance(p.plan, Repeats):
        _draw_repeat(axis, p, p.plan, trial)
        axis.set_ylabel("to its left (cm)")
        axis.set_title(f"trial {trial}, {p.plan.lasting_s[trial]:.0f} s")
        axis.legend()
        return
    _draw_trial(axis, p, foreseen(p, np.array([trial])), 0)
    axis.set_title(f"trial {trial}, {p.plan.lasting_s[trial]:.0f} s")
    axis.legend()


def foreseen(p: Proposal, trials: NDArray[np.int64]) -> list[Tracks]:
    """What each explanation says of these trials (numbers from 0): tracks with a frame every so many milliseconds."""
    plan = p.plan.only(trials)
    if p.arena is None or isinstance(plan, Repeats):
        raise DataError("Paths of repeated cycles have no place in an arena; the report draws each from its own begin.")
    tracks = planned_tracks(plan, p.arena.start, _FRAME_S, np.zeros(len(plan)))
    return [noise_free_predictor(competitor.fit.model, tracks).tracks for competitor in p.competing_models]


def _draw_trial(axis: Axes, p: Proposal, seen: list[Tracks], trial: int) -> None:
    a = p.arena
    assert a is not None
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
    _zoom(axis, 100 * np.concatenate([t.pose[t.first[trial] : t.first[trial + 1], :2] for t in seen]), max(size))


def _zoom(axis: Axes, places: NDArray[np.float64], arena: float) -> None:
    """A square around short paths, which would be a dot in a large arena."""
    low, high = places.min(axis=0), places.max(axis=0)
    half = 0.7 * float((high - low).max())
    if 0.0 < 2.0 * half < 0.6 * arena:
        middle = (low + high) / 2.0
        axis.set(xlim=(middle[0] - half, middle[0] + half), ylim=(middle[1] - half, middle[1] + half))
