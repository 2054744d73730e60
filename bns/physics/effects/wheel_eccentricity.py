"""A wheel is eccentric or has a bump: its speed rises and falls once per revolution.

The angle of a wheel at the start of a trial is not logged. In a fit it is estimated from the track: the headings of each
half of a trial give the angle for the other half, so that no pose explains itself. Only the amplitude of each wheel and the
distance per revolution remain to be fitted. In a simulation the wheels begin at their fastest angle.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.special import i0e, i1e

from bns.physics.effect import Effect, Parameter
from bns.physics.signals import Array, Wheels

_RIDGE = 1e-9
_RANGE, _TURNS = (0.33, 5.0), 72
"""Ways of a turn that are looked at, in wheelbases: 4 % apart, as many as some nine turns in a trial can tell apart."""
_TRIALS, _PEAKS, _BEND = 24, 2, 3
"""So many trials are looked at, and so many of the best for each wheel tried; slower errors are a cubic of time."""


def apply(wheels: Wheels, left_share: float, right_share: float, turn_m: float) -> Wheels:
    """Each wheel's speed times 1 + share·cos(2·pi·distance/``turn_m`` + phase)."""
    angles = [_angle(speed, wheels.step_s, turn_m) for speed in (wheels.left_m_s, wheels.right_m_s)]
    if wheels.conditions.seen is None or (left_share == 0.0 and right_share == 0.0):
        waves = [np.cos(angle) for angle in angles]
    else:
        waves = _waves(wheels, wheels.conditions.seen[..., 2], angles)
    return wheels.turning(
        wheels.left_m_s * (1.0 + left_share * waves[0]), wheels.right_m_s * (1.0 + right_share * waves[1])
    )


def _angle(speed: Array, step_s: Array, turn_m: float) -> Array:
    """In the middle of each step."""
    way = speed * step_s
    angle: Array = (np.cumsum(way, axis=1) - way / 2.0) * (2.0 * np.pi / turn_m)
    return angle


def _waves(wheels: Wheels, heading: Array, angles: list[Array]) -> list[Array]:
    """cos(angle + phase) of both wheels, the phase of each half of a trial as its other half asks for.

    The wave is multiplied by the expected cosine of its phase's error, I1(k)/I0(k) of a von Mises distribution (Mardia and Jupp,
    Directional Statistics, section 3.5.4): without that, or with more, the fitted share is biased.
    """
    rates = [-wheels.left_m_s / wheels.wheelbase_m, wheels.right_m_s / wheels.wheelbase_m]
    parts = [rate * wave for rate, angle in zip(rates, angles, strict=True) for wave in (np.cos(angle), np.sin(angle))]
    columns = np.stack([_until(part, wheels.step_s) for part in parts], axis=2)
    off = heading - _until(rates[0] + rates[1], wheels.step_s)
    seen, known = np.isfinite(heading), wheels.trial_s
    last = np.where(seen, known, -np.inf).max(axis=1, keepdims=True)
    early = known < last / 2.0
    lag = _lag(wheels, angles)
    pairs = [_pairs(columns, np.where(seen, off, 0.0), seen & half, lag) for half in (~early, early)]
    pair = np.where(early[..., None], pairs[0][:, None], pairs[1][:, None])
    return [pair[..., 2 * w] * np.cos(angle) + pair[..., 2 * w + 1] * np.sin(angle) for w, angle in enumerate(angles)]


def _until(rate: Array, step_s: Array) -> Array:
    """What a rate has led to in the middle of each step."""
    way = rate * step_s
    out: Array = np.cumsum(way, axis=1) - way / 2.0
    return out


