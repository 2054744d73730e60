"""A wheel is eccentric or has a bump: its speed rises and falls once per revolution.

The angle of a wheel at the start of a trial is not logged. In a fit it is estimated from the track: the headings of each
half of a trial give the angle for the other half, so that no pose explains itself. Only the amplitude of each wheel and the
distance per revolution remain to be fitted. In a simulation the wheels begin at their fastest angle.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from bns.physics.effect import Effect, Parameter
from bns.physics.signals import Array, Wheels
from bns.physics.wheels.lagged_fit import lagged_rest, lagged_sums, led_to

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
_WAVES = 4
"""Cosine and sine for each wheel."""


def apply(wheels: Wheels, left_share: float, right_share: float, turn_m: float) -> Wheels:
    """Each wheel's speed times 1 + share·cos(2·pi·distance/``turn_m`` + phase)."""
    angles = _angles(wheels, turn_m)
    if wheels.conditions.seen is None or (left_share == 0.0 and right_share == 0.0):
        waves = np.cos(angles)
    else:
        waves = _waves(wheels, wheels.conditions.seen[..., 2], angles)
    speeds = wheels.left_m_s, wheels.right_m_s
    # the mean of a wave over a step of which the wheel turns through a good part
    means = [wave * np.sinc(speed * wheels.step_s / turn_m) for wave, speed in zip(waves, speeds, strict=True)]
    return wheels.turning(
        wheels.left_m_s * (1.0 + left_share * means[0]), wheels.right_m_s * (1.0 + right_share * means[1])
    )


def _angles(wheels: Wheels, turn_m: float) -> Array:
    """Of the left and the right wheel in the middle of each step, (2, trials, steps)."""
    way = np.stack([wheels.left_m_s, wheels.right_m_s]) * wheels.step_s
    angles: Array = (np.cumsum(way, axis=2) - way / 2.0) * (2.0 * np.pi / turn_m)
    return angles


def _waves(wheels: Wheels, heading: Array, angles: Array) -> Array:
    """cos(angle + phase) of both wheels (2, trials, steps), the phase of each half of a trial as its other half asks for.

    The wave is multiplied by the expected cosine of its phase's error, I1(k)/I0(k) of a von Mises distribution (Mardia and Jupp,
    Directional Statistics, section 3.5.4): without that, or with more, the fitted share is biased.
    """
    wave = np.stack([np.cos(angles), np.sin(angles)])
    steady = np.broadcast_to(np.arange(heading.shape[1], dtype=np.float64), heading.shape)
    columns = _columns(wheels, wave, steady[None])
    off = heading - _until((wheels.right_m_s - wheels.left_m_s) / wheels.wheelbase_m, wheels.step_s)
    seen, known = np.isfinite(heading), wheels.trial_s
    last = np.where(seen, known, -np.inf).max(axis=1, keepdims=True)
    early = known < last / 2.0
    lag = _lag(wheels, angles)
    phases = [_phases(columns, np.where(seen, off, 0.0), seen & half, lag) for half in (~early, early)]
    kept = _kept(*phases)
    pair = np.where(early, *(np.moveaxis(unit * np.repeat(sure * kept, 2, axis=1), 1, 0)[:, :, None] for unit, sure in phases))
    out: Array = pair[::2] * wave[0] + pair[1::2] * wave[1]
    return out


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
    from scipy.special import i0e, i1e  # noqa: PLC0415  # takes long to load, and most models have no such wheel

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

    ``wheels`` turn as the model without this effect has them. The shares are those of the waves fitted to each trial.
    """
    if wheels.conditions.seen is None:
        return ()
    chosen = np.unique(np.linspace(0, len(wheels.step_s) - 1, min(len(wheels.step_s), _TRIALS)).astype(int))
    some = replace(wheels, followed=None, **{n: getattr(wheels, n)[chosen] for n in ("step_s", "left_m_s", "right_m_s")})
    heading = wheels.conditions.seen[chosen, :, 2]
    turns = np.geomspace(*_RANGE, _TURNS) * wheels.wheelbase_m
    found = [_explained(some, heading, turn) for turn in turns]
    score = np.pad([one for one, _ in found], 1)
    peaks = np.flatnonzero((score[1:-1] >= score[:-2]) & (score[1:-1] >= score[2:]))
    best = peaks[np.argsort(-score[1 + peaks])][:_PEAKS]
    return tuple((*np.clip(found[i][1], *_SHARES).tolist(), float(turns[i])) for i in best)


def _explained(wheels: Wheels, heading: Array, turn_m: float) -> tuple[float, Array]:
    """Log likelihood that waves of both wheels add, and each wheel's share.

    Whatever makes the speed of a wheel, the wheelbase or the heading's rate wrong is fitted as well, and is no wave.
    """
    angles = _angles(wheels, turn_m)
    ways = [_until(speed, wheels.step_s) / wheels.wheelbase_m for speed in (wheels.left_m_s, wheels.right_m_s)]
    used, lag = np.isfinite(heading), _lag(wheels, angles)
    off = np.where(used, heading - (ways[1] - ways[0]), 0.0)
    columns = _columns(wheels, np.stack([np.cos(angles), np.sin(angles)]), np.stack([*ways, wheels.trial_s]))
    slow = np.ascontiguousarray(columns[..., _WAVES:])
    without, fitted = _fitted(slow, off, used, lag), _fitted(columns, off, used, lag)
    known = fitted.independent > columns.shape[2] + 1
    if not known.any():
        return 0.0, np.zeros(2)
    gain = fitted.independent * np.log((without.left + _RIDGE) / (fitted.left + _RIDGE))
    square = (fitted.values**2 - fitted.variance)[known, :_WAVES].mean(axis=0)
    return float(gain[known].sum()) / 2.0, np.sqrt(np.maximum(square[::2] + square[1::2], 0.0))


def _columns(wheels: Wheels, wave: Array, others: Array) -> Array:
    """What a share of 1 adds to the heading: cosine and sine of the left, then of the right wheel; then ``others``.

    ``wave`` (2, 2, trials, steps): cosine and sine of the angle of each wheel. ``others`` (m, trials, steps).
    """
    rates = np.stack([-wheels.left_m_s, wheels.right_m_s])[:, None] / wheels.wheelbase_m * wave.swapaxes(0, 1)
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
    ),
    equation="w' = w·(1 + a·cos(2·pi·distance/U + phase)) for each wheel",
    residuals="The heading oscillates with the distance driven, once per revolution of a wheel, at any speed.",
    lookalikes=("wheel-mismatch", "yaw-bias"),
    sentence="an eccentric wheel speeds up and slows down once per revolution",
    measurement="mark the wheel, roll it along a ruler, and measure the height of its axle over one revolution",
    apply=apply,
    needs="track",
    starts_from=starts_from,
)
