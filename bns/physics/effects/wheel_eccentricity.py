"""A wheel is eccentric or has a bump: its speed rises and falls once per revolution.

The angle of a wheel at the start of a trial is not logged. In a fit it is estimated from the track: the headings of each
half of a trial give the angle for the other half, so that no pose explains itself. Only the amplitude of each wheel and the
distance per revolution remain to be fitted. In a simulation the wheels begin at their fastest angle.

Such a wheel also lifts its load once per revolution. A speed controller without an integral term then gives way: uphill the
wheel loses the speed ``droop_m_s`` times the slope of its axle's path, downhill it gains as much. This wave does not grow with
the speed, so slow commands show more of it. The wheel loses more time uphill than it gains downhill, and stands where the loss
exceeds the command: its angle follows the equation of Adler, Proceedings of the IRE 34(6), 1946, "A study of locking phenomena
in oscillators".
"""

from __future__ import annotations

from collections.abc import Sequence
from copy import copy
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy.special import i0e, i1e

from bns.physics.effect import Effect, Parameter
from bns.physics.signals import Array, Wheels
from bns.physics.wheels.lagged_fit import lagged_rest, lagged_sums, led_to
from bns.physics.wheels.scans import turned_under_load

_RIDGE = 1e-9
_RANGE, _TURNS = (0.33, 5.0), 72
"""Ways of a turn that are looked at, in wheelbases: 4 % apart, as many as some nine turns in a trial can tell apart."""
_TRIALS, _PEAKS = 24, 4
"""So many trials are looked at, and so many of the best ways tried."""
_SHARES = 0.03, 0.6
"""Starts have shares between these; at 0 a share has no slope that would lead away."""
_LEAST_REPEATED = 0.1
"""Of the spectrum at the wave: an estimate below that is luck."""
_UNKNOWN = 1.0
"""So many trials' worth of belief that phases stay: where no wave is seen, nothing is known of their drift."""
_BEYOND = 1.25
"""A random walk's variance from one half's mean to a moment of the other, over that from mean to mean: 5/6 to 2/3."""
_LEAST_KEPT = 0.5
"""Phases that agree less (60 degrees) show no wave; its share still needs a slope."""
_STARTS = np.linspace(0.0, 2.0 * np.pi, 8, endpoint=False)
"""Angles at the start that are tried where the load slows a wheel."""
_ROUNDS, _NUDGE, _FARTHEST, _DAMPING = 3, 1e-3, 0.5, 1e-3
"""Steps from the best of them, a difference for slopes (rad), the longest step (rad), and Levenberg's damping."""
_WAVES = 4
"""Cosine and sine for each wheel."""
_DROOPS = 0.01, 0.03, 0.1, 0.3, 1.0
"""m/s that are tried: a controller whose time constant is 1 to 100 ms loses g times that per unit of slope."""
_MOST_DROOP = 10.0
"""m/s: the same of 1 s."""


def apply(wheels: Wheels, left_share: float, right_share: float, turn_m: float, droop_m_s: float = 0.0) -> Wheels:
    """Each wheel's speed plus share·(speed·cos + ``droop_m_s``·sin)(2·pi·distance/``turn_m`` + phase)."""
    shares = np.array([left_share, right_share])
    told = np.stack([wheels.left_m_s, wheels.right_m_s])
    if wheels.conditions.seen is not None and shares.any():
        waves = _waves(wheels, told, turn_m, droop_m_s, shares)
    else:
        turn = _Turning(wheels, told, turn_m)
        if droop_m_s:
            turn = turn.under_load(droop_m_s, shares, np.zeros((2, 1, len(wheels.step_s))))[0]
        waves = turn.wave(droop_m_s)[:, 0]
    # the mean of a wave over a step of which the wheel turns through a good part
    turned = told + shares[:, None, None] * waves * np.sinc(told * wheels.step_s / turn_m)
    return wheels.turning(turned[0], turned[1])


