"""Is the model one of this robot? A model of another one would be blamed on effects."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from bns.diagnose.data.speed_units import Ways
from bns.diagnose.data.tracks import Array, Tracks
from bns.diagnose.data.units import unit_by_ratio
from bns.diagnose.predict.base import Predictor
from bns.diagnose.predict.horizons import windows
from bns.diagnose.predict.wheels import WheelPredictor
from bns.diagnose.settings import DEFAULTS
from bns.errors import DataError, in_both
from bns.physics.model import LIMITS, Model
from bns.robots import robot_names

_FACTOR = DEFAULTS.predict.robot_factor
_HINT = DEFAULTS.predict.robot_hint
_HINT_EXPLAINED = DEFAULTS.predict.robot_hint_explained
_EXPLAINED = DEFAULTS.predict.robot_explained
_FEWEST = DEFAULTS.predict.robot_fewest
_CLEAR_M = DEFAULTS.predict.robot_clear_m
_ARC_RAD = DEFAULTS.predict.robot_arc_rad
_TOGETHER = DEFAULTS.predict.robot_together
_TURNED_RAD = DEFAULTS.predict.robot_turned_rad
_AS_FAR = DEFAULTS.predict.robot_as_far
_LATE_S, _LATE_ROUNDS = DEFAULTS.predict.robot_late


def check_named_robot(robot: str, model: Model) -> None:
    """DataError if the data name another robot than the one the model is of."""
    name = model.name.removesuffix("-world")
    if robot and robot != name and {robot, name} <= set(robot_names()):
        raise DataError(
            f"The measurements are of the robot {robot}, but the model {model.name} is of {name}; give a model of {robot}."
        )


def check_same_robot(predictor: Predictor, model: Model) -> None:
    """DataError if ways or turns are so far off that the data must be another robot's, or in other units."""
    tracks = predictor.tracks
    start, end = windows(tracks, "1s")
    if len(start) < _FEWEST:
        return
    steps = predictor.steps(model).body
    predicted = _turn_predicted(steps, start, end)
    _check_distances(tracks, steps, predicted, start, end)  # first: another unit of speeds alters the turns as well
    ratio = _turn_ratio(tracks, predicted, start, end, _EXPLAINED)
    if not 1 / _FACTOR <= ratio <= _FACTOR:
        _check_speeds(tracks, steps, start, end, ratio)
        raise DataError(_on_turns(tracks, model, ratio, "Is this its model?"))
    arcs = np.abs(predicted) < _ARC_RAD
    _check_directions(tracks, start[arcs], end[arcs], np.cumsum(steps[:, 0]))


def _check_distances(
    tracks: Tracks, steps: Array, predicted: Array, start: NDArray[np.int64], end: NDArray[np.int64]
) -> None:
    """DataError if the robot goes much further than its model does, or less far, where both drive nearly straight ahead."""
    way = np.concatenate([[0.0], np.cumsum(np.hypot(steps[:, 0], steps[:, 1]))])[1:]
    straight = (np.abs(predicted) < 0.3) & (np.abs(_turn_seen(tracks, start, end)) < 0.3) & (way[end] - way[start] > 0.02)
    if straight.sum() >= _FEWEST:
        went = np.hypot(*(tracks.pose[end, :2] - tracks.pose[start, :2]).T)[straight]
        ratio = float(np.median(went / (way[end] - way[start])[straight]))
        if ratio < 0.03:
            raise DataError(
                "The robot hardly moves although it is commanded to: is it tracked, are its motors on, are these its commands?"
            )
        if ratio > 3 or ratio < 1 / 3:
            raise DataError(
                f"The robot goes {ratio:.2g} times as far as commanded. "
                + (
                    unit_by_ratio(ratio)
                    or "Are the speeds in m/s, the positions in m, the times in s? `bns import` turns other units into these."
                )
            )


def _check_speeds(tracks: Tracks, steps: Array, start: NDArray[np.int64], end: NDArray[np.int64], turns: float) -> None:
    """DataError if the robot goes as many times as far as its model as it turns: a unit of speeds does that, no wheelbase.

    ``steps`` (frames, 3): of the model; ``turns``: how many times as far it turns.
    """
    forward, way = np.cumsum(steps[:, 0]), np.cumsum(np.hypot(steps[:, 0], steps[:, 1]))
    heading = _unwrapped(tracks)
    went = np.hypot(*(tracks.pose[end, :2] - tracks.pose[start, :2]).T)
    trial = np.asarray(tracks.trial[start], dtype=np.int64)
    ways = Ways(forward[end] - forward[start], way[end] - way[start], went, heading[end] - heading[start], trial)
    if 1 / _AS_FAR < ways.ratio / turns < _AS_FAR:
        unit = unit_by_ratio(ways.ratio) or "Are the speeds in m/s, the positions in m, the times in s?"
        raise DataError(f"The robot goes and turns {ways.ratio:.2g} times as far as commanded. {unit}")


