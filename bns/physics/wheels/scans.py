"""Recurrences along a trial, compiled: each value needs the one before it. Arrays are (batch, steps)."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from bns.engine.jit import exact
from bns.engine.pose_filter import slope
from bns.physics.signals import Array

_CIN_TERMS = 13
"""The next term at pi is below 1e-16."""
_NO_WAY = 1e-6
"""Ways below this share of the trail: the difference of two integrals would be rounding errors."""

_NO_SWING = 1e-10
"""Shares of the square of the lag below which a swing is none: its rate of decay would be lost in rounding."""
_NEARLY_EQUAL = 1e-4
"""Roots so near each other (times the step) are one: the series' next term is below 1e-16."""


@exact
def first_order(target: Array, step_s: Array, tau_s: float) -> Array:
    """Mean over each step of w, where dw/dt = (target - w)/tau and w = 0 at the start; exact."""
    mean = np.zeros_like(target)
    for row in range(target.shape[0]):
        w = 0.0
        for k in range(target.shape[1]):
            h = step_s[row, k]
            if h == 0.0:
                continue
            settled = -np.expm1(-h / tau_s)
            mean[row, k] = target[row, k] + (w - target[row, k]) * settled * tau_s / h
            w += (target[row, k] - w) * settled
    return mean


@exact
def low_passed(values: Array, t_s: Array, is_first: NDArray[np.bool_], tau_s: float) -> Array:
    """y at every frame, (frames, 3), where dy/dt = (x - y)/tau and y = x where a trial begins; x is straight between frames."""
    out = np.empty_like(values)
    for k in range(values.shape[0]):
        if is_first[k] or t_s[k] <= t_s[k - 1]:
            out[k] = values[k]
            continue
        h = t_s[k] - t_s[k - 1]
        left = np.exp(-h / tau_s)
        for i in range(values.shape[1]):
            behind = (values[k, i] - values[k - 1, i]) / h * tau_s
            out[k, i] = values[k, i] - behind + (out[k - 1, i] - values[k - 1, i] + behind) * left
    return out


@exact
def second_order(target: Array, step_s: Array, tau_s: float, lead_s: float, swing_s: float) -> Array:
    """Mean over each step of w = y + lead·y', where swing²·y'' + (tau + lead)·y' + y = target and y = y' = 0 at the start; exact.

    By the equation's two roots; y and y' do not jump with the target, and the equation itself gives the integral of y.
    """
    mean = np.zeros_like(target)
    total_s, square = tau_s + lead_s, swing_s * swing_s
    if square <= _NO_SWING * total_s * total_s:
        square = 0.0
    fall = total_s / (2.0 * square) if square > 0.0 else 0.0
    apart = fall * fall - 1.0 / square if square > 0.0 else 0.0
    for row in range(target.shape[0]):
        y = rise = 0.0
        for k in range(target.shape[1]):
            h = step_s[row, k]
            if h == 0.0:
                continue
            off = y - target[row, k]
            if square == 0.0:
                after = off * np.exp(-h / total_s) if total_s > 0.0 else 0.0
                rise_after = 0.0
            else:
                even, odd = _decays(fall, apart, square, h)
                after = off * even + (rise + fall * off) * odd
                rise_after = rise * even - (fall * rise + off / square) * odd
            moved = after - off
            mean[row, k] = target[row, k] + (lead_s * moved - total_s * moved - square * (rise_after - rise)) / h
            y, rise = target[row, k] + after, rise_after
    return mean


@exact
def _decays(fall: float, apart: float, square: float, h: float) -> tuple[float, float]:
    """exp(-fall·h) times cosh(b·h) and sinh(b·h)/b with b² = ``apart``, which may be negative (cos and sin) or near 0."""
    if apart > 0.0:
        b = np.sqrt(apart)
        if b * h > _NEARLY_EQUAL:
            slow, fast = np.exp(-h / (square * (fall + b))), np.exp(-(fall + b) * h)
            return (slow + fast) / 2.0, (slow - fast) / (2.0 * b)
    elif apart < 0.0:
        b = np.sqrt(-apart)
        if b * h > _NEARLY_EQUAL:
            return np.exp(-fall * h) * np.cos(b * h), np.exp(-fall * h) * np.sin(b * h) / b
    x = apart * h * h  # both roots are nearly one: the series of cosh and sinh
    return np.exp(-fall * h) * (1.0 + x / 2.0), np.exp(-fall * h) * h * (1.0 + x / 6.0)


