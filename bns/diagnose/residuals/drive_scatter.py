"""What a drive that wanders at random adds to the error: why it is above tracking noise where nothing systematic is left."""

from __future__ import annotations

import numpy as np

from bns.diagnose.data.tracks import Array
from bns.diagnose.predict.base import Predictor
from bns.diagnose.predict.horizons import IN_WORDS
from bns.diagnose.predict.paired_errors import PairedErrors
from bns.diagnose.settings import DEFAULTS
from bns.physics.figures import mm

NOTABLE = DEFAULTS.verdict.scatter_notable
EXPLAINS = DEFAULTS.verdict.scatter_explains


def wandering_m(predictor: Predictor, noise: Array, horizon: str) -> float:
    """Root mean square position error (m) over the windows of a horizon, by the drive's scatter alone.

    ``noise`` as `filter_gains` takes it: its last three are the scatter forward and sideways (m) and of the heading (rad), each
    per root of a metre driven. A change of heading on the way moves the end by as much as the end is away from there. NaN where
    there are no windows.
    """
    forward, sideways, heading = (float(value) ** 2 for value in noise[2:5])
    place, way_m = predictor.tracks.pose[:, :2], predictor.way_m
    squares = []
    for start, end in zip(*predictor.windows(horizon), strict=True):
        driven = slice(start + 1, end + 1)
        away = ((place[end] - place[driven]) ** 2).sum(axis=1)
        squares.append(float((way_m[driven] * (forward + sideways + heading * away)).sum()))
    return float(np.sqrt(np.mean(squares))) if squares else float("nan")


def _longer(predictor: Predictor, noise: Array, errors: PairedErrors, horizon: str) -> float:
    """By what factor the drive scatters more over a horizon than from pose to pose; 1 where that cannot be told."""
    at, by_drive = errors.horizons[horizon], wandering_m(predictor, noise, horizon)
    beyond = at.models[-1].rms_m ** 2 - at.noise_floor_m**2
    return float(np.sqrt(beyond)) / by_drive if beyond > 0 and by_drive > 0 else 1.0


def _judged(errors: PairedErrors) -> list[str]:
    return [horizon for horizon, at in errors.horizons.items() if at.windows]


def far_above_noise(errors: PairedErrors) -> bool:
    """Whether the error at the longest horizon is far above tracking noise."""
    judged = [errors.horizons[horizon] for horizon in _judged(errors)]
    return bool(judged and judged[-1].models[-1].rms_m > NOTABLE * judged[-1].noise_floor_m)


def scatter_in_words(predictor: Predictor, noise: Array, errors: PairedErrors) -> list[str]:
    """A sentence where the error at the longest horizon is far above tracking noise: does the drive's scatter make it?

    Wheels whose speeds vary over parts of a second scatter little from pose to pose, and more over seconds: what the scatter
    makes is then read from the next shorter horizon. What differs from trial to trial grows faster than a walk at random does.
    """
    if not far_above_noise(errors):
        return []
    judged = _judged(errors)
    horizon = judged[-1]
    at = errors.horizons[horizon]
    error, floor = at.models[-1].rms_m, at.noise_floor_m
    by_drive = wandering_m(predictor, noise, horizon)
    explained = np.hypot(by_drive, floor) / error
    if explained >= 1.0 / EXPLAINS:
        return [
            f"The error over {IN_WORDS[horizon]} ({mm(error, 3)}) is far above tracking noise ({mm(floor, 3)}), and "
            "no listed effect and no curve finds a pattern in it. From pose to pose, the track scatters by more: a drive "
            f"that scatters so would be {mm(by_drive, 3)} off. So its jumps take one another back, or are rare: look for a "
            "tracker whose errors last for some poses (a hidden marker, a seam between two cameras), or for something that "
            "happens at moments, such as a wheel that sticks."
        ]
    if explained <= EXPLAINS:
        over = judged[-2] if len(judged) > 1 else horizon
        longer = by_drive * _longer(predictor, noise, errors, over)
        if 1.0 / EXPLAINS > np.hypot(longer, floor) / error > EXPLAINS:
            return [
                f"The error over {IN_WORDS[horizon]} ({mm(error, 3)}) is above tracking noise ({mm(floor, 3)}) "
                f"as if the drive itself scattered: grown as a walk at random grows, the error over {IN_WORDS[over]} makes "
                f"{mm(longer, 3)}. From pose to pose it scatters less ({mm(by_drive, 3)}), as wheels do whose "
                "speeds vary over parts of a second, or a robot that something slow pushes. No listed effect and no curve finds "
                "a pattern in it. Drive the same commands several times: what they share, a model can predict."
            ]
        return [
            f"The error over {IN_WORDS[horizon]} ({mm(error, 3)}) is far above tracking noise ({mm(floor, 3)}), and "
            f"a drive that scatters as this one does from pose to pose makes only {mm(by_drive, 3)}. "
            "In the rest no listed effect and no curve finds a pattern: trials may differ from one another, or something happens "
            "at single speeds or for moments. Drive the same commands several times: how far these differ, no model can predict."
        ]
    ahead, aside, turn = noise[2], noise[3], np.degrees(noise[4])
    return [
        f"The error over {IN_WORDS[horizon]} ({mm(error, 3)}) is above tracking noise ({mm(floor, 3)}) as if the "
        f"drive itself scattered: by {mm(ahead, 3)} ahead, {mm(aside, 3)} to the side and {turn:.3g}° in the first metre, and "
        f"with the root of the way, which makes {mm(by_drive, 3)}. No listed effect and no curve finds a pattern in it. "
        "It may be chance, such as wheels that slip, or finer than these look, such as joints of a floor. Drive the same "
        "commands from the same place several times: what they share, a model can predict."
    ]


def still_left_in_words(predictor: Predictor, noise: Array, errors: PairedErrors) -> list[str]:
    """A sentence where terms describe what no effect does, and far more than noise and the drive's scatter is left with them.

    ``errors``: of the model as given first, of that with the terms last.
    """
    if not far_above_noise(errors):
        return []
    horizon = _judged(errors)[-1]
    at = errors.horizons[horizon]
    given, error, floor = at.models[0].rms_m, at.models[-1].rms_m, at.noise_floor_m
    if np.hypot(wandering_m(predictor, noise, horizon), floor) > EXPLAINS * error:
        return []
    return [
        f"With all of this the error over {IN_WORDS[horizon]} is still {mm(error, 3)} (as given {mm(given, 3)}, by "
        f"tracking noise {mm(floor, 3)}), so not all that happens is described. Something may have a state that no column "
        "shows, such as a load that has shifted or parts that have warmed up, or may happen at moments: log what could show it."
    ]