def hint_on_wheelbase(predictor: Predictor, model: Model) -> str:
    """What to say of a wheelbase that is probably too large, if not so much that the data must be another robot's; else "".

    A robot that turns less than its model predicts may as well have motors that lag, or slip.
    """
    start, end = windows(predictor.tracks, "1s")
    if len(start) < _FEWEST:
        return ""
    predicted = _turn_predicted(predictor.steps(model).body, start, end)
    ratio = _turn_ratio(predictor.tracks, predicted, start, end, _HINT_EXPLAINED)
    return _on_turns(predictor.tracks, model, ratio, "Is the wheelbase right?") if ratio > _HINT else ""


def _on_turns(tracks: Tracks, model: Model, ratio: float, question: str) -> str:
    """``ratio``: how many times as far as predicted it turns in a second, which a lag alters."""
    fits = suggested_wheelbase_m(tracks)
    ratio = ratio if fits is None else model.wheelbase_m / fits
    low, high = LIMITS["wheelbase_m"]
    said = f"The robot turns {ratio:.2g} times as far as a model with a wheelbase of {model.wheelbase_m:g} m predicts."
    if fits is None:
        return (
            f"{said} No wheelbase from {low:g} to {high:g} m would fit: is heading_rad the measured heading of the robot, in "
            "radians, and are the speeds in m/s?"
        )
    given = in_both(f"--wheelbase {fits:.4g}", f"bns.Model(NAME, wheelbase_m={fits:.4g})")
    return f"{said} {question} A wheelbase of about {fits:.4g} m would fit: {given}."


def _turn_predicted(steps: Array, start: NDArray[np.int64], end: NDArray[np.int64]) -> Array:
    """Turn of windows (windows,), rad, from the steps of a model (frames, 3)."""
    turn = np.concatenate([[0.0], np.cumsum(steps[:, 2])])[1:]
    return turn[end] - turn[start]


def _turn_seen(tracks: Tracks, start: NDArray[np.int64], end: NDArray[np.int64]) -> Array:
    """Turn of windows (windows,), rad, the short way round."""
    turned: Array = (tracks.pose[end, 2] - tracks.pose[start, 2] + np.pi) % (2 * np.pi) - np.pi
    return turned


def _turn_ratio(
    tracks: Tracks, predicted: Array, start: NDArray[np.int64], end: NDArray[np.int64], explained: float
) -> float:
    """How many times as far as predicted the robot turns; 1 where no factor leaves less than this share of the deviation."""
    # where the model says that the turn is small enough, it can be told from one more round
    clear = (np.abs(predicted) < _ARC_RAD) & (np.abs(predicted) > 0.05)
    seen = _turn_seen(tracks, start, end)
    if clear.sum() < _FEWEST:
        return 1.0
    ratio = _scale(seen[clear], predicted[clear])
    # motors that follow late also turn by another share in a second, but no one factor makes the model right
    left = np.abs(seen - ratio * predicted)[clear].sum() / max(float(np.abs(seen - predicted)[clear].sum()), 1e-12)
    return ratio if left < explained else 1.0


def _check_directions(tracks: Tracks, start: NDArray[np.int64], end: NDArray[np.int64], forward_m: Array) -> None:
    """DataError if the robot goes another way than it faces, by a right angle or mirrored: along an arc, than it faces halfway.

    ``forward_m`` (frames,): how far it was driven forwards; windows that hardly were say nothing about directions.
    """
    driven = forward_m[end] - forward_m[start]
    clear = np.abs(driven) > _CLEAR_M
    if clear.sum() < _FEWEST:
        return
    start, end, driven = start[clear], end[clear], driven[clear]
    went = (tracks.pose[end, :2] - tracks.pose[start, :2]) * np.sign(driven)[:, None]
    way = np.exp(1j * np.arctan2(went[:, 1], went[:, 0]))
    turned = _turn_seen(tracks, start, end)
    faces = np.exp(1j * (tracks.pose[start, 2] + turned / 2))
    beside, mirrored = complex((way / faces).mean()), complex((way * faces).mean())
    if abs(beside) > _TOGETHER and abs(np.angle(beside)) > _TURNED_RAD:
        degrees = np.degrees(np.angle(beside))
        square = 90 * round(degrees / 90)
        right = f"zero_deg: {square if abs(degrees - square) < 20 else round(degrees)}"
        raise DataError(
            f"Driving ahead the robot goes {abs(degrees):.0f}° to the {'left' if degrees > 0 else 'right'} of where "
            "heading_rad points: positions and headings are in different frames, or the speeds have the other sign. "
            f"`{right}` in the entry heading_rad of the mapping of `bns import` turns the headings."
        )
    if abs(mirrored) > _TOGETHER and abs(beside) < 0.5:
        raise DataError(f"{_MIRRORED} {_unmirrored(float(np.degrees(np.angle(mirrored))))}")


