"""What a flexible term looks like, in words of physics: how much, when, where."""

from __future__ import annotations

from collections.abc import Callable
from itertools import pairwise

import numpy as np

from bns.diagnose.data.tracks import Array
from bns.diagnose.predict.base import Predictor
from bns.diagnose.predict.wheels import WheelPredictor
from bns.diagnose.residuals.grammar import (
    BY_DIRECTION,
    CHANGES,
    CHANGES_ALONE,
    LOGGED,
    LOGGED_OFFSET,
    PLACE,
    PULL,
    RESPONSE,
    RESPONSE_ALONE,
    RESPONSE_KNOTS_S,
    RESPONSE_OF,
    SESSION,
    SLOWING,
    SPEED_THERE,
    STRAIGHT,
    STRAIGHT_AT,
    SURFACE,
    SURFACE_KNOTS,
    TRAVEL,
)
from bns.diagnose.residuals.symbolic import Formula
from bns.diagnose.settings import DEFAULTS
from bns.physics.formula import LEFT, NEVER_M, RIGHT, SHARE, names_in, value_of
from bns.physics.model import Model

_POINTS = 400
_ALIKE = DEFAULTS.report.same_share
_FLAT = DEFAULTS.report.flat_share
_ENDS = DEFAULTS.report.surface_ends
_WAYS = ({"lately10": 1.0, "lately100": 1.0}, {"lately10": 0.0, "lately100": 1.0})
"""Of a wheel that drove a metre just now; and of one that did so more than 10 s ago."""


def in_words(term: Formula, predictor: Predictor) -> str:
    """One sentence without its full stop."""
    if term.signal == "place" and "c" in term.values:
        v = term.values
        there = f"within {abs(v['c']):.3g} m of ({v['a']:.3g}, {v['b']:.3g}) m"
        if term.on in {"east", "north"}:
            return f"{VELOCITIES[term.on]} differs by {1e3 * v['k']:+.3g} mm/s {there}"
        if term.on == "s":
            return f"the robot slides to the {'right' if v['k'] >= 0 else 'left'} by {abs(v['k']):.2%} of its speed {there}"
        motion = {"v": " in forward motion", "w": " in its turns"}.get(term.on, "")
        return f"{_slower(-v['k'])}{motion} {there}"
    if term.signal.startswith(LOGGED):
        return _column(term, predictor)
    said = _SAID.get((term.signal, term.on))
    if said:
        return said(term, predictor)
    what, of = VELOCITIES[term.on], term.signal or variables_of(term)
    return f"{what} {'differs from its command' if of == what else f'depends on {of}'} ({_largest(term, predictor)})"


VELOCITIES = {
    "v": "forward velocity",
    "w": "turning velocity",
    "s": "sideways velocity",
    "east": "velocity east",
    "north": "velocity north",
    "share": "the fraction of the commanded motion that is driven",
    "wheels": "the speed of each wheel",
    "left": "the speed of the left wheel",
    "right": "the speed of the right wheel",
}


_NAMES = {
    "v": "forward velocity",
    "w": "turn rate",
    "l": "the left wheel's speed",
    "r": "the right wheel's speed",
    "t": "time of the session",
    "tau": "time in the trial",
    "d": "distance driven in the trial",
    "x": "place",
    "y": "place",
    "heading": "heading",
    "u": "its speed",
}


def variables_of(term: Formula) -> str:
    """What a formula without a signal is a function of."""
    used = names_in(term.term)
    found = list(dict.fromkeys(text for name, text in _NAMES.items() if name in used)) or ["whether a wheel turns"]
    return " and ".join(filter(None, (", ".join(found[:-1]), found[-1])))


def _slower(share: float) -> str:
    return f"{'slower' if share >= 0 else 'faster'} by {abs(share):.2%}"


def _curve(term: Formula, name: str, grid: Array, **others: float) -> Array:
    out: Array = np.broadcast_to(value_of(term.term, {**term.values, name: grid, **others}), grid.shape)
    return out


def _along(term: Formula, name: str, grid: Array, what: str) -> str:
    """A share of all velocities along a signal, where it is lowest and highest."""
    share = _curve(term, name, grid)
    low, high = int(share.argmin()), int(share.argmax())
    return f"{_slower(-share[low])} at {seconds(grid[low])} {what}, {_slower(-share[high])} at {seconds(grid[high])}"