class _Turning:
    """The left and the right wheel in the middle of each step, (2, trials, steps) each: ``told`` speeds, cosine, sine of angles.

    The angles are 0 at the start, and no load slows the wheels.
    """

    def __init__(self, wheels: Wheels, told: Array, turn_m: float) -> None:
        self.wheels, self.told, self.turn_m = wheels, told, turn_m
        way = told * wheels.step_s
        self.angles: Array = (np.cumsum(way, axis=2) - way / 2.0) * (2.0 * np.pi / turn_m)
        self.cos, self.sin = np.cos(self.angles), np.sin(self.angles)

    def wave(self, droop_m_s: float) -> Array:
        """What a share of 1 adds to each wheel's speed, at its angle and a quarter of a turn before: (2, 2, trials, steps)."""
        return np.stack(
            [self.told * self.cos + droop_m_s * self.sin, self.told * self.sin - droop_m_s * self.cos], axis=1
        )

    def under_load(self, droop_m_s: float, shares: Array, starts: Array) -> tuple[_Turning, Array]:
        """The same under load, from the first of the angles ``starts`` (2, n, trials); and what all lead to.

        That is the wave's way (2, n, trials, steps) for a share of 1, m.
        """
        per_m = 2.0 * np.pi / self.turn_m
        cos, sin, led = turned_under_load(
            self.told, self.wheels.step_s, self.cos, self.sin, starts, droop_m_s * shares, per_m, droop_m_s
        )
        out = copy(self)
        out.cos, out.sin = cos[:, 0], sin[:, 0]
        return out, led


@dataclass(frozen=True)
class _Seen:
    """What ideal wheels leave of the headings (trials, steps), and which of these are there."""

    off: Array
    there: NDArray[np.bool_]
    lag: int

    def changes(self, led: Array) -> Array:
        """Over the lag, less their mean (..., trials, changes); 0 where a heading is missing."""
        both = self.there[:, self.lag :] & self.there[:, : -self.lag]
        count = np.maximum(both.sum(axis=1), 1)[:, None]
        change = (led[..., self.lag :] - led[..., : -self.lag]) * both
        out: Array = change - both * (change.sum(axis=-1, keepdims=True) / count)
        return out


def _waves(wheels: Wheels, told: Array, turn_m: float, droop_m_s: float, shares: Array) -> Array:
    """`_Turning.wave` of both wheels (2, trials, steps), in the phase that each half of a trial asks for in the other half.

    The wave is multiplied by the expected cosine of its phase's error, I1(k)/I0(k) of a von Mises distribution (Mardia and Jupp,
    Directional Statistics, section 3.5.4): without that, or with more, the fitted share is biased.
    """
    assert wheels.conditions.seen is not None
    heading = wheels.conditions.seen[..., 2]
    there, known = np.isfinite(heading), wheels.trial_s
    off = np.where(there, heading - _until((told[1] - told[0]) / wheels.wheelbase_m, wheels.step_s), 0.0)
    early = known < np.where(there, known, -np.inf).max(axis=1, keepdims=True) / 2.0
    steady = np.broadcast_to(np.arange(heading.shape[1], dtype=np.float64), heading.shape)[None]
    free = _Turning(wheels, told, turn_m)
    lag = _lag(wheels, free.angles)
    halves = [_Seen(off, there & half, lag) for half in (~early, early)]
    turns = _turned_as_seen(free, droop_m_s, shares, halves) if droop_m_s else [free]
    waves = [turn.wave(droop_m_s) for turn in turns]
    columns = [_columns(wheels, wave, steady) for wave in waves]
    # without a load, both halves have the same wave
    phases = [_phases(columns[i % len(columns)], off, half.there, lag) for i, half in enumerate(halves)]
    kept = _kept(_counted_as(phases[0], turns[0], turns[-1], early), phases[1])
    pairs = [np.moveaxis(unit * np.repeat(sure * kept, 2, axis=1), 1, 0)[:, :, None] for unit, sure in phases]
    of_half = [p[::2] * w[:, 0] + p[1::2] * w[:, 1] for p, w in zip(pairs, (waves[0], waves[-1]), strict=True)]
    out: Array = np.where(early, *of_half)
    return out