_MIRRORED = "Positions are mirrored against headings: x_m must run east, y_m north, heading_rad counter-clockwise from x."


def _unmirrored(degrees: float) -> str:
    """What is mirrored, and what to do: ``degrees`` is the direction of travel as seen, and the heading, together.

    With y the wrong way a heading of a is seen as -a, with x the wrong way as 180 - a, and with both exchanged as 90 - a.
    """
    near = round(degrees / 90) % 4 if abs(degrees - 90 * round(degrees / 90)) < 20 else None
    if near == 0:
        return "y_m runs the wrong way: give its entry in the mapping of `bns import` `scale: -1`."
    if near == 2:
        return "x_m runs the wrong way: give its entry in the mapping of `bns import` `scale: -1`."
    if near == 1:
        return "x_m and y_m are exchanged: exchange their columns in the mapping of `bns import`."
    if near == 3:
        return "x_m and y_m are exchanged, and run the wrong way: exchange their columns, and give both `scale: -1`."
    return "`scale: -1` in the entry y_m (or x_m) of the mapping of `bns import` turns one of them round."


def suggested_wheelbase_m(tracks: Tracks) -> float | None:
    """The wheelbase (m) with which a plain drive turns as these tracks do.

    None where they tell nothing, or a distance that no model may have. Turns of more than half a round between two poses would
    mislead it.
    """
    start, end = windows(tracks, "1s")
    told = np.cumsum(WheelPredictor(tracks).steps(Model(wheelbase_m=1.0)).body[:, 2])
    if (np.abs(told[end] - told[start]) > _CLEAR_M).sum() < _FEWEST:
        return None
    heading = _unwrapped(tracks)
    ratio = _in_the_end(
        np.stack([_earlier(tracks, told, end, by_s) - _earlier(tracks, told, start, by_s) for by_s in _LATE_S], axis=1),
        heading[end] - heading[start],
    )
    low, high = LIMITS["wheelbase_m"]
    return float(1 / ratio) if ratio > 0 and low <= 1 / ratio <= high else None


def _in_the_end(told: Array, seen: Array) -> float:
    """How many times as far as told the robot turns, sooner or later: least absolute deviations of seen = told @ shares.

    ``told`` (windows, times): in the second in which it turned ``seen``, and in earlier ones. Motors that lag, and commands that
    come late, turn a share of each; the shares add up.
    """
    counts = np.ones(len(seen))
    for _ in range(_LATE_ROUNDS):
        shares = np.linalg.lstsq(told * counts[:, None], seen * counts, rcond=None)[0]
        off = np.abs(seen - told @ shares)
        counts = 1.0 / np.sqrt(np.maximum(off, max(float(np.median(off)), 1e-9)))
    return float(shares.sum())


def _earlier(tracks: Tracks, told: Array, frames: NDArray[np.int64], by_s: float) -> Array:
    """What sums ``told`` (frames,) were so long before these frames of the same trial, or at its beginning."""
    out = np.empty(len(frames))
    for trial in np.unique(tracks.trial[frames]):
        own, piece = tracks.trial[frames] == trial, slice(tracks.first[trial], tracks.first[trial + 1])
        out[own] = np.interp(tracks.t_s[frames[own]] - by_s, tracks.t_s[piece], told[piece])
    return out


def _unwrapped(tracks: Tracks) -> Array:
    """Headings (frames,), rad, of each trial without jumps by a round."""
    headings: Array = np.concatenate([np.unwrap(tracks.pose[a:b, 2]) for a, b in pairwise(tracks.first)])
    return headings


def _scale(seen: Array, predicted: Array) -> float:
    """Least absolute deviations of seen = scale * predicted: the median of the ratios, weighted by what was predicted."""
    ratios, weights = seen / predicted, np.abs(predicted)
    order = np.argsort(ratios)
    return float(ratios[order][np.searchsorted(np.cumsum(weights[order]), weights.sum() / 2)])