def seconds(time_s: float) -> str:
    """A time (s) in three digits, or more where it is long."""
    return f"{time_s:.3g} s" if abs(time_s) < 100.0 else f"{time_s:.0f} s"


def _time_in_trial(term: Formula, predictor: Predictor) -> str:
    longest = float(predictor.tracks.own_s.max())
    return _along(term, "tau", np.linspace(0, longest, _POINTS), "of a trial")


def _session(term: Formula, predictor: Predictor) -> str:
    t_s = predictor.tracks.session_s
    grid = np.linspace(float(t_s.min()), float(t_s.max()), _POINTS)
    if term.on == SHARE:
        return _along(term, "t", grid, "of the session")
    share = _curve(term, "t", grid, u=1.0, w=1.0)
    most = int(np.abs(share).argmax())
    whose = {LEFT: "the left wheel is", RIGHT: "the right wheel is"}.get(term.on, "the robot's turning is")
    return f"{whose} {_slower(-share[most])} at {seconds(grid[most])} of the session than at its beginning"


def _heading(term: Formula, _: Predictor) -> str:
    grid = np.linspace(-np.pi, np.pi, _POINTS)
    share = _curve(term, "heading", grid)
    low, high = (int(i) for i in (share.argmin(), share.argmax()))
    at = [f"{_slower(-share[i])} at a heading of {np.degrees(grid[i]):.0f}°" for i in (low, high)]
    return ", ".join(at)