@exact
def delayed(target: Array, step_s: Array, delay_s: float, varying: bool) -> Array:
    """Mean over each step of target(t - delay), 0 before the start: the way of the target ``delay_s`` ago, differenced.

    Exact for what is constant in each step; of what is ``varying`` in it, `slope` tells how.
    """
    mean = np.zeros_like(target)
    for row in range(target.shape[0]):
        now = way = then = 0.0
        k = 0
        begun = -delay_s  # at a time ago: which step that was in (k), when it began (now), the way until then
        for i in range(target.shape[1]):
            h = step_s[row, i]
            if h == 0.0:
                continue
            ended = begun + h
            while k < target.shape[1] and now + step_s[row, k] < ended:
                way += target[row, k] * step_s[row, k]
                now += step_s[row, k]
                k += 1
            at = way
            if ended > now and k < target.shape[1]:
                into, whole = ended - now, step_s[row, k]
                at += target[row, k] * into
                if varying and into < whole:
                    at -= slope(target, step_s, row, k) * into * (whole - into) / 2.0
            if ended <= 0.0:
                at = 0.0
            mean[row, i] = (at - then) / h
            then, begun = at, ended
    return mean


@exact
def averaged(target: Array, step_s: Array, from_s: float, to_s: float) -> Array:
    """Mean over each step of the target's mean from ``from_s`` to ``to_s`` ago (the smaller first), 0 before the start; exact."""
    mean = np.zeros_like(target)
    for row in range(target.shape[0]):
        for end in range(2):
            sign, ago_s = (1.0, from_s) if end == 0 else (-1.0, to_s)
            now = way = area = then = 0.0  # when step k began, the way until then, the way's integral; that integral at ``begun``
            k, begun = 0, -ago_s
            for i in range(target.shape[1]):
                h = step_s[row, i]
                if h == 0.0:
                    continue
                ended = begun + h
                while k < target.shape[1] and now + step_s[row, k] < ended:
                    area += (way + target[row, k] * step_s[row, k] / 2.0) * step_s[row, k]
                    way += target[row, k] * step_s[row, k]
                    now += step_s[row, k]
                    k += 1
                at, into = area, ended - now
                if into > 0.0:
                    at += way * into
                    if k < target.shape[1]:
                        at += target[row, k] * into * into / 2.0
                mean[row, i] += sign * (at - then) / (h * (to_s - from_s))
                then, begun = at, ended
    return mean


@exact
def rate_limited(target: Array, step_s: Array, limit: float) -> Array:
    """Mean over each step of w, which follows the target with |dw/dt| <= limit, from 0; exact."""
    mean = np.zeros_like(target)
    for row in range(target.shape[0]):
        w = 0.0
        for k in range(target.shape[1]):
            h, gap = step_s[row, k], target[row, k] - w
            if h == 0.0:
                continue
            ramp_s = abs(gap) / limit
            if ramp_s <= h:
                mean[row, k] = target[row, k] - gap * ramp_s / (2.0 * h)
                w = target[row, k]
            else:
                mean[row, k] = w + np.sign(gap) * limit * h / 2.0
                w += np.sign(gap) * limit * h
    return mean


@exact
def flow_along(start: Array, moved: Array, moving_s: Array, flow: float, return_per_s: float) -> Array:
    """Positions (batch, steps + 1) of one axis: ``moved`` metres a step, and flow - return·position.

    ``moving_s`` is the time of each step during which the flow acts. Exact for constant velocity in a step.
    """
    nodes = np.empty((moved.shape[0], moved.shape[1] + 1))
    for row in range(moved.shape[0]):
        position = start[row]
        nodes[row, 0] = position
        for k in range(moved.shape[1]):
            time = moving_s[row, k]
            change = moved[row, k] + (flow - return_per_s * position) * time
            decay = return_per_s * time
            if decay > 0.0:
                change *= -np.expm1(-decay) / decay
            position += change
            nodes[row, k + 1] = position
    return nodes


@exact
def sampled(target: Array, step_s: Array, period_s: float) -> Array:
    """Mean over each step of the target as it was at the last multiple of ``period_s``, counted from the start; exact."""
    mean = np.zeros_like(target)
    for row in range(target.shape[0]):
        now, tick, held = 0.0, 0.0, 0.0
        for k in range(target.shape[1]):
            h = step_s[row, k]
            if h == 0.0:
                continue
            way, at, end = 0.0, now, now + h
            while tick < end - 1e-9:  # a tick that falls on the step's end belongs to the next one
                way += held * max(tick - at, 0.0)
                at = max(tick, at)
                held = target[row, k]
                tick += period_s
            mean[row, k] = (way + held * (end - at)) / h
            now = end
    return mean