def _turned_as_seen(free: _Turning, droop_m_s: float, shares: Array, halves: Sequence[_Seen]) -> list[_Turning]:
    """Wheels under load from those angles at the start that lead nearest to the headings of each half of a trial.

    The best of `_STARTS`, and from there steps of Gauss and Newton's method, for each trial by itself.
    """
    per_share = np.array([-1.0, 1.0])[:, None] * shares[:, None] / free.wheels.wheelbase_m
    grid = np.broadcast_to(_STARTS[None, :, None], (2, len(_STARTS), len(halves[0].off)))
    led_from_grid = free.under_load(droop_m_s, shares, grid)[1] * per_share[..., None, None]
    out = []
    for half in halves:
        off = half.changes(half.off)
        left, right = half.changes(led_from_grid).swapaxes(1, 2)  # (trials, starts, changes)
        alone = [(one**2).sum(axis=2) - 2.0 * (one @ off[..., None])[..., 0] for one in (left, right)]
        missed = alone[0][:, :, None] + alone[1][:, None, :] + 2.0 * (left @ right.swapaxes(1, 2))
        best = np.unravel_index(missed.reshape(len(missed), -1).argmin(axis=1), missed.shape[1:])
        start = _STARTS[np.stack(best)]
        for _ in range(_ROUNDS):
            both = np.stack([start, start + _NUDGE], axis=1)
            led = half.changes(free.under_load(droop_m_s, shares, both)[1] * per_share[..., None, None])
            slope = (led[:, 1] - led[:, 0]) / _NUDGE
            gram = np.einsum("itk,jtk->tij", slope, slope)
            target = np.einsum("itk,tk->ti", slope, off - led[:, 0].sum(axis=0))
            scale = np.einsum("tii->ti", gram).max(axis=1)[:, None, None] + 1e-30
            step = np.linalg.solve(gram / scale + _DAMPING * np.eye(2), target[..., None] / scale)[..., 0].T
            start = start + np.clip(step, -_FARTHEST, _FARTHEST)
        out.append(free.under_load(droop_m_s, shares, start[:, None])[0])
    return out


def _counted_as(
    phases: tuple[Array, Array], turned: _Turning, other: _Turning, early: NDArray[np.bool_]
) -> tuple[Array, Array]:
    """Phases beside the angles of ``turned`` as phases beside those of ``other``, where one half of a trial ends."""
    if turned is other:
        return phases
    unit, sure = phases
    last = np.maximum(early.sum(axis=1) - 1, 0)[None, :, None]
    at = [
        [np.take_along_axis(values, last, axis=2)[..., 0].T for values in (one.cos, one.sin)] for one in (turned, other)
    ]
    (cos_a, sin_a), (cos_b, sin_b) = at
    cos, sin = cos_a * cos_b + sin_a * sin_b, sin_a * cos_b - cos_a * sin_b  # of the difference of the two angles
    real, imaginary = unit[:, ::2], -unit[:, 1::2]  # cos(angle + p) has the pair cos(p), -sin(p)
    out = np.stack([real * cos - imaginary * sin, -(imaginary * cos + real * sin)], axis=2)
    return out.reshape(len(unit), -1), sure


def _until(rate: Array, step_s: Array) -> Array:
    """What a rate has led to in the middle of each step."""
    way = rate * step_s
    out: Array = np.cumsum(way, axis=1) - way / 2.0
    return out


