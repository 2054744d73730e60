"""What a flexible term looks like, in words of physics: how much, when, where."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from bns.diagnose.data.tracks import Array
from bns.diagnose.predict.base import Predictor
from bns.diagnose.predict.wheels import WheelPredictor
from bns.diagnose.residuals.grammar import (
    ALONG,
    BY_DIRECTION,
    CHANGES,
    CHANGES_ALONE,
    DRIFT,
    LOGGED,
    LOGGED_OFFSET,
    PLACE,
    PULL,
    RESPONSE,
    RESPONSE_ALONE,
    RESPONSE_OF,
    SESSION,
    SLOWING,
    SPEED_THERE,
    STRAIGHT,
    STRAIGHT_AT,
    SURFACE,
    SURFACE_KNOTS,
    TRAVEL,
    TWIST,
)
from bns.diagnose.residuals.past_in_words import changes, one_wheel, response, reversal, slowing, swing, work
from bns.diagnose.residuals.phrases import POINTS, VELOCITIES, curve_of, slower
from bns.diagnose.residuals.places_in_words import (
    at_places,
    drift,
    session,
    share_by_heading,
    time_in_trial,
    travel,
    twist,
    velocity_by_heading,
)
from bns.diagnose.residuals.symbolic import Formula
from bns.diagnose.settings import DEFAULTS
from bns.physics.figures import figures
from bns.physics.formula import LEFT, NEVER_M, RIGHT, SHARE, names_in, value_of
from bns.physics.model import Model

_ALIKE = DEFAULTS.report.same_share
_FLAT = DEFAULTS.report.flat_share
_ENDS = DEFAULTS.report.surface_ends


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
        return f"{slower(-v['k'])}{motion} {there}"
    if term.signal.startswith(LOGGED):
        return _column(term, predictor)
    said = _SAID.get((term.signal, term.on))
    if said:
        return said(term, predictor)
    what, of = VELOCITIES[term.on], term.signal or variables_of(term)
    return f"{what} {'differs from its command' if of == what else f'depends on {of}'} ({_largest(term, predictor)})"




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
    "turned": "turn since the trial began",
    "u": "its speed",
}


def variables_of(term: Formula) -> str:
    """What a formula without a signal is a function of."""
    used = names_in(term.term)
    found = list(dict.fromkeys(text for name, text in _NAMES.items() if name in used)) or ["whether a wheel turns"]
    return " and ".join(filter(None, (", ".join(found[:-1]), found[-1])))


_WHOSE = {"v": "forward motion", "w": "turning", SHARE: "motion", LEFT: "left wheel", RIGHT: "right wheel"}


def _column(term: Formula, predictor: Predictor) -> str:
    """Of what follows a further column of the log: how much at a low value of it and at a high one."""
    name, values = term.signal.removeprefix(LOGGED).removesuffix(LOGGED_OFFSET), predictor.tracks.extra
    low, high = np.nanquantile(values[name], _ENDS)
    change = curve_of(term, name, np.array([low, high]), v=1.0, w=1.0, u=1.0, moving=1.0)
    if term.signal.endswith(LOGGED_OFFSET):
        said, unit = (np.degrees(change), "°/s") if term.on == "w" else (1e3 * change, "mm/s")
        at = [f"{one:+.2g} {unit} at {where:.3g}" for one, where in zip(said, (low, high), strict=True)]
        return f"{VELOCITIES[term.on]} changes with {name} while the robot moves: {', '.join(at)}"
    at = [f"{slower(-one)} at {where:.3g}" for one, where in zip(change, (low, high), strict=True)]
    return f"the robot's {_WHOSE[term.on]} follows {name}: {', '.join(at)}"


def _straight(term: Formula, predictor: Predictor) -> str:
    seen = predictor.variables()
    speed = (seen["left_m_s"] + seen["right_m_s"]).ravel() / 2.0
    straight = np.abs(seen["right_m_s"] - seen["left_m_s"]).ravel() <= STRAIGHT_AT * float(np.abs(speed).max())
    at = [float(np.median(speed[straight & way])) for way in (speed > 0.0, speed < 0.0) if (straight & way).any()]
    rates = [np.degrees(float(curve_of(term, "v", np.array([v]), w=0.0, moving=1.0)[0])) for v in at]
    said = [f"{rate:+.2g} °/s at {v:.2g} m/s" for rate, v in zip(rates, at, strict=True)]
    return f"on straight lines, and only there, the robot also turns (to the left: +): {', '.join(said)}"


def _speed(term: Formula, predictor: Predictor) -> str:
    seen = predictor.variables()
    wheels = np.stack([seen["left_m_s"], seen["right_m_s"]])
    if isinstance(predictor, WheelPredictor):  # the term begins from what the effects of the wheels leave of the commands
        turned = predictor.turned(term.fit.model)
        wheels = np.stack([turned.left_m_s, turned.right_m_s])
    wheels = {LEFT: wheels[:1], RIGHT: wheels[1:]}.get(term.on, wheels)  # of one wheel's curve, only what this one drove
    fastest = float(np.abs(wheels).max())
    at = fastest * np.array([0.1, 0.3, 1.0])
    got = at + curve_of(term, "u", at, since=NEVER_M)
    back = -fastest + curve_of(term, "u", np.array([-fastest]), since=NEVER_M)
    if wheels.min() < 0.0 and abs(back[0] + got[-1]) > 0.01 * fastest:
        at, got = np.append(at, -fastest), np.append(got, back)
    got = np.where(got * at < 0.0, 0.0, got)  # a knot may lie a little beyond rest: the wheel stands
    shares = got / at
    told = zip(at, got, shares, strict=True)
    pairs = ", ".join(f"{a:.3g} m/s gives {b:.3g} m/s ({100 * (share - 1.0):+.1f}%)" for a, b, share in told)
    whose = {LEFT: "the left wheel", RIGHT: "the right wheel"}.get(term.on, "a wheel")
    if np.ptp(shares) < _ALIKE:
        return f"{whose} is {slower(1.0 - float(shares[-1]))} than its command at all speeds ({pairs})"
    return f"{whose}'s speed is not proportional to its command: {pairs}"


def _along(term: Formula, predictor: Predictor) -> str:
    """Of curves of the robot's forward velocity: what some speeds come to, forwards and backwards."""
    v, _ = driven(term.fit.model, predictor)
    ends = [np.array([0.3, 1.0]) * float(one) for one in (v.max(), v.min()) if one]
    at = np.concatenate(ends) if ends else np.zeros(0)
    pairs = [f"{_slower_way(c * np.sign(one))} at {one:.2g} m/s" for one, c in zip(at, curve_of(term, "v", at), strict=True)]
    return f"forward motion differs from its command, whatever the robot turns: {', '.join(pairs)}"


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
    at = [f"{said(float(change[i]))} at {round(v[i], 3) + 0.0:.2g} m/s with {np.degrees(w[i]):.0f} °/s" for i in (least, most)]
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
    return slower(-change)