def _lag(wheels: Wheels, angles: list[Array]) -> int:
    """Steps in which a wheel usually does a third of a turn."""
    turned = np.abs(np.diff(np.concatenate(angles), axis=1))
    turned = turned[turned > 0]
    usual = float(np.median(turned)) if len(turned) else np.pi
    return int(np.clip(round(2.0 * np.pi / 3.0 / usual), 1, max(wheels.step_s.shape[1] // 8, 1)))


def _pairs(columns: Array, off: Array, used: NDArray[np.bool_], lag: int) -> Array:
    """Cosine and sine part of each wheel's wave, (trials, 4): least squares beside a drift, then of length 1 or less.

    In differences over ``lag`` steps: a heading that wanders with the motors' scatter does not pass for a wave.
    """
    columns, off, used = (
        columns[:, lag:] - columns[:, :-lag],
        off[:, lag:] - off[:, :-lag],
        used[:, lag:] & used[:, :-lag],
    )
    off = off * used
    design = np.concatenate([columns, np.ones_like(off)[..., None]], axis=2) * used[..., None]
    gram = np.einsum("nki,nkj->nij", design, design)
    scale = np.sqrt(np.maximum(np.einsum("nii->ni", gram), 1e-30))
    gram = gram / scale[:, :, None] / scale[:, None, :] + _RIDGE * np.eye(5)
    inverse = np.linalg.inv(gram)
    fitted = np.einsum("nij,nj->ni", inverse, np.einsum("nki,nk->ni", design, off) / scale)
    left = (off - np.einsum("nki,ni->nk", design, fitted / scale)) * used
    spare = np.maximum(used.sum(axis=1) / lag - 5, 1)
    # neighbours overlap: as many differences as lags are independent
    variance = np.einsum("nii->ni", inverse)[:, :4] * ((left**2).sum(axis=1) / spare)[:, None] / scale[:, :4] ** 2
    pair = (fitted / scale)[:, :4]
    length2, unsure = (np.repeat(v[:, ::2] + v[:, 1::2], 2, axis=1) for v in (pair**2, variance))
    known = 2.0 * np.maximum(length2 - unsure, 0.0) / (unsure + 1e-30)  # concentration of the phase's distribution
    out: Array = pair / np.sqrt(length2 + 1e-30) * (i1e(known) / i0e(known))  # the expected cosine of its error
    return out


def starts_from(wheels: Wheels) -> tuple[tuple[float, ...], ...]:
    """The ways of a turn that explain most of the heading, of `_TURNS` between a third and five times the wheelbase."""
    if wheels.conditions.seen is None:
        return ()
    chosen = np.unique(np.linspace(0, len(wheels.step_s) - 1, min(len(wheels.step_s), _TRIALS)).astype(int))
    speeds, step_s = (wheels.left_m_s[chosen], wheels.right_m_s[chosen]), wheels.step_s[chosen]
    heading, known = wheels.conditions.seen[chosen, :, 2], wheels.trial_s[chosen]
    used = np.isfinite(heading)
    off = np.where(used, heading - _until((speeds[1] - speeds[0]) / wheels.wheelbase_m, step_s), 0.0)
    bend = np.stack([known**power for power in range(_BEND + 1)], axis=2) * used[..., None]
    turns = np.geomspace(*_RANGE, _TURNS) * wheels.wheelbase_m
    out = []
    for wheel, speed in enumerate(speeds):
        score = np.array([_explained(_wave_columns(speed, step_s, turn), bend, off) for turn in turns])
        padded = np.pad(score, 1)
        peaks = np.flatnonzero((score >= padded[:-2]) & (score >= padded[2:]))
        best = turns[peaks[np.argsort(-score[peaks])][:_PEAKS]].tolist()
        out += [(share, 0.0, turn) if wheel == 0 else (0.0, share, turn) for turn in best for share in (0.03, 0.15)]
    return tuple(out)


def _wave_columns(speed: Array, step_s: Array, turn_m: float) -> Array:
    angle = _angle(speed, step_s, turn_m)
    return np.stack([_until(speed * wave, step_s) for wave in (np.cos(angle), np.sin(angle))], axis=2)


def _explained(columns: Array, bend: Array, off: Array) -> float:
    """Squares of the heading that columns (trials, steps, k) explain, over those of ``bend`` alone, of all trials."""
    design = np.concatenate([columns * bend[..., :1], bend], axis=2)
    gram, target = np.einsum("nki,nkj->nij", design, design), np.einsum("nki,nk->ni", design, off)
    scale = np.sqrt(np.maximum(np.einsum("nii->ni", gram), 1e-30))
    gram = gram / scale[:, :, None] / scale[:, None, :] + _RIDGE * np.eye(gram.shape[1])
    target /= scale
    k = columns.shape[2]
    explained = [
        np.einsum("ni,ni->", t, np.linalg.solve(g, t[..., None])[..., 0])
        for g, t in ((gram, target), (gram[:, k:, k:], target[:, k:]))
    ]
    return float(explained[0] - explained[1])


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
