"""Following a track: the path of a model at the times of frames, and a filter that says what each frame adds."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from bns.engine.jit import exact

Array = NDArray[np.float64]


ASTRAY = 20.0
ASTRAY_FRAMES = 4
"""So many frames in a row so many standard deviations away: the filter began at a mistaken marker, and begins anew."""
TRUSTED = 5.0
"""A frame pulls the filter no harder than one this many standard deviations away."""

_NEAR = 0.25
"""Up to this angle (rad) a few terms of the series give cosine and sine to the last digit."""


@exact
def _rotation(angle: float) -> tuple[float, float]:
    """Cosine and sine. Turns between frames are small: their series costs a third of the library's functions."""
    if abs(angle) > _NEAR:
        return np.cos(angle), np.sin(angle)
    q = angle * angle
    c = 1 - q * (1 / 2 - q * (1 / 24 - q * (1 / 720 - q * (1 / 40320 - q * (1 / 3628800 - q / 479001600)))))
    s = 1 - q * (1 / 6 - q * (1 / 120 - q * (1 / 5040 - q * (1 / 362880 - q * (1 / 39916800 - q / 6227020800)))))
    return c, angle * s


@exact
def slope(mean: Array, step_s: Array, row: int, k: int) -> float:
    """How fast a velocity rises within step k, from its means there and in the steps beside it; 0 at the ends of the grid.

    The harmonic mean of the slopes to either side, 0 where they differ in sign: what jumps at the end of a step stays constant
    up to there (van Leer, Journal of Computational Physics 14, 1974: "Towards the ultimate conservative difference scheme II").
    """
    if k == 0 or k + 1 >= mean.shape[1] or step_s[row, k - 1] == 0.0 or step_s[row, k + 1] == 0.0:
        return 0.0
    before = 2.0 * (mean[row, k] - mean[row, k - 1]) / (step_s[row, k] + step_s[row, k - 1])
    after = 2.0 * (mean[row, k + 1] - mean[row, k]) / (step_s[row, k] + step_s[row, k + 1])
    if before * after <= 0.0:
        return 0.0
    return 2.0 * before * after / (before + after)


@exact
def _bent(share: float, rise: float, mean: float, h: float) -> float:
    """Share of a step's way after a share of its time, where the velocity rises so fast around its mean."""
    if rise == 0.0 or mean == 0.0:
        return share
    return share + rise * h / (2.0 * mean) * share * (share - 1.0)


@exact
def followed(
    step_s: Array,
    forward_m_s: Array,
    sideways_m_s: Array,
    yaw_rad_s: Array,
    moving: Array,
    trial: NDArray[np.int64],
    t_s: Array,
) -> tuple[Array, Array]:
    """Poses (frames, 3) at the times of frames, from (0, 0, 0) at rest; and sums over the time in motion, (frames, 3).

    The sums are of 1, x and y: how long the robot was in motion (s), and where (m s). Velocities are (trials, steps), means over
    each step, driven as arcs; ``trial`` (frames,) never falls. Between the ends of a step the path is taken as straight, and
    driven as the velocities in the steps beside it tell (`slope`); beyond the ends of the grid it is held.
    """
    poses, sums = np.empty((len(t_s), 3)), np.empty((len(t_s), 3))
    row, k, begun, ended = -1, 0, 0.0, 0.0
    x0 = y0 = h0 = m0 = px0 = py0 = x1 = y1 = h1 = m1 = px1 = py1 = 0.0
    c1, s1 = 1.0, 0.0  # of h1, turned on with it
    for i in range(len(t_s)):
        if trial[i] != row or t_s[i] < begun:
            row, k, begun, ended = trial[i], 0, 0.0, 0.0
            x1 = y1 = h1 = m1 = px1 = py1 = 0.0
            x0, y0, h0, m0, px0, py0 = x1, y1, h1, m1, px1, py1
            c1, s1 = 1.0, 0.0
        while ended < t_s[i] and k < step_s.shape[1]:
            h = step_s[row, k]
            if h > 0.0:
                x0, y0, h0, m0, px0, py0, begun = x1, y1, h1, m1, px1, py1, ended
                turned = yaw_rad_s[row, k] * h
                half = turned / 2.0
                ch, sh = _rotation(half)
                chord = h
                if abs(half) > 1e-4:
                    chord = h * sh / half
                cm, sm = c1 * ch - s1 * sh, s1 * ch + c1 * sh  # half way
                c1, s1 = cm * ch - sm * sh, sm * ch + cm * sh
                c, s = cm * chord, sm * chord
                x1 = x0 + forward_m_s[row, k] * c + sideways_m_s[row, k] * s
                y1 = y0 + forward_m_s[row, k] * s - sideways_m_s[row, k] * c
                h1 = h0 + turned
                m1 = m0 + moving[row, k] * h
                px1 = px0 + (m1 - m0) * (x0 + x1) / 2.0
                py1 = py0 + (m1 - m0) * (y0 + y1) / 2.0
                ended = begun + h
            k += 1
        share = 0.0
        if ended > begun:
            share = min(max((t_s[i] - begun) / (ended - begun), 0.0), 1.0)
        driven, turned_by = share, share
        if 0.0 < share < 1.0:
            driven = _bent(share, slope(forward_m_s, step_s, row, k - 1), forward_m_s[row, k - 1], ended - begun)
            turned_by = _bent(share, slope(yaw_rad_s, step_s, row, k - 1), yaw_rad_s[row, k - 1], ended - begun)
        dx, dy, dm = driven * (x1 - x0), driven * (y1 - y0), share * (m1 - m0)
        poses[i, 0], poses[i, 1], poses[i, 2] = x0 + dx, y0 + dy, h0 + turned_by * (h1 - h0)
        sums[i, 0], sums[i, 1], sums[i, 2] = m0 + dm, px0 + dm * (x0 + dx / 2.0), py0 + dm * (y0 + dy / 2.0)
    return poses, sums