@exact
def played(target: Array, step_s: Array, gap: float, begin: float) -> Array:
    """Mean over each step of what is driven through a gap (play), exact; at the start ``begin`` of it lies behind.

    That is all of it where the forward side touches.
    """
    mean = np.zeros_like(target)
    for row in range(target.shape[0]):
        tooth = begin
        for k in range(target.shape[1]):
            h = step_s[row, k]
            if h == 0.0:
                continue
            pushed = tooth + target[row, k] * h
            tooth = min(max(pushed, 0.0), gap)
            mean[row, k] = (pushed - tooth) / h
    return mean


@exact
def crossings(along: Array, step_s: Array, ahead: Array, spacing: float, over: float) -> Array:
    """How many multiples of ``spacing`` are passed in each step the way that ``ahead`` (1, -1) says, each over a way of ``over``.

    ``along`` is where something is in the middle of each step, on a straight line between two; it goes on beyond the first and
    the last one as it comes in and goes out. What is not known (NaN) passes none.
    """
    passed = np.zeros_like(along)
    wide = min(over / spacing, 1.0)
    for row in range(along.shape[0]):
        last = -1
        for k in range(along.shape[1]):
            if step_s[row, k] > 0.0:
                last = k
        begin, behind = np.nan, np.nan
        for k in range(last + 1):
            if k < last:
                whole = step_s[row, k] + step_s[row, k + 1]
                share = step_s[row, k] / whole if whole > 0.0 else 0.0
                end = along[row, k] + share * (along[row, k + 1] - along[row, k])
            else:
                end = 2.0 * along[row, k] - begin if last > 0 else along[row, k]
            if k == 0:
                begin = 2.0 * along[row, 0] - end if last > 0 else along[row, 0]
                behind = _multiples(begin / spacing, wide)
            if np.isnan(behind) and not np.isnan(begin):
                behind = _multiples(begin / spacing, wide)
            now = _multiples(end / spacing, wide) if not np.isnan(end) else np.nan
            way = (now - behind) * ahead[row, k]
            if step_s[row, k] > 0.0 and way > 0.0:
                passed[row, k] = way
            begin, behind = end, now
    return passed


@exact
def _multiples(at: float, wide: float) -> float:
    nearest = np.rint(at)
    return float(nearest + min(max((at - nearest) / wide, -0.5), 0.5))


@exact
def reversed_since(speed: Array, step_s: Array) -> Array:
    """Way since the speed last changed its sign, in the middle of each step; -1 before it first does."""
    out = np.zeros_like(speed)
    for row in range(speed.shape[0]):
        way, sign = -1.0, 0.0
        for k in range(speed.shape[1]):
            now = np.sign(speed[row, k])
            if now * sign < 0.0:
                way = 0.0
            if now != 0.0:
                sign = now
            moved = abs(speed[row, k]) * step_s[row, k]
            out[row, k] = way if way < 0.0 else way + moved / 2.0
            if way >= 0.0:
                way += moved
    return out


@exact
def trailing(angle: Array, way: Array, trail: float) -> Array:
    """By how much an angle is off one that follows it the short way round, with the way: d(follower) = off·d(way)/trail.

    In the middle of each step, (batch, steps); the follower begins at 0.
    """
    out = np.zeros_like(angle)
    for row in range(angle.shape[0]):
        follower = 0.0
        for k in range(angle.shape[1]):
            if way[row, k] == 0.0:
                continue
            off = (angle[row, k] - follower + np.pi) % (2.0 * np.pi) - np.pi
            out[row, k] = off * np.exp(-way[row, k] / (2.0 * trail))
            follower += off * -np.expm1(-way[row, k] / trail)
    return out