def _lag(wheels: Wheels, angles: Array) -> int:
    """Steps in which a wheel usually does a third of a turn."""
    turned = np.abs(np.diff(angles, axis=2))
    turned = turned[turned > 0]
    usual = float(np.median(turned)) if len(turned) else np.pi
    return int(np.clip(round(2.0 * np.pi / 3.0 / usual), 1, max(wheels.step_s.shape[1] // 8, 1)))


@dataclass(frozen=True)
class _Fitted:
    """Least squares of each trial by itself: (trials, k) coefficients and their variance, (trials,) what is left."""

    values: Array
    variance: Array
    left: Array
    independent: Array
    """As many of the differences count as independent ones, for a wave that does a third of a turn in ``lag``."""


def _fitted(columns: Array, off: Array, used: NDArray[np.bool_], lag: int) -> _Fitted:
    """A heading (trials, steps) by ``columns`` (trials, steps, k), in differences over ``lag`` steps.

    So a heading that wanders with the motors' scatter does not pass for a wave.
    """
    gram, target, count = lagged_sums(columns, off, used, lag)
    scale = np.sqrt(np.maximum(np.einsum("nii->ni", gram), 1e-30))
    inverse = np.linalg.inv(gram / scale[:, :, None] / scale[:, None, :] + _RIDGE * np.eye(columns.shape[2]))
    values = (inverse @ (target / scale)[..., None])[..., 0] / scale
    left, product, pairs = lagged_rest(columns, off, used, lag, values, lag + lag // 2)
    independent = count / _repeated(product, pairs, lag)
    spare = np.maximum(independent - columns.shape[2], 1)
    return _Fitted(values, np.einsum("nii->ni", inverse) * (left / spare)[:, None] / scale**2, left, independent)


def _repeated(product: Array, pairs: Array, lag: int) -> float:
    """By how much neighbours raise the variance of a wave's amplitude: the spectrum of the rest at the wave over the mean one.

    The sum of the autocorrelation times the wave's own, over half a turn: 1.5 where tracking noise is white from pose to pose,
    2/3 of ``lag`` where the heading wanders.
    """
    covariance = product / np.maximum(pairs, 1.0)
    if covariance[0] <= 0.0:
        return float(lag)
    wave = np.cos(np.arange(1, len(product)) * (2.0 * np.pi / 3.0 / lag))
    return max(1.0 + 2.0 * float(covariance[1:] @ wave) / float(covariance[0]), _LEAST_REPEATED)


def _phases(columns: Array, off: Array, used: NDArray[np.bool_], lag: int) -> tuple[Array, Array]:
    """Cosine and sine of each wheel's phase, (trials, 4), by least squares with the other columns; and how sure, (trials, 2).

    How sure: the expected cosine of the phase's error.
    """
    fitted = _fitted(columns, off, used, lag)
    pair = fitted.values[:, :_WAVES]
    length2, unsure = (v[:, ::2] + v[:, 1::2] for v in (pair**2, fitted.variance[:, :_WAVES]))
    known = 2.0 * np.maximum(length2 - unsure, 0.0) / (unsure + 1e-30)  # concentration of the phase's distribution
    return pair / np.repeat(np.sqrt(length2 + 1e-30), 2, axis=1), i1e(known) / i0e(known)


def _kept(one: tuple[Array, Array], other: tuple[Array, Array]) -> Array:
    """Expected cosine of what is added to each wheel's phase between the halves of a trial, (2,): wheels do not run as told.

    A wheel that is off by some millimetres on the way has its wave shifted by as much. How well the phases of the two halves
    agree, over all trials, says how far that is; ``one``, ``other`` as `_phases` gives them.
    """
    (a, sure_a), (b, sure_b) = one, other
    product, sure = a * b, sure_a * sure_b
    agreed = sure * (product[:, ::2] + product[:, 1::2])
    cosine = (agreed.sum(axis=0) + _UNKNOWN) / ((sure**2).sum(axis=0) + _UNKNOWN)
    out: Array = np.clip(cosine, _LEAST_KEPT, 1.0) ** _BEYOND
    return out


def starts_from(wheels: Wheels) -> tuple[tuple[float, ...], ...]:
    """The ways of a turn that explain most of the heading, of `_TURNS` between a third and five times the wheelbase.

    ``wheels`` turn as the model without this effect has them. The shares are those of the waves fitted to each trial; without a
    droop, and for the best way also with the one of `_DROOPS` that explains most.
    """
    if wheels.conditions.seen is None:
        return ()
    chosen = np.unique(np.linspace(0, len(wheels.step_s) - 1, min(len(wheels.step_s), _TRIALS)).astype(int))
    some = replace(wheels, **{n: getattr(wheels, n)[chosen] for n in ("step_s", "left_m_s", "right_m_s")})
    heading = wheels.conditions.seen[chosen, :, 2]
    turns = np.geomspace(*_RANGE, _TURNS) * wheels.wheelbase_m
    found = [_explained(some, heading, turn) for turn in turns]
    score = np.pad([gain for gain, _ in found], 1)
    peaks = np.flatnonzero((score[1:-1] >= score[:-2]) & (score[1:-1] >= score[2:]))
    starts = []
    for peak in peaks[np.argsort(-score[1 + peaks])][:_PEAKS]:
        ways = [(*found[peak], 0.0)]
        if not starts:  # a droop takes long to work out
            drooping = [(*_explained(some, heading, turns[peak], droop), droop) for droop in _DROOPS]
            ways.append(max(drooping, key=lambda one: one[0]))
        starts += [(*np.clip(shares, *_SHARES).tolist(), float(turns[peak]), droop) for _, shares, droop in ways]
    return tuple(starts)


def _explained(wheels: Wheels, heading: Array, turn_m: float, droop_m_s: float = 0.0) -> tuple[float, Array]:
    """Log likelihood that waves of both wheels add, and each wheel's share.

    Whatever makes the speed of a wheel, the wheelbase or the heading's rate wrong is fitted as well, and is no wave.
    """
    turn = _Turning(wheels, np.stack([wheels.left_m_s, wheels.right_m_s]), turn_m)
    ways = [_until(speed, wheels.step_s) / wheels.wheelbase_m for speed in turn.told]
    used, lag = np.isfinite(heading), _lag(wheels, turn.angles)
    off = np.where(used, heading - (ways[1] - ways[0]), 0.0)
    columns = _columns(wheels, turn.wave(droop_m_s), np.stack([*ways, wheels.trial_s]))
    slow = np.ascontiguousarray(columns[..., _WAVES:])
    without, fitted = _fitted(slow, off, used, lag), _fitted(columns, off, used, lag)
    known = fitted.independent > columns.shape[2] + 1
    if not known.any():
        return 0.0, np.zeros(2)
    gain = fitted.independent * np.log((without.left + _RIDGE) / (fitted.left + _RIDGE))
    values, variance = (v[known, :_WAVES] for v in (fitted.values, fitted.variance))
    weight = 1.0 / (variance + np.median(variance, axis=0)) ** 2  # a wheel that hardly turned in a trial says little
    square = ((values**2 - variance) * weight).sum(axis=0) / weight.sum(axis=0)
    return float(gain[known].sum()) / 2.0, np.sqrt(np.maximum(square[::2] + square[1::2], 0.0))


def _columns(wheels: Wheels, waves_m_s: Array, others: Array) -> Array:
    """What speeds add to the heading, ``waves_m_s`` (2, n, trials, steps) of the left, then of the right wheel; then ``others``.

    ``others`` (k, trials, steps). Returns (trials, steps, 2 n + k).
    """
    rates = np.stack([-waves_m_s[0], waves_m_s[1]]) / wheels.wheelbase_m
    out: Array = led_to(rates.reshape(-1, *others.shape[1:]), others, wheels.step_s)
    return out


EFFECT = Effect(
    name="wheel-eccentricity",
    stage="wheel",
    parameters=(
        Parameter("left_share", "1", -0.9, 0.9, (-0.6, 0.6), 0.0, "amplitude of the left wheel's speed, as a fraction of it"),
        Parameter("right_share", "1", -0.9, 0.9, (-0.6, 0.6), 0.0, "amplitude of the right wheel's speed, as a fraction of it"),
        Parameter(
            "turn_m", "m", 5e-3, 20.0, (0.02, 0.6), 0.13, "distance per revolution of a wheel", size_power=1.0, resolution=1e-4
        ),
        Parameter(
            "droop_m_s",
            "m/s",
            0.0,
            _MOST_DROOP,
            (0.0, 1.0),
            0.0,
            "speed that a wheel loses per unit of slope while it lifts its load",
            reached=(0.0,),
            optional=True,
        ),
    ),
    equation="w' = w·(1 + a·cos(phi)) + a·L·sin(phi) for each wheel, d(phi)/dt = 2·pi·(w + a·L·sin(phi))/U",
    residuals="The heading oscillates with the distance driven, once per revolution of a wheel, at any speed. Where the lifted "
    "load slows the motor, most at low speed.",
    lookalikes=("wheel-mismatch", "yaw-bias"),
    sentence="an eccentric wheel speeds up and slows down once per revolution",
    measurement="mark the wheel, roll it along a ruler, and measure the height of its axle over one revolution",
    apply=apply,
    revision=2,
    needs="track",
    starts_from=starts_from,
)