@exact
def displacements(poses: Array, is_first: NDArray[np.bool_]) -> Array:
    """What each frame's pose (frames, 3) is from the one before, in the robot's frame there: forward, left, turn; (frames, 3).

    Zeros where a trial begins.
    """
    out = np.zeros((len(poses), 3))
    c, s = 1.0, 0.0
    for k in range(len(poses)):
        if k == 0 or is_first[k]:
            c, s = np.cos(poses[k, 2]), np.sin(poses[k, 2])
            continue
        dx, dy, turn = poses[k, 0] - poses[k - 1, 0], poses[k, 1] - poses[k - 1, 1], poses[k, 2] - poses[k - 1, 2]
        out[k, 0], out[k, 1], out[k, 2] = c * dx + s * dy, c * dy - s * dx, turn
        ct, st = _rotation(turn)
        c, s = c * ct - s * st, s * ct + c * st
    return out


@exact
def filter_gains(
    body: Array, is_first: NDArray[np.bool_], way_m: Array, noise: Array
) -> tuple[Array, Array, Array]:
    """An extended Kalman filter over x, y, heading, as far as it does not depend on what is seen.

    ``body`` (frames, 3) is the displacement since the frame before, ``way_m`` (frames,) the way of the wheels. ``noise``:
    standard deviations of a tracked position (m) and heading (rad), then of the drive's scatter forward, sideways (m) and of its
    heading (rad), each per square root of a metre driven. Returns, in the robot's frame (forward, left, heading): gains
    (frames, 3, 3), inverse Cholesky factors of the innovations' covariance (frames, 3, 3), its half log determinant (frames,).
    """
    n = len(body)
    gain, whiten, logdet = np.zeros((n, 3, 3)), np.zeros((n, 3, 3)), np.zeros(n)
    r, rh = noise[0] ** 2, noise[1] ** 2
    p00 = p01 = p02 = p11 = p12 = p22 = 0.0
    for k in range(n):
        if is_first[k]:
            p00, p01, p02, p11, p12, p22 = r, 0.0, 0.0, r, 0.0, rh
            continue
        dx, dy = body[k, 0], body[k, 1]
        # heading uncertainty turns the displacement
        p00, p01 = p00 - 2.0 * dy * p02 + dy * dy * p22, p01 + dx * p02 - dy * p12 - dx * dy * p22
        p11 = p11 + 2.0 * dx * p12 + dx * dx * p22
        p02, p12 = p02 - dy * p22, p12 + dx * p22
        # into the frame of the robot at this frame
        c, s = np.cos(body[k, 2]), np.sin(body[k, 2])
        t00 = c * c * p00 + 2.0 * c * s * p01 + s * s * p11
        t11 = s * s * p00 - 2.0 * c * s * p01 + c * c * p11
        p01 = c * s * (p11 - p00) + (c * c - s * s) * p01
        p00 = t00 + noise[2] ** 2 * way_m[k]
        p11 = t11 + noise[3] ** 2 * way_m[k]
        p02, p12 = c * p02 + s * p12, c * p12 - s * p02
        p22 += noise[4] ** 2 * way_m[k]
        s00, s11, s22 = p00 + r, p11 + r, p22 + rh
        # the heading is whitened first, so that what is left of the position is free of it
        l22 = np.sqrt(s22)
        l20, l21 = p02 / l22, p12 / l22
        l00 = np.sqrt(s00 - l20 * l20)
        l10 = (p01 - l20 * l21) / l00
        l11 = np.sqrt(s11 - l21 * l21 - l10 * l10)
        whiten[k, 0, 0], whiten[k, 0, 2] = 1.0 / l00, -l20 / (l00 * l22)
        whiten[k, 1, 0], whiten[k, 1, 1] = -l10 / (l00 * l11), 1.0 / l11
        whiten[k, 1, 2] = (-l21 / l22 + l10 * l20 / (l00 * l22)) / l11
        whiten[k, 2, 2] = 1.0 / l22
        logdet[k] = np.log(l00 * l11 * l22)
        # S^-1 from its adjugate; gain = P S^-1, and what is left of P is R - R S^-1 R with R diagonal
        i00, i01, i02 = s11 * s22 - p12 * p12, p02 * p12 - p01 * s22, p01 * p12 - p02 * s11
        i11, i12, i22 = s00 * s22 - p02 * p02, p01 * p02 - s00 * p12, s00 * s11 - p01 * p01
        det = s00 * i00 + p01 * i01 + p02 * i02
        i00, i01, i02, i11, i12, i22 = i00 / det, i01 / det, i02 / det, i11 / det, i12 / det, i22 / det
        gain[k, 0, 0] = p00 * i00 + p01 * i01 + p02 * i02
        gain[k, 0, 1] = p00 * i01 + p01 * i11 + p02 * i12
        gain[k, 0, 2] = p00 * i02 + p01 * i12 + p02 * i22
        gain[k, 1, 0] = p01 * i00 + p11 * i01 + p12 * i02
        gain[k, 1, 1] = p01 * i01 + p11 * i11 + p12 * i12
        gain[k, 1, 2] = p01 * i02 + p11 * i12 + p12 * i22
        gain[k, 2, 0] = p02 * i00 + p12 * i01 + p22 * i02
        gain[k, 2, 1] = p02 * i01 + p12 * i11 + p22 * i12
        gain[k, 2, 2] = p02 * i02 + p12 * i12 + p22 * i22
        p00, p01, p02 = r - r * r * i00, -r * r * i01, -r * rh * i02
        p11, p12, p22 = r - r * r * i11, -r * rh * i12, rh - rh * rh * i22
    return gain, whiten, logdet


