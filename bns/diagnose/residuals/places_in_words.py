"""What a term says of when and where the robot is, in words: times, headings and places."""

from __future__ import annotations

import numpy as np

from bns.diagnose.data.tracks import Array
from bns.diagnose.predict.base import Predictor
from bns.diagnose.residuals.grammar import PULL
from bns.diagnose.residuals.phrases import POINTS, VELOCITIES, curve_of, seconds, slower
from bns.diagnose.residuals.symbolic import Formula
from bns.diagnose.settings import DEFAULTS
from bns.physics.figures import figures
from bns.physics.formula import LEFT, RIGHT, SHARE, value_of

_ENDS = DEFAULTS.report.surface_ends


def _along(term: Formula, name: str, grid: Array, what: str) -> str:
    """A share of all velocities along a signal, where it is lowest and highest."""
    share = curve_of(term, name, grid)
    low, high = int(share.argmin()), int(share.argmax())
    most, least = (low, high) if abs(share[low]) > abs(share[high]) else (high, low)
    if f"{abs(share[least]):.2%}" == f"{0.0:.2%}":  # there the effects say all
        return f"{slower(-share[most])} at {seconds(grid[most])} {what} than at {seconds(grid[least])}"
    return f"{slower(-share[low])} at {seconds(grid[low])} {what}, {slower(-share[high])} at {seconds(grid[high])}"


def time_in_trial(term: Formula, predictor: Predictor) -> str:
    """Where in a trial all velocities are lowest and highest."""
    longest = float(predictor.tracks.own_s.max())
    return _along(term, "tau", np.linspace(0, longest, POINTS), "of a trial")


def session(term: Formula, predictor: Predictor) -> str:
    """Where in the session a share is lowest and highest; where a wheel or turns differ most from its beginning."""
    t_s = predictor.tracks.session_s
    grid = np.linspace(float(t_s.min()), float(t_s.max()), POINTS)
    if term.on == SHARE:
        return _along(term, "t", grid, "of the session")
    share = curve_of(term, "t", grid, u=1.0, w=1.0)
    most = int(np.abs(share).argmax())
    whose = {LEFT: "the left wheel is", RIGHT: "the right wheel is"}.get(term.on, "the robot's turning is")
    return f"{whose} {slower(-share[most])} at {seconds(grid[most])} of the session than at its beginning"


def drift(term: Formula, predictor: Predictor) -> str:
    """Where in the session the robot turns most otherwise than at its beginning."""
    t_s = predictor.tracks.session_s
    grid = np.linspace(float(t_s.min()), float(t_s.max()), POINTS)
    change = np.degrees(curve_of(term, "t", grid, moving=1.0))
    most = int(np.abs(change).argmax())
    side = "left" if change[most] > 0.0 else "right"
    turns = f"the robot turns {figures(abs(change[most]))} °/s further to the {side}"
    return f"{turns} at {seconds(grid[most])} of the session than at its beginning, whenever it moves"


def share_by_heading(term: Formula, _: Predictor) -> str:
    """At which heading all velocities are lowest and highest."""
    grid = np.linspace(-np.pi, np.pi, POINTS)
    share = curve_of(term, "heading", grid)
    low, high = (int(i) for i in (share.argmin(), share.argmax()))
    at = [f"{slower(-share[i])} at a heading of {np.degrees(grid[i]):.0f}°" for i in (low, high)]
    return ", ".join(at)


def at_places(term: Formula, predictor: Predictor) -> str:
    """Of a share or a forward speed that depends on the place: where, of all places that were seen, it is least and largest."""
    pose = predictor.tracks.pose
    x, y = pose[:: max(len(pose) // (10 * POINTS), 1), :2].T
    share = np.broadcast_to(value_of(term.term, {**term.values, "x": x, "y": y, "v": 1.0, "moving": 1.0}), x.shape)
    what = "" if term.on == SHARE else " in forward motion"
    at = [f"{slower(-share[i])} near ({x[i]:.2f}, {y[i]:.2f}) m" for i in (int(share.argmin()), int(share.argmax()))]
    return f"the robot is{what} {at[0]}, {at[1]}"


def velocity_by_heading(term: Formula, predictor: Predictor) -> str:
    """Of forward velocity at a usual speed, or of the turn rate: where it is largest, and where least."""
    seen = predictor.variables()
    usual = float(np.median(np.abs(seen["left_m_s"] + seen["right_m_s"]).ravel() / 2.0))
    grid = np.linspace(-np.pi, np.pi, POINTS)
    change = curve_of(term, "heading", grid, v=usual, moving=1.0)
    size, unit = (np.degrees(change), "°/s") if term.on == "w" else (1e3 * change, "mm/s")
    at = [f"{size[i]:+.2g} {unit} at a heading of {np.degrees(grid[i]):.0f}°" for i in (change.argmax(), change.argmin())]
    speed = "" if term.on == "w" and term.signal != PULL else f" at {usual:.2g} m/s"
    return f"{VELOCITIES[term.on]}{speed} depends on heading: {at[0]}, {at[1]}"


def turned_in_words(angle_rad: float) -> str:
    """After which turn since a trial began."""
    degrees = round(float(np.degrees(angle_rad)))
    return f"after {abs(degrees)}° to the {'left' if degrees > 0 else 'right'}" if degrees else "before it turns"


def twist(term: Formula, predictor: Predictor) -> str:
    """How the turn rate changes with the turn since the trial began: at the least and the largest that are usual."""
    ends = np.quantile(predictor.variables()["turned_rad"], _ENDS)
    change = np.degrees(curve_of(term, "turned", ends, moving=1.0))
    at = [f"{one:+.2g} °/s {turned_in_words(end)}" for one, end in zip(change, ends, strict=True)]
    return f"{VELOCITIES[term.on]} changes with the turn since the trial began (to the left: +): {', '.join(at)}"


def travel(term: Formula, _: Predictor) -> str:
    """In which direction of travel forward motion is slowest and fastest."""
    grid = np.linspace(-np.pi, np.pi, POINTS)
    share = curve_of(term, "heading", grid, v=1.0)
    low, high = (int(i) for i in (share.argmin(), share.argmax()))
    return ", ".join(f"{slower(-share[i])} when it travels towards {np.degrees(grid[i]):.0f}°" for i in (low, high))
