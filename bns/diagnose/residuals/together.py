"""What several flexible terms do together, where sentences about single ones would be false.

Terms are found one after the other, and a later one may take back what an earlier one adds. Where a term's contribution to a
velocity is largest, the contributions of all terms are compared with it. If these leave little of it, nothing is said of the
term; one sentence says what all terms do together, and where, of all that was driven long enough and where the poses show it.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from bns.diagnose.data.tracks import Array
from bns.diagnose.predict.base import Predictor
from bns.diagnose.predict.wheels import WheelPredictor
from bns.diagnose.residuals.grammar import SURFACE
from bns.diagnose.residuals.phrases import VELOCITIES, seconds
from bns.diagnose.residuals.places_in_words import turned_in_words
from bns.diagnose.residuals.symbolic import Formula
from bns.diagnose.residuals.words import driven, in_words, variables_of
from bns.diagnose.settings import DEFAULTS
from bns.engine.pose_filter import displacements
from bns.physics.formula import LEFT, RIGHT, SHARE, WHEELS, names_in, value_of
from bns.physics.model import Model
from bns.physics.signals import Body
from bns.physics.wheels.motion import with_body_effects

LARGEST = DEFAULTS.report.cancel_steps
PART = DEFAULTS.report.cancel_part
SIDE = DEFAULTS.report.cancel_side
CELL = DEFAULTS.report.together_cell
DRIVEN = DEFAULTS.report.together_driven
NOTHING = DEFAULTS.report.together_nothing
LEAST = DEFAULTS.report.together_least
FLAT = DEFAULTS.report.flat_share
ENDS = DEFAULTS.report.surface_ends
_JUDGED: Mapping[str, tuple[str, ...]] = {SHARE: ("v", "w"), WHEELS: (LEFT, RIGHT)}
"""The velocities that a term adds to, where these are not just the one that it is written for."""
_TOLD: Mapping[str, tuple[str, ...]] = dict.fromkeys((SHARE, WHEELS, LEFT, RIGHT), ("v", "w"))
"""The velocities of the body that the sentence about all terms is on."""
_SCALED = ("v", "w")
"""What is slower or faster, rather than to one side or the other."""
_PLACED: Mapping[str, tuple[str, ...]] = {
    "x": ("x_m", "y_m"),
    "y": ("x_m", "y_m"),
    "heading": ("heading_rad",),
    "turned": ("turned_rad",),
}
_TIMED: Mapping[str, tuple[str, ...]] = {"tau": ("time_in_trial_s",), "t": ("session_s",)}
_SPEEDS = ("v", "w")
_UNSAID = "; other terms take back a part of this, so that only the sum of all describes the robot"
_FAINT = " (less than the tracking noise)"


@dataclass(frozen=True)
class Said:
    """What terms are said to do, in words without full stops.

    ``of_each``: one text a term, to stand beside its formula. ``sentences``: what the robot does.
    """

    of_each: tuple[str, ...]
    sentences: tuple[str, ...]


def said_of(terms: Sequence[Formula], predictor: Predictor) -> Said:
    """What terms that were fitted together do; each by itself, unless it cancels or is below the noise beside others."""
    alone = tuple(in_words(term, predictor) for term in terms)
    if len(terms) < 2 or not isinstance(predictor, WheelPredictor):
        return Said(alone, alone)
    faint = [term.below_noise for term in terms]
    faint = faint if not all(faint) else [False] * len(terms)
    driven_steps = _Driven(terms[0].fit.model, terms, predictor)
    cancels = [not weak and driven_steps.cancels(term) for term, weak in zip(terms, faint, strict=True)]
    each, sentences = [], []
    for term, words, weak, cancelling in zip(terms, alone, faint, cancels, strict=True):
        if weak or cancelling:
            what = f"{VELOCITIES[term.on]} depends on {term.signal or variables_of(term)}"
            each.append(f"{words}{_FAINT}" if weak else f"{what}{_UNSAID}")
        else:
            each.append(words)
            sentences.append(words)
    sum_of = driven_steps.together([term for term, cancelling in zip(terms, cancels, strict=True) if cancelling])
    return Said(tuple(each), (*sentences, *sum_of))


def formula_in_words(formula: Formula | None, predictor: Predictor) -> str:
    """Of a formula that is no part of the model; "" where there is none, or of a body that has no wheels."""
    return in_words(formula, predictor) if formula is not None and "left_m_s" in predictor.variables() else ""


class _Driven:
    """What the terms of a model do at every step in which the robot was seen to drive; arrays are (steps,)."""

    def __init__(self, model: Model, terms: Sequence[Formula], predictor: WheelPredictor) -> None:
        bare = model
        for term in terms:
            bare = bare.without(term.name)
        assert predictor.conditions.seen is not None
        whole = _body(model, predictor)
        lasted_s = predictor.grid.step_s * np.isfinite(predictor.conditions.seen).all(axis=-1) * (whole.moving > 0.0)
        self._model, self._predictor, self._there = model, predictor, lasted_s > 0.0
        self._driven_s = max(float(lasted_s.sum()), 1e-300)
        self._share = lasted_s[self._there] / self._driven_s
        self._off = _off(model, predictor, self._there)
        self._whole, self._base = self._velocities(whole), self._velocities(_body(bare, predictor))
        told = driven(bare, predictor)
        self._told = dict(zip(_SPEEDS, (one.reshape(lasted_s.shape)[self._there] for one in told), strict=True))

    def cancels(self, term: Formula) -> bool:
        """Is a good part of the largest contributions of a term, either way, taken back by the other terms?

        Or are they smaller than what its words say of the speeds that were driven? Behind a term that slows turns down, a surface
        never sees its own quick turns.
        """
        without = self._velocities(_body(self._model.without(term.name), self._predictor))
        for velocity in _JUDGED.get(term.on, (term.on,)):
            own, total = self._whole[velocity] - without[velocity], self._change(velocity)
            if (at_these_speeds := self._by_its_words(term)) is not None:
                total = np.sign(at_these_speeds) * np.minimum(np.sign(at_these_speeds) * own, np.sign(at_these_speeds) * total)
                own = at_these_speeds
            sides = [self._largest(sign * own, sign * total) for sign in (1.0, -1.0)]
            most = max(size for size, _ in sides)
            if any(mostly for size, mostly in sides if size > SIDE * most):
                return True
        return False

    def _by_its_words(self, term: Formula) -> Array | None:
        """What a free surface over speed and turn adds at the speeds that were driven, as its words say; None of other terms."""
        if term.signal != SURFACE or term.on not in _SPEEDS:
            return None
        out = value_of(term.term, {**term.values, **self._told, "moving": 1.0})
        return np.broadcast_to(np.asarray(out, dtype=np.float64), self._share.shape)

    def together(self, terms: Sequence[Formula]) -> Iterator[str]:
        """What all terms do together, along what these depend on, to the velocities that these change."""
        found: dict[tuple[str, tuple[str, ...]], tuple[float, str]] = {}
        for term in terms:
            for velocity in _TOLD.get(term.on, (term.on,)):
                for along in _along(term):
                    found[velocity, along] = self._told_of(velocity, along)
        least = min(LEAST, max((size for size, _ in found.values()), default=0.0))
        yield from dict.fromkeys(f"together, the terms {words}" for size, words in found.values() if size >= least)

    def _largest(self, own: Array, total: Array) -> tuple[float, bool]:
        """How large the largest contributions above 0 are, and whether all terms mostly leave less than a good part of these.

        Each step counts as long as it lasted and as much as the contribution is: where a patch of floor ends nothing is decided.
        """
        order = np.argsort(-own)
        top = order[np.cumsum(self._share[order]) - self._share[order] < LARGEST]
        top = top[own[top] > 0.0]
        if not len(top):
            return 0.0, False
        weight = self._share[top] * own[top]
        return _median(own[top], weight), bool(_median(total[top] - PART * own[top], weight) < 0.0)

    def _told_of(self, velocity: str, along: tuple[str, ...]) -> tuple[float, str]:
        """The largest change of a velocity, of what is usual, and the words for it."""
        base, change = self._base["v" if velocity not in _SPEEDS else velocity], self._change(velocity)
        usual = max(float(np.quantile(np.abs(base), ENDS[1])), 1e-300)
        kept = np.ones(len(change), dtype=np.bool_)
        if velocity in _SCALED:
            change, kept = change * np.sign(base), np.abs(base) > CELL / 2.0 * np.abs(base).max()
        off = self._off.get(velocity, np.zeros(len(change))) * (np.sign(base) if velocity in _SCALED else 1.0)
        where = _borne_out(self._neighbourhoods(change, off, along, kept))
        if not where:
            low, high = (float(end) for end in np.quantile(change[kept], ENDS)) if kept.any() else (0.0, 0.0)
            size = max(abs(low), abs(high)) / usual
            at_most = f"{ENDS[1] - ENDS[0]:.0%} of the time"
            return size, f"change {VELOCITIES[velocity]} by {_signed(velocity, low)} to {_signed(velocity, high)} for {at_most}"
        return max(abs(one.change) for one in where) / usual, _sentence(velocity, where)

    def _neighbourhoods(
        self, change: Array, off: Array, along: tuple[str, ...], kept: NDArray[np.bool_]
    ) -> list[_Neighbourhood]:
        """Medians of a change over all that was driven near one another, for long enough; ``off``: as of `_off`."""
        seen, columns = self._predictor.variables(), []
        for name in along:
            values = self._told[name] if name in _SPEEDS else seen[name][self._there]
            columns.append((values + np.pi) % (2.0 * np.pi) - np.pi if name == "heading_rad" else values)
        place = np.stack([_cell(one, name in _SPEEDS) for one, name in zip(columns, along, strict=True)], axis=1)
        _, which = np.unique(place, axis=0, return_inverse=True)
        found = []
        for cell in range(int(which.max()) + 1):
            inside = (which.ravel() == cell) & kept
            lasted = float(self._share[inside].sum())
            if lasted >= DRIVEN:
                middle = [_median(one[inside], self._share[inside]) for one in columns]
                where = _WHERE[along](*middle)
                measured = float(off[inside].sum()) / (lasted * self._driven_s)
                found.append(_Neighbourhood(_median(change[inside], self._share[inside]), lasted, where, measured))
        return found

    def _change(self, velocity: str) -> Array:
        return self._whole[velocity] - self._base[velocity]

    def _velocities(self, body: Body) -> dict[str, Array]:
        v, s, w = (one[self._there] for one in (body.forward_m_s, body.sideways_m_s, body.yaw_rad_s))
        half, out = w * body.wheelbase_m / 2.0, {"v": v, "s": s, "w": w}
        assert body.place is not None
        cos, sin = np.cos(body.place[..., 2][self._there]), np.sin(body.place[..., 2][self._there])
        return {**out, LEFT: v - half, RIGHT: v + half, "east": cos * v + sin * s, "north": sin * v - cos * s}


@dataclass(frozen=True)
class _Neighbourhood:
    """The median change there, in SI units; the share of the driven time; where that is, in words.

    ``off``: what the poses show on average beyond the model with all terms.
    """

    change: float
    share: float
    where: str
    off: float


def _borne_out(where: Sequence[_Neighbourhood]) -> list[_Neighbourhood]:
    """Those of which the poses show a good part, and not much more: a curve is off between its knots."""
    nothing = NOTHING * max((abs(one.change) for one in where), default=0.0)
    return [one for one in where if abs(one.off) <= PART * max(abs(one.change), nothing)]


def _off(model: Model, predictor: WheelPredictor, there: NDArray[np.bool_]) -> dict[str, Array]:
    """How far the robot went (m), and turned (rad), beyond what the model predicts, at the steps that are ``there``, (steps,).

    All of a displacement from frame to frame counts at the step in which it ended.
    """
    tracks, predicted = predictor.tracks, predictor.steps(model)
    heading = np.roll(tracks.pose[:, 2], 1)
    cos, sin, (x, y) = np.cos(heading), np.sin(heading), predicted.drift_m.T
    forward, left, turned = (displacements(tracks.pose, tracks.is_first) - predicted.body).T
    ends = zip(predictor.grid.node_s, tracks.first[:-1], tracks.first[1:], strict=True)
    step = np.concatenate([np.searchsorted(node_s, tracks.t_s[a:b] - 1e-6) - 1 for node_s, a, b in ends]).clip(0)
    inside = there[tracks.trial, step] & ~tracks.is_first
    place = (np.cumsum(there.ravel()) - 1).reshape(there.shape)[tracks.trial, step]
    off = {"v": forward - cos * x - sin * y, "w": turned, "s": cos * y - sin * x - left}
    return {name: np.bincount(place[inside], one[inside], int(there.sum())).astype(np.float64) for name, one in off.items()}


def _body(model: Model, predictor: WheelPredictor) -> Body:
    return with_body_effects(model, predictor.turned(model))


def _along(term: Formula) -> Iterator[tuple[str, ...]]:
    """What the sentence about all terms follows, for the sake of this one: places and times where it depends on these."""
    names = names_in(term.term)
    others = list(dict.fromkeys(along for name, along in {**_PLACED, **_TIMED}.items() if name in names))
    yield from others or [_SPEEDS]


def _cell(values: Array, about_rest: bool) -> Array:
    """The number of the neighbourhood of each value; rest, and straight lines, lie in the middle of theirs.

    What was hardly driven makes none wider.
    """
    middle = 0.0 if about_rest else (float(values.max()) + float(values.min())) / 2.0
    widest = float(np.quantile(np.abs(values - middle), 1.0 - DRIVEN))
    out: Array = np.round((values - middle) / max(CELL * widest, 1e-300))
    return out


def _median(values: Array, weight: Array) -> float:
    order = np.argsort(values)
    up_to = np.cumsum(weight[order])
    return float(values[order][min(int(np.searchsorted(up_to, up_to[-1] / 2.0)), len(order) - 1)])


def _at_speed(v: float, w: float) -> str:
    turn = f"with {np.degrees(w):.0f} °/s" if abs(np.degrees(w)) >= 0.5 else "straight ahead" if v >= 0.0 else "straight back"
    return f"at {round(v, 3):.2g} m/s {turn}"


_WHERE: Mapping[tuple[str, ...], Callable[..., str]] = {
    _SPEEDS: _at_speed,
    ("x_m", "y_m"): lambda x, y: f"near ({x:.2f}, {y:.2f}) m",
    ("heading_rad",): lambda heading: f"at a heading of {np.degrees(heading):.0f}°",
    ("turned_rad",): turned_in_words,
    ("time_in_trial_s",): lambda t_s: f"at {seconds(t_s)} of a trial",
    ("session_s",): lambda t_s: f"at {seconds(t_s)} of the session",
}
_RESTS = "do not push it"
_DOES: Mapping[str, tuple[str, str, str, str, str]] = {
    "v": ("slow forward motion", "slow it", "make forward motion faster", "make it faster", "leave it as it is"),
    "w": ("slow turns", "slow them", "make turns faster", "make them faster", "leave them as they are"),
    "s": ("push the robot to its left", "push it to its left", "push the robot to its right", "push it to its right", _RESTS),
    "east": ("push the robot west", "push it west", "push the robot east", "push it east", _RESTS),
    "north": ("push the robot south", "push it south", "push the robot north", "push it north", _RESTS),
}
"""What changes below and above 0 do, each as the first words of a sentence and as later ones; and what none does."""


def _sentence(velocity: str, where: Sequence[_Neighbourhood]) -> str:
    """Where the change is lowest and where highest; the larger of the two first."""
    low, high = min(where, key=lambda one: one.change), max(where, key=lambda one: one.change)
    down, then_down, up, then_up, leaves = _DOES[velocity]
    first, last, verb, then = (low, high, down, then_up) if -low.change >= high.change else (high, low, up, then_down)
    flat = high.change - low.change < FLAT * abs(float(np.median([one.change for one in where])))
    if low.change * high.change > 0.0 and flat:
        return f"{verb} by {_size(velocity, float(np.median([one.change for one in where])))}, nearly alike everywhere"
    begun = f"{verb} by up to {_size(velocity, first.change)} ({first.where})"
    nothing = NOTHING * abs(first.change)
    quiet = [one for one in where if abs(one.change) <= nothing]
    if last.change * first.change < 0.0 and abs(last.change) > nothing:
        return f"{begun} and {then} by up to {_size(velocity, last.change)} ({last.where})"
    if quiet:
        return f"{begun} and {leaves} {max(quiet, key=lambda one: one.share).where}"
    return f"{begun} and least, by {_size(velocity, last.change)}, {last.where}"


def _size(velocity: str, change: float) -> str:
    size, unit = (np.degrees(change), "°/s") if velocity == "w" else (1e3 * change, "mm/s")
    rounded = float(f"{abs(size):.2g}")
    return f"{rounded:g} {unit}"


def _signed(velocity: str, change: float) -> str:
    return f"{'-' if change < 0 else '+'}{_size(velocity, change)}"