def _slower_turn(change: float) -> str:
    return f"{'slower' if change <= 0 else 'faster'} by {figures(abs(np.degrees(change)))} °/s"


def _slower_way(change: float) -> str:
    return f"{'slower' if change <= 0 else 'faster'} by {figures(1e3 * abs(change))} mm/s"


def _steps(term: Formula, _: Predictor) -> str:
    speeds = np.linspace(0.0, 1.0, 100 * POINTS)
    jumps = np.flatnonzero(np.diff(curve_of(term, "u", speeds)) > 0)
    step = float(np.median(np.diff(speeds[jumps]))) if len(jumps) > 1 else float("nan")
    return f"wheel speeds come in steps of {figures(1e3 * step, 3)} mm/s"


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
    of = {"x": "x_m", "y": "y_m", "heading": "heading_rad", "turned": "turned_rad"}
    of |= {"tau": "time_in_trial_s", "t": "session_s", "d": "way_m"}
    places = {name: seen[variable].ravel() for name, variable in of.items() if variable in seen}
    change = np.abs(np.broadcast_to(value_of(term.term, {**term.values, **names, **places}), left.shape))
    size = float(np.quantile(change[np.isfinite(change)], 0.95))
    if term.on == SHARE:
        return f"by up to {size:.2%}"
    return f"by up to {figures(np.degrees(size), 3)} °/s" if term.on == "w" else f"by up to {figures(1e3 * size, 3)} mm/s"


_SAID: dict[tuple[str, str], Callable[[Formula, Predictor], str]] = {
    ("time in the trial", "share"): time_in_trial,
    **{(SESSION, on): session for on in (SHARE, LEFT, RIGHT, "w")},
    (DRIFT, "w"): drift,
    ("heading", "share"): share_by_heading,
    (PLACE, "share"): at_places,
    (SPEED_THERE, "v"): at_places,
    ("heading", "v"): velocity_by_heading,
    ("heading", "w"): velocity_by_heading,
    (PULL, "w"): velocity_by_heading,
    (TWIST, "w"): twist,
    (TRAVEL, "v"): travel,
    (STRAIGHT, "w"): _straight,
    ("distance since each wheel reversed", "wheels"): reversal,
    ("direction of motion", "share"): swing,
    ("speed of each wheel", "wheels"): _speed,
    ("speed of the left wheel", "left"): _speed,
    ("speed of the right wheel", "right"): _speed,
    ("recent work of each wheel", "wheels"): work,
    ("speed in steps", "wheels"): _steps,
    (ALONG, "v"): _along,
    **{(signal, on): _speed for on, signal in BY_DIRECTION.items()},
    (CHANGES, "wheels"): changes,
    **{(signal, on): changes for on, signal in CHANGES_ALONE.items()},
    (RESPONSE, "wheels"): response,
    **{(signal, on): response for on, signal in RESPONSE_OF.items()},
    **{(signal, on): one_wheel for on, signal in RESPONSE_ALONE.items()},
    (SLOWING, "wheels"): slowing,
    **{(SURFACE, on): _surface for on in ("v", "w", SHARE)},
}
