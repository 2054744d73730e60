"""What a term says of the past, in words: answers to past commands, to changes of direction, and to the work of a wheel."""

from __future__ import annotations

from itertools import pairwise

import numpy as np

from bns.diagnose.data.tracks import Array
from bns.diagnose.predict.base import Predictor
from bns.diagnose.residuals.grammar import RESPONSE_KNOTS_S
from bns.diagnose.residuals.phrases import POINTS, VELOCITIES, curve_of, slower
from bns.diagnose.residuals.symbolic import Formula
from bns.physics.figures import mm
from bns.physics.formula import LEFT, RIGHT, value_of

_RESPONDS = {"wheels": ("u", "a wheel"), "v": ("v", "the robot's forward motion"), "w": ("w", "the robot's turning")}
_WAYS = ({"lately10": 1.0, "lately100": 1.0}, {"lately10": 0.0, "lately100": 1.0})
"""Of a wheel that drove a metre just now; and of one that did so more than 10 s ago."""


def response(term: Formula, _: Predictor) -> str:
    """From the speed after a step of its command from 0 to 1."""
    now, what = _RESPONDS[term.on]
    grid = np.linspace(0.0, 2.0 * RESPONSE_KNOTS_S[-1], 10 * POINTS)

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


def one_wheel(term: Formula, _: Predictor) -> str:
    """By how much longer one wheel takes to follow its command than the other."""
    one, other = ("left", "right") if term.on == LEFT else ("right", "left")
    return f"the {one} wheel follows a change of its command {_later(term)} than the {other} one"


def slowing(term: Formula, _: Predictor) -> str:
    """By how much longer a wheel takes to slow down than to speed up."""
    return f"a wheel that slows down follows its command {_later(term)} than one that speeds up"


def changes(term: Formula, _: Predictor) -> str:
    """How much of a speed is missing, or too much, just after it changed."""
    jump = np.array([0.1])
    rest = float(curve_of(term, "fresh", jump, u=0.1)[0] / jump[0])
    share = "less than 1%" if abs(rest) < 0.01 else f"{abs(rest):.0%}"
    whose = {LEFT: " of the left wheel's", RIGHT: " of the right wheel's"}.get(term.on, " of")
    return f"just after a change{whose} speed, {share} of it is {'missing' if rest < 0 else 'added'}, fading within 0.15 s"


def reversal(term: Formula, _: Predictor) -> str:
    """The distance that a change of direction costs."""
    way = np.linspace(0.0, 1.0, 10 * POINTS)
    lost = -float(np.trapezoid(curve_of(term, "since", way, u=1.0), way))
    verb = "loses" if lost >= 0 else "gains"
    return f"a wheel {verb} {mm(abs(lost), 3)} of its distance whenever it changes direction"


def swing(term: Formula, _: Predictor) -> str:
    """How much slower the robot is while its direction of motion changes."""
    back, across = curve_of(term, "swing", np.array([1.0, 0.5]))
    return (
        f"{slower(-back)} while the direction of motion is opposite to that over the last half wheelbase of distance, "
        f"{slower(-across)} while it is perpendicular to it"
    )


def work(term: Formula, _: Predictor) -> str:
    """How much slower a wheel is for each metre that it drove lately."""
    per_m = [-float(curve_of(term, "u", np.ones(1), **ways)[0]) for ways in _WAYS]
    return (
        f"a wheel is {slower(per_m[0])} for each metre that it drove in the last 10 s, and {slower(per_m[1])} for each "
        "metre of the 90 s before"
    )