@exact
def swung(angle: Array, way: Array, trail: float) -> Array:
    """Mean over each step of (1 - cos(off))/2, ``off`` as in `trailing`; 0 where there is no way; exact.

    By the entire cosine integral Cin(x), the integral of (1 - cos u)/u from 0 to x: off falls as exp(-way/trail).
    """
    out = np.zeros_like(angle)
    for row in range(angle.shape[0]):
        follower = 0.0
        for k in range(angle.shape[1]):
            if way[row, k] == 0.0:
                continue
            share = way[row, k] / trail
            off = (angle[row, k] - follower + np.pi) % (2.0 * np.pi) - np.pi
            left = off * np.exp(-share)
            if share < _NO_WAY:
                out[row, k] = (1.0 - np.cos(off)) / 2.0
            else:
                out[row, k] = (_cin(off) - _cin(left)) / (2.0 * share)
            follower += off - left
    return out


@exact
def _cin(x: float) -> float:
    """The entire cosine integral for |x| <= pi, by its series: sum of (-1)^(k+1) x^(2k)/(2k (2k)!)."""
    term, total = 1.0, 0.0
    for k in range(1, _CIN_TERMS + 1):
        term *= x * x / ((2.0 * k - 1.0) * 2.0 * k)
        total += term / (2.0 * k) if k % 2 else -term / (2.0 * k)
    return total


@exact
def accumulated(rate: Array, step_s: Array, begin_s: Array, order: NDArray[np.int64], fade_s: float) -> Array:
    """Mean over each step of s, where ds/dt = rate - s/fade, from one trial on to the next; exact.

    ``begin_s`` (batch,): when each trial began; ``order`` (batch,): the trials by that time. s is 0 before the first.
    """
    mean = np.zeros_like(rate)
    s, now = 0.0, begin_s[order[0]] if len(order) else 0.0
    for row in order:
        s *= np.exp(-max(begin_s[row] - now, 0.0) / fade_s)
        now = begin_s[row]
        for k in range(rate.shape[1]):
            h = step_s[row, k]
            if h == 0.0:
                continue
            settled, end = -np.expm1(-h / fade_s), rate[row, k] * fade_s
            mean[row, k] = end + (s - end) * settled * fade_s / h
            s += (end - s) * settled
            now += h
    return mean


def carried_on(rate: Array, step_s: Array, session_s: Array | None, fade_s: float) -> Array:
    """`accumulated` from trial to trial by the time of the session in every step; each trial from 0 where that is not known."""
    if session_s is not None:
        begin = session_s[:, 0] - step_s[:, 0] / 2.0
        return accumulated(rate, step_s, begin, np.argsort(begin, kind="stable"), fade_s)
    first, alone = np.zeros(1), np.zeros(1, dtype=np.int64)
    trials = [accumulated(rate[i : i + 1], step_s[i : i + 1], first, alone, fade_s) for i in range(len(rate))]
    return np.concatenate(trials) if trials else rate


@exact
def limited_together(left: Array, right: Array, step_s: Array, straight: float, turning: float) -> tuple[Array, Array]:
    """Mean over each step of the speeds of two wheels of one body; each follows its target as fast as its force allows.

    From 0; exact. Both wheels in one direction change by ``straight`` (m/s^2), against each other by ``turning``. A wheel that
    keeps its speed holds against the other, which then changes by the harmonic mean of the two.
    """
    mean_left, mean_right = np.zeros_like(left), np.zeros_like(right)
    alone = 2.0 * straight * turning / (straight + turning)
    for row in range(left.shape[0]):
        w, v = 0.0, 0.0
        for k in range(left.shape[1]):
            h = step_s[row, k]
            if h == 0.0:
                continue
            rest_s, way_w, way_v = h, 0.0, 0.0
            for _ in range(3):  # until one wheel is there, until both are, and from then on
                gap_w, gap_v = left[row, k] - w, right[row, k] - v
                limit = alone if gap_w == 0.0 or gap_v == 0.0 else straight if gap_w * gap_v > 0.0 else turning
                t_w, t_v = abs(gap_w) / limit, abs(gap_v) / limit
                t = rest_s
                if gap_w != 0.0:
                    t = min(t, t_w)
                if gap_v != 0.0:
                    t = min(t, t_v)
                way_w += w * t + np.sign(gap_w) * limit * t * t / 2.0
                way_v += v * t + np.sign(gap_v) * limit * t * t / 2.0
                w = left[row, k] if t == t_w or gap_w == 0.0 else w + np.sign(gap_w) * limit * t
                v = right[row, k] if t == t_v or gap_v == 0.0 else v + np.sign(gap_v) * limit * t
                rest_s -= t
                if rest_s <= 0.0:
                    break
            mean_left[row, k], mean_right[row, k] = way_w / h, way_v / h
    return mean_left, mean_right