def _at_places(term: Formula, predictor: Predictor) -> str:
    """Of a share or a forward speed that depends on the place: where, of all places that were seen, it is least and largest."""
    pose = predictor.tracks.pose
    x, y = pose[:: max(len(pose) // (10 * _POINTS), 1), :2].T
    share = np.broadcast_to(value_of(term.term, {**term.values, "x": x, "y": y, "v": 1.0, "moving": 1.0}), x.shape)
    what = "" if term.on == SHARE else " in forward motion"
    at = [f"{_slower(-share[i])} near ({x[i]:.2f}, {y[i]:.2f}) m" for i in (int(share.argmin()), int(share.argmax()))]
    return f"the robot is{what} {at[0]}, {at[1]}"


def _by_heading(term: Formula, predictor: Predictor) -> str:
    """Of forward velocity at a usual speed, or of the turn rate: where it is largest, and where least."""
    seen = predictor.variables()
    usual = float(np.median(np.abs(seen["left_m_s"] + seen["right_m_s"]).ravel() / 2.0))
    grid = np.linspace(-np.pi, np.pi, _POINTS)
    change = _curve(term, "heading", grid, v=usual, moving=1.0)
    size, unit = (np.degrees(change), "°/s") if term.on == "w" else (1e3 * change, "mm/s")
    at = [f"{size[i]:+.2g} {unit} at a heading of {np.degrees(grid[i]):.0f}°" for i in (change.argmax(), change.argmin())]
    speed = "" if term.on == "w" and term.signal != PULL else f" at {usual:.2g} m/s"
    return f"{VELOCITIES[term.on]}{speed} depends on heading: {at[0]}, {at[1]}"


def _travel(term: Formula, _: Predictor) -> str:
    grid = np.linspace(-np.pi, np.pi, _POINTS)
    share = _curve(term, "heading", grid, v=1.0)
    low, high = (int(i) for i in (share.argmin(), share.argmax()))
    return ", ".join(f"{_slower(-share[i])} when it travels towards {np.degrees(grid[i]):.0f}°" for i in (low, high))


_WHOSE = {"v": "forward motion", "w": "turning", SHARE: "motion", LEFT: "left wheel", RIGHT: "right wheel"}


def _column(term: Formula, predictor: Predictor) -> str:
    """Of what follows a further column of the log: how much at a low value of it and at a high one."""
    name, values = term.signal.removeprefix(LOGGED).removesuffix(LOGGED_OFFSET), predictor.tracks.extra
    low, high = np.nanquantile(values[name], _ENDS)
    change = _curve(term, name, np.array([low, high]), v=1.0, w=1.0, u=1.0, moving=1.0)
    if term.signal.endswith(LOGGED_OFFSET):
        said, unit = (np.degrees(change), "°/s") if term.on == "w" else (1e3 * change, "mm/s")
        at = [f"{one:+.2g} {unit} at {where:.3g}" for one, where in zip(said, (low, high), strict=True)]
        return f"{VELOCITIES[term.on]} changes with {name} while the robot moves: {', '.join(at)}"
    at = [f"{_slower(-one)} at {where:.3g}" for one, where in zip(change, (low, high), strict=True)]
    return f"the robot's {_WHOSE[term.on]} follows {name}: {', '.join(at)}"


def _straight(term: Formula, predictor: Predictor) -> str:
    seen = predictor.variables()
    speed = (seen["left_m_s"] + seen["right_m_s"]).ravel() / 2.0
    straight = np.abs(seen["right_m_s"] - seen["left_m_s"]).ravel() <= STRAIGHT_AT * float(np.abs(speed).max())
    at = [float(np.median(speed[straight & way])) for way in (speed > 0.0, speed < 0.0) if (straight & way).any()]
    rates = [np.degrees(float(_curve(term, "v", np.array([v]), w=0.0, moving=1.0)[0])) for v in at]
    said = [f"{rate:+.2g} °/s at {v:.2g} m/s" for rate, v in zip(rates, at, strict=True)]
    return f"on straight lines, and only there, the robot also turns (to the left: +): {', '.join(said)}"


def _reversal(term: Formula, _: Predictor) -> str:
    way = np.linspace(0.0, 1.0, 10 * _POINTS)
    lost = -float(np.trapezoid(_curve(term, "since", way, u=1.0), way))
    verb = "loses" if lost >= 0 else "gains"
    return f"a wheel {verb} {1e3 * abs(lost):.3g} mm of its distance whenever it changes direction"


def _swing(term: Formula, _: Predictor) -> str:
    back, across = _curve(term, "swing", np.array([1.0, 0.5]))
    return (
        f"{_slower(-back)} while the direction of motion is opposite to that over the last half wheelbase of distance, "
        f"{_slower(-across)} while it is perpendicular to it"
    )


def _speed(term: Formula, predictor: Predictor) -> str:
    seen = predictor.variables()
    wheels = np.stack([seen["left_m_s"], seen["right_m_s"]])
    if isinstance(predictor, WheelPredictor):  # the term begins from what the effects of the wheels leave of the commands
        turned = predictor.turned(term.fit.model)
        wheels = np.stack([turned.left_m_s, turned.right_m_s])
    fastest = float(np.abs(wheels).max())
    at = fastest * np.array([0.1, 0.3, 1.0])
    got = at + _curve(term, "u", at, since=NEVER_M)
    back = -fastest + _curve(term, "u", np.array([-fastest]), since=NEVER_M)
    if wheels.min() < 0.0 and abs(back[0] + got[-1]) > 0.01 * fastest:
        at, got = np.append(at, -fastest), np.append(got, back)
    got = np.where(got * at < 0.0, 0.0, got)  # a knot may lie a little beyond rest: the wheel stands
    shares = got / at
    told = zip(at, got, shares, strict=True)
    pairs = ", ".join(f"{a:.3g} m/s gives {b:.3g} m/s ({100 * (share - 1.0):+.1f}%)" for a, b, share in told)
    whose = {LEFT: "the left wheel", RIGHT: "the right wheel"}.get(term.on, "a wheel")
    if np.ptp(shares) < _ALIKE:
        return f"{whose} is {_slower(1.0 - float(shares[-1]))} than its command at all speeds ({pairs})"
    return f"{whose}'s speed is not proportional to its command: {pairs}"


def _surface(term: Formula, predictor: Predictor) -> str:
    """Of a free surface over speed and turn rate: how much, from the least to the most that usual commands see, and where."""
    v, w = driven(term.fit.model, predictor)
    own, knots = (w, SURFACE_KNOTS[1]) if term.on == "w" else (v, SURFACE_KNOTS[0])
    change = np.broadcast_to(value_of(term.term, {**term.values, "v": v, "w": w, "moving": np.ones_like(v)}), v.shape)
    said: Callable[[float], str] = _slower_share
    kept = np.abs(v) + np.abs(w) > 0.0
    if term.on != SHARE:  # the surface begins at rest with nothing: from its first knot on it says what happens
        change, kept = change * np.sign(own), np.abs(own) >= knots[1] * np.abs(own).max()
        said = _slower_turn if term.on == "w" else _slower_way
    if not kept.any():
        return f"{VELOCITIES[term.on]} depends on {term.signal} ({_largest(term, predictor)})"
    change, v, w = change[kept], v[kept], w[kept]
    order = np.argsort(change)
    least, most = (order[int(end * (len(order) - 1))] for end in _ENDS)
    verb = {"w": "turns", "v": "drives"}.get(term.on, "is")
    if change[least] * change[most] > 0.0 and change[most] - change[least] < _FLAT * abs(float(np.median(change))):
        return f"the robot {verb} {said(float(np.median(change)))}, at nearly all speeds and turn rates alike"
    at = [f"{said(float(change[i]))} at {v[i]:.2g} m/s with {np.degrees(w[i]):.0f} °/s" for i in (least, most)]
    return f"the robot {verb} {', '.join(at)}"


def driven(model: Model, predictor: Predictor) -> tuple[Array, Array]:
    """Forward velocity (m/s) and turn rate (rad/s) in every command, (steps,): what effects of the wheels leave of them."""
    seen = predictor.variables()
    left, right = seen["left_m_s"].ravel(), seen["right_m_s"].ravel()
    if isinstance(predictor, WheelPredictor):
        turned = predictor.turned(model)
        left, right = turned.left_m_s.ravel(), turned.right_m_s.ravel()
    return (left + right) / 2.0, (right - left) / model.wheelbase_m


def _slower_share(change: float) -> str:
    return _slower(-change)


def _slower_turn(change: float) -> str:
    return f"{'slower' if change <= 0 else 'faster'} by {abs(np.degrees(change)):.2g} °/s"


def _slower_way(change: float) -> str:
    return f"{'slower' if change <= 0 else 'faster'} by {1e3 * abs(change):.2g} mm/s"


def _work(term: Formula, _: Predictor) -> str:
    per_m = [-float(_curve(term, "u", np.ones(1), **ways)[0]) for ways in _WAYS]
    return (
        f"a wheel is {_slower(per_m[0])} for each metre that it drove in the last 10 s, and {_slower(per_m[1])} for each "
        "metre of the 90 s before"
    )


def _steps(term: Formula, _: Predictor) -> str:
    speeds = np.linspace(0.0, 1.0, 100 * _POINTS)
    jumps = np.flatnonzero(np.diff(_curve(term, "u", speeds)) > 0)
    step = float(np.median(np.diff(speeds[jumps]))) if len(jumps) > 1 else float("nan")
    return f"wheel speeds come in steps of {1e3 * step:.3g} mm/s"


def _changes(term: Formula, _: Predictor) -> str:
    jump = np.array([0.1])
    rest = float(_curve(term, "fresh", jump, u=0.1)[0] / jump[0])
    share = "less than 1%" if abs(rest) < 0.01 else f"{abs(rest):.0%}"
    whose = {LEFT: " of the left wheel's", RIGHT: " of the right wheel's"}.get(term.on, " of")
    return f"just after a change{whose} speed, {share} of it is {'missing' if rest < 0 else 'added'}, fading within 0.15 s"


_RESPONDS = {"wheels": ("u", "a wheel"), "v": ("v", "the robot's forward motion"), "w": ("w", "the robot's turning")}


def _response(term: Formula, _: Predictor) -> str:
    """From the speed after a step of its command from 0 to 1."""
    now, what = _RESPONDS[term.on]
    grid = np.linspace(0.0, 2.0 * RESPONSE_KNOTS_S[-1], 10 * _POINTS)

    def ago(from_s: float, to_s: float) -> Array:
        return np.clip((grid - from_s) / (to_s - from_s), 0.0, 1.0)

    speed = 1.0 + value_of(term.term, {**term.values, now: np.ones_like(grid), "ago": ago})
    end = float(speed[-1])
    if end <= 0.0 or float(speed.max()) >= 2.0 * end:  # no linear drive without zeros overshoots by a whole step
        return (
            f"{VELOCITIES[term.on]} depends on its commands of the last {RESPONSE_KNOTS_S[-1]:g} s, but not as the response "
            "of a drive to a step does"
        )
    half_s = float(grid[np.argmax(speed >= end / 2.0)])
    half = f"after {half_s:.2g} s" if half_s > RESPONSE_KNOTS_S[1] else f"within {RESPONSE_KNOTS_S[1]:g} s"
    settled = float(grid[np.max(np.flatnonzero(np.abs(speed - end) > 0.05 * abs(end)), initial=0)])
    if max(half_s, settled) <= RESPONSE_KNOTS_S[1]:
        return f"after a change of its command{_left_of(term)} {what} has the new speed within {RESPONSE_KNOTS_S[1]:g} s"
    over = float(speed.max()) / end - 1.0
    most_s = float(grid[int(speed.argmax())])
    when = "at once" if most_s == 0.0 else f"after {most_s:.2g} s"
    beyond = f", goes beyond it by {over:.0%} {when}" if over > 0.02 else ""
    return (
        f"after a change of its command{_left_of(term)} {what} has half of the new speed {half}{beyond}, and stays within 5% of "
        f"it from {settled:.2g} s on"
    )


def _left_of(term: Formula) -> str:
    """That a response begins from what the effects of the wheels leave of a command, where the model has any."""
    on_wheels = any(active.effect.stage == "wheel" for active in term.fit.model.effects)
    return ", beyond what the effects of the wheels do to it," if on_wheels else ""


def _later(term: Formula) -> str:
    """By how much longer a change of speed takes, from the way that it costs: each number's share of it came so long ago.

    By the numbers' names: a model lists them as texts, k10 before k2.
    """
    late_s = sum(term.values[f"k{i}"] * (a + b) / 2.0 for i, (a, b) in enumerate(pairwise(RESPONSE_KNOTS_S)))
    return f"{abs(late_s):.2g} s {'later' if late_s > 0 else 'sooner'}"


def _one_wheel(term: Formula, _: Predictor) -> str:
    one, other = ("left", "right") if term.on == LEFT else ("right", "left")
    return f"the {one} wheel follows a change of its command {_later(term)} than the {other} one"


def _slowing(term: Formula, _: Predictor) -> str:
    return f"a wheel that slows down follows its command {_later(term)} than one that speeds up"


def _largest(term: Formula, predictor: Predictor) -> str:
    """The largest change of the velocity over speeds, turns, headings and places that were seen."""
    seen = predictor.variables()
    left, right = seen["left_m_s"].ravel(), seen["right_m_s"].ravel()
    names = {
        "v": (left + right) / 2,
        "w": (right - left) / term.fit.model.wheelbase_m,
        "l": left,
        "r": right,
        "moving": np.ones_like(left),
    }
    of = {"x": "x_m", "y": "y_m", "heading": "heading_rad", "tau": "time_in_trial_s", "t": "session_s", "d": "way_m"}
    places = {name: seen[variable].ravel() for name, variable in of.items() if variable in seen}
    change = np.abs(np.broadcast_to(value_of(term.term, {**term.values, **names, **places}), left.shape))
    size = float(np.quantile(change[np.isfinite(change)], 0.95))
    if term.on == SHARE:
        return f"by up to {size:.2%}"
    return f"by up to {np.degrees(size):.3g} °/s" if term.on == "w" else f"by up to {1e3 * size:.3g} mm/s"


_SAID: dict[tuple[str, str], Callable[[Formula, Predictor], str]] = {
    ("time in the trial", "share"): _time_in_trial,
    **{(SESSION, on): _session for on in (SHARE, LEFT, RIGHT, "w")},
    ("heading", "share"): _heading,
    (PLACE, "share"): _at_places,
    (SPEED_THERE, "v"): _at_places,
    ("heading", "v"): _by_heading,
    ("heading", "w"): _by_heading,
    (PULL, "w"): _by_heading,
    (TRAVEL, "v"): _travel,
    (STRAIGHT, "w"): _straight,
    ("distance since each wheel reversed", "wheels"): _reversal,
    ("direction of motion", "share"): _swing,
    ("speed of each wheel", "wheels"): _speed,
    ("speed of the left wheel", "left"): _speed,
    ("speed of the right wheel", "right"): _speed,
    ("recent work of each wheel", "wheels"): _work,
    ("speed in steps", "wheels"): _steps,
    **{(signal, on): _speed for on, signal in BY_DIRECTION.items()},
    (CHANGES, "wheels"): _changes,
    **{(signal, on): _changes for on, signal in CHANGES_ALONE.items()},
    (RESPONSE, "wheels"): _response,
    **{(signal, on): _response for on, signal in RESPONSE_OF.items()},
    **{(signal, on): _one_wheel for on, signal in RESPONSE_ALONE.items()},
    (SLOWING, "wheels"): _slowing,
    **{(SURFACE, on): _surface for on in ("v", "w", SHARE)},
}
