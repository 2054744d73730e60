"""A model compared with measurements, nothing fitted: how far it is off, and where."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from bns.diagnose.data.tracks import Array
from bns.diagnose.estimate.clocks.trial_clock_test import steps_of
from bns.diagnose.estimate.fit import Fit
from bns.diagnose.estimate.problem import problem_for
from bns.diagnose.parallel import one_thread_each
from bns.diagnose.predict.base import Predictor, Steps
from bns.diagnose.predict.check_robot import hint_on_wheelbase
from bns.diagnose.predict.horizons import Errors
from bns.diagnose.predict.paired_errors import PairedErrors, PairedWindows, judged_windows, noise_json, plain
from bns.diagnose.predict.wheels import WheelPredictor
from bns.diagnose.residuals.along_variables import ResidualDependence, residual_dependence
from bns.diagnose.settings import DEFAULTS
from bns.errors import DataError
from bns.physics.model import Model

BINS = DEFAULTS.verdict.bins


@dataclass(frozen=True)
class Moment:
    """A window that was predicted badly: when it began, and how far off its end was."""

    trial: str
    t_s: float
    position_m: float
    heading_rad: float


@dataclass(frozen=True)
class Curve:
    """Mean error a second along one variable: centres (bins,), mean and 95 % band (bins,), for one direction."""

    variable: str
    direction: str
    centre: Array
    mean: Array
    low: Array
    high: Array


@dataclass(frozen=True)
class Comparison:
    """What `compare` found.

    ``errors``: over the windows that are judged, by direction; ``judged``: the same as every other command shows them; ``near``:
    the horizon of the worst moments and the curves; ``scores``: how well each network agrees, where the model is networks.
    """

    model: str
    trials: int
    frames: int
    errors: Mapping[str, Mapping[str, float]]
    judged: PairedErrors
    residual_dependence: tuple[ResidualDependence, ...]
    worst: tuple[Moment, ...]
    curves: tuple[Curve, ...]
    near: str
    scores: Mapping[str, Mapping[str, float]]
    hint: str = ""
    """A question about the wheelbase, where one factor on all turns would make most of the error go."""
    beside: tuple[PairedErrors, ...] = ()
    """Of each further model: this one and that one, on the windows that ``judged`` has, and the change from this to that."""

    def as_json(self) -> dict[str, Any]:
        """One object of plain values."""
        return {
            "model": self.model,
            "trials": self.trials,
            "frames": self.frames,
            "error": {h: {k: _plain(v) for k, v in e.items()} | self._judged_json(h) for h, e in self.errors.items()},
            "tracking_noise": noise_json(self.judged),
            "residual_dependence": [
                {
                    "variable": p.variable,
                    "velocity": p.channel,
                    "share": p.share,
                    "p_value": p.paired_comparison.p_value,
                }
                for p in self.residual_dependence
            ],
            "worst": [vars(w) for w in self.worst],
            "hint": self.hint,
            "beside": [errors.as_json() for errors in self.beside],
            "networks": {name: dict(score) for name, score in self.scores.items()},
        }

    def _judged_json(self, horizon: str) -> dict[str, Any]:
        e = self.judged.horizons[horizon]
        return {"noise_floor_m": plain(e.noise_floor_m), "windows_left_out": e.left_out}

    def noise_floor_m(self, horizon: str) -> float:
        """Position error of tracking noise alone; NaN where the tracks cannot tell."""
        return self.judged.horizons[horizon].noise_floor_m


def _plain(value: float) -> float | None:
    return value if isinstance(value, int) else plain(value)  # a count stays one


@one_thread_each()
def compare(
    predictor: Predictor,
    model: Model,
    seed: int = 0,
    tick: Callable[[str], None] = lambda _: None,
    beside: Sequence[tuple[str, Model, Predictor | None]] = (),
) -> Comparison:
    """Hold a model as it is against tracks. ``seed`` draws the bootstrap of the bands; ``tick`` is told what is being done.

    ``beside``: further models under their names, as they are, whose errors are paired with this one's; each with a predictor of
    its own where it is of another body, over the same frames, or None.
    """
    tracks = predictor.tracks
    if not (np.diff(tracks.first) > 1).any():
        raise DataError(
            "No trial has two tracked poses, and a displacement needs two: log the pose before and after commands."
        )
    tick("noise")
    problem = problem_for(predictor, model)
    tick("errors")
    fit = _as_is(problem, model)
    steps = steps_of(predictor, problem.pose_filter, fit.model)
    windows = PairedWindows(predictor)
    judged = windows.errors([(model.name, steps)])
    others = [(name, _predicted(own or predictor, other)) for name, other, own in beside]
    errors = {h: judged_windows(predictor, steps, h) for h in predictor.horizons}
    tick("what explains them")
    dependence = residual_dependence(problem, fit)
    tick("curves")
    return Comparison(
        model.name,
        len(tracks),
        len(tracks.t_s),
        {h: e.summary(len(tracks)) for h, e in errors.items()},
        judged,
        tuple(dependence),
        tuple(_worst(predictor, errors[predictor.near])),
        tuple(_curves(predictor, errors[predictor.near], dependence, np.random.default_rng(seed))),
        predictor.near,
        predictor.scores(),
        hint_on_wheelbase(predictor, model) if isinstance(predictor, WheelPredictor) else "",
        tuple(windows.errors([(model.name, steps), other]) for other in others),
    )


def _predicted(predictor: Predictor, model: Model) -> Steps:
    """What a model predicts as it stands, in the way of the model that is compared."""
    problem = problem_for(predictor, model)
    return steps_of(predictor, problem.pose_filter, _as_is(problem, model).model)


def _as_is(problem: Any, model: Model) -> Fit:
    """The model with its numbers as they stand."""
    fit: Fit = problem.fit(model, rounds=0)
    return fit


def _worst(predictor: Predictor, errors: Errors, most: int = 5) -> list[Moment]:
    """The worst window of each of the worst trials."""
    tracks, out = predictor.tracks, []
    order = np.argsort(-errors.position_m)
    listed: set[int] = set()
    for i in order:
        trial = int(errors.trial[i])
        if trial not in listed:
            listed.add(trial)
            out.append(
                Moment(
                    tracks.names[trial],
                    float(tracks.own_s[errors.start[i]]),
                    float(errors.position_m[i]),
                    float(errors.heading_rad[i]),
                )
            )
        if len(out) == most:
            break
    return out


def _curves(
    predictor: Predictor, errors: Errors, dependence: list[ResidualDependence], rng: np.random.Generator
) -> list[Curve]:
    """Residuals along the variables that explain most, and bands from a bootstrap over trials; none of trials too short."""
    if not len(errors.start):
        return []
    at = predictor.at_frames(errors.start)
    names = [
        name for name in dict.fromkeys(p.variable for p in dependence if p.variable in at) if np.ptp(at[name]) > 0
    ][:6]
    lasted = np.maximum(predictor.tracks.t_s[errors.end] - predictor.tracks.t_s[errors.start], 1e-9)
    rates = {
        "forward, mm/s": 1e3 * errors.forward_m / lasted,
        "left, mm/s": 1e3 * errors.left_m / lasted,
        "heading, deg/s": np.degrees(errors.heading_rad) / lasted,
    }
    return [_binned(name, way, at[name], rate, errors.trial, rng) for name in names for way, rate in rates.items()]


def _edges(values: Array) -> Array:
    """Of bins of as many values each; where values nearly repeat, neighbours that are both far narrower than usual are joined."""
    edges = np.unique(np.quantile(values, np.linspace(0, 1, BINS + 1)))
    narrow = np.diff(edges) < np.ptp(values) / BINS**2
    return edges[np.concatenate([[True], ~(narrow[:-1] & narrow[1:]), [True]])] if len(edges) > 2 else edges


def _binned(
    name: str, way: str, values: Array, rate: Array, trial: NDArray[np.int64], rng: np.random.Generator
) -> Curve:
    edges = _edges(values)
    place: NDArray[np.intp] = np.clip(np.searchsorted(edges, values, side="right") - 1, 0, max(len(edges) - 2, 0))
    bins, trials = max(len(edges) - 1, 1), int(trial.max()) + 1
    sums, counts = np.zeros((trials, bins)), np.zeros((trials, bins))
    np.add.at(sums, (trial, place), rate)
    np.add.at(counts, (trial, place), 1)
    filled = counts.sum(axis=0) > 0
    sums, counts = sums[:, filled], counts[:, filled]
    drawn = rng.multinomial(trials, np.full(trials, 1 / trials), size=400)
    with np.errstate(invalid="ignore", divide="ignore"):
        means = (drawn @ sums) / (drawn @ counts)
        mean = sums.sum(axis=0) / counts.sum(axis=0)
    low, high = np.nanquantile(means, [0.025, 0.975], axis=0)
    centre = np.array([values[place == b].mean() if (place == b).any() else np.nan for b in np.flatnonzero(filled)])
    return Curve(name, way, centre, mean, low, high)