@exact
def innovations(
    body: Array, drift_m: Array, pose: Array, is_first: NDArray[np.bool_], gain: Array, whiten: Array
) -> Array:
    """What each frame says that could not be foreseen from those before it, whitened, (frames, 3).

    Each frame is foreseen from the filter's pose at the one before and the displacement ``body``, ``drift_m`` that a model
    predicts; with a true model and Gaussian noise the entries (forward, left, heading; in the robot's frame) are
    independent standard normal numbers. Zeros where a trial begins.
    """
    white = np.zeros((len(pose), 3))
    x = y = th = 0.0
    c, s = 1.0, 0.0  # of th, turned on with it
    astray = 0
    for k in range(len(pose)):
        if is_first[k] or astray == ASTRAY_FRAMES:
            x, y, th = pose[k, 0], pose[k, 1], pose[k, 2]
            c, s = np.cos(th), np.sin(th)
            astray = 0
            continue
        x += c * body[k, 0] - s * body[k, 1] + drift_m[k, 0]
        y += s * body[k, 0] + c * body[k, 1] + drift_m[k, 1]
        th += body[k, 2]
        ct, st = _rotation(body[k, 2])
        c, s = c * ct - s * st, s * ct + c * st
        ex, ey, eh = pose[k, 0] - x, pose[k, 1] - y, pose[k, 2] - th
        if abs(eh) > np.pi:
            eh -= 2.0 * np.pi * np.round(eh / (2.0 * np.pi))
        e0, e1 = c * ex + s * ey, c * ey - s * ex
        w0 = whiten[k, 0, 0] * e0 + whiten[k, 0, 2] * eh
        w1 = whiten[k, 1, 0] * e0 + whiten[k, 1, 1] * e1 + whiten[k, 1, 2] * eh
        w2 = whiten[k, 2, 2] * eh
        white[k, 0], white[k, 1], white[k, 2] = w0, w1, w2
        squared = w0 * w0 + w1 * w1 + w2 * w2
        astray = astray + 1 if squared > ASTRAY * ASTRAY else 0
        if squared > TRUSTED * TRUSTED:  # a marker that jumped must not carry the filter away
            pull = TRUSTED / np.sqrt(squared)
            e0, e1, eh = e0 * pull, e1 * pull, eh * pull
        u0 = gain[k, 0, 0] * e0 + gain[k, 0, 1] * e1 + gain[k, 0, 2] * eh
        u1 = gain[k, 1, 0] * e0 + gain[k, 1, 1] * e1 + gain[k, 1, 2] * eh
        x += c * u0 - s * u1
        y += s * u0 + c * u1
        u2 = gain[k, 2, 0] * e0 + gain[k, 2, 1] * e1 + gain[k, 2, 2] * eh
        th += u2
        ct, st = _rotation(u2)
        c, s = c * ct - s * st, s * ct + c * st
    return white
