"""Is the mended model as good as the true one? Both predict new trials of the same world, in the benchmark's own equations."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from tests.hidden_effects.answer import Answer
from tests.hidden_effects.camera import Camera, Layout
from tests.hidden_effects.cause import Cause
from tests.hidden_effects.driving import Driving
from tests.hidden_effects.listed import LISTED, cause
from tests.hidden_effects.luck import luck
from tests.hidden_effects.motion import Paths, move
from tests.hidden_effects.world import World

HORIZONS_S = (1.0, 5.0, np.inf)
FRESH = 1_000_003
"""Added to the seed: trials that no diagnosis has seen."""
STEP_S = 2e-3


def ratios(world: World, answer: Answer) -> dict[str, float] | None:
    """Error of the mended model over that of the true one at each horizon; None where either cannot be simulated."""
    fitted = _fitted(answer)
    if world.unlisted or fitted is None:
        return None
    fresh = replace(world, seed=world.seed + FRESH, trials=40, layout=Layout(), camera=_plain(world.camera))
    driving, true = fresh.driving(), fresh.causes()
    measured = _measured(fresh, driving, true)
    errors = [_errors(_predicted(fresh, driving, causes), measured) for causes in (fitted, true)]
    return {_name(at): float(a / b) for at, a, b in zip(HORIZONS_S, *errors, strict=True)}


def _name(horizon_s: float) -> str:
    return f"{horizon_s:g} s" if np.isfinite(horizon_s) else "whole trial"


def _fitted(answer: Answer) -> list[Cause] | None:
    """None where the product accepted what this benchmark cannot simulate: a formula, say."""
    told = bool(answer.parameters) == (answer.verdict != "none")
    if answer.verdict not in {"none", "effects", "tie"} or not told or set(answer.parameters) - set(LISTED):
        return None
    values = {
        effect: {name: float(reported["value"]) for name, reported in parameters.items()}
        for effect, parameters in answer.parameters.items()
    }
    try:
        return [cause(effect, values[effect]) for effect in LISTED if effect in values]
    except TypeError:  # parameters of other names
        return None


def _plain(camera: Camera) -> Camera:
    return replace(camera, lost=0.0, outliers=0.0, stamp_s=0.0)


def _times(driving: Driving, horizon_s: float) -> np.ndarray:
    """(n,) when the error of each trial is taken."""
    return np.minimum(horizon_s, driving.ends_s)


def _measured(world: World, driving: Driving, causes: Sequence[Cause]) -> list[np.ndarray]:
    rng = luck(world.seed, world.name, "camera")
    noise = rng.normal(0, world.camera.position_m, (len(HORIZONS_S), world.trials, 2))
    return [places + more for places, more in zip(_seen(world.true_paths()[1], driving, causes), noise, strict=True)]


def _predicted(world: World, driving: Driving, causes: Sequence[Cause]) -> list[np.ndarray]:
    still = np.zeros_like(driving.wheels_m_s)
    rng = luck(world.seed, world.name, "prediction")
    paths = move(driving, world.nominal.wheelbase_m, causes, still, rng, step_s=STEP_S)
    return _seen(paths, driving, causes)


def _seen(paths: Paths, driving: Driving, causes: Sequence[Cause]) -> list[np.ndarray]:
    """How far the tracked point is from where it was first seen, in the frame of the robot there; (n, 2) at each horizon.

    What a camera does to the first pose is nobody's prediction: models that agree on all that follows are equally good.
    """
    first = _tracked(paths, np.zeros(len(driving.counts)), causes)
    return [_from(first, _tracked(paths, _times(driving, horizon), causes)) for horizon in HORIZONS_S]


def _tracked(paths: Paths, stamps_s: np.ndarray, causes: Sequence[Cause]) -> np.ndarray:
    """Tracked poses (n, 3), one a trial, as stamped."""
    poses = np.concatenate([paths.stamped(trial, stamps_s[trial : trial + 1], causes) for trial in range(len(stamps_s))])
    for each in causes:
        poses = each.seen(poses)
    return poses


def _from(first: np.ndarray, then: np.ndarray) -> np.ndarray:
    away, cos, sin = then[:, :2] - first[:, :2], np.cos(first[:, 2]), np.sin(first[:, 2])
    return np.stack([cos * away[:, 0] + sin * away[:, 1], cos * away[:, 1] - sin * away[:, 0]], axis=1)


def _errors(predicted: list[np.ndarray], measured: list[np.ndarray]) -> list[float]:
    """Root mean square distance (m) at each horizon, or at a trial's end where it is shorter."""
    return [float(np.sqrt(np.mean(np.sum((a - b) ** 2, axis=1)))) for a, b in zip(predicted, measured, strict=True)]
