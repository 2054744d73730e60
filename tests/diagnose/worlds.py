"""Small worlds for the tests of the diagnosis: few trials, honest noise, one thing hidden or none."""

import numpy as np
import pandas as pd

from bns.physics.effects import all_effects
from bns.physics.model import Model
from bns.physics.wheels.differential_drive import observe, track

BASE_M = 0.0884
NOMINAL = Model(wheelbase_m=BASE_M, name="khepera")
FRAME_S = 0.04


def hidden(**effects):
    """The nominal robot with effects: ``hidden(motor_lag={"tau_s": 0.1})``."""
    model = NOMINAL
    for name, values in effects.items():
        model = model.with_effect(name.replace("_", "-"), **values)
    return model


USUAL = frozenset(
    ("speed-gain", "wheelbase", "wheel-mismatch", "yaw-bias", "motor-lag", "clock-offset", "command-delay", "dead-zone")
)


def all_but_rivals_of(*names):
    """What to bar so that a search weighs these effects against what looks like them, holds or extends them, and the usual ones.

    For a test of one decision: with all of the list a search takes several times as long.
    """
    catalogue = all_effects()
    left = USUAL | set(names)
    for name in names:
        looks_like = {other for other, effect in catalogue.items() if name in effect.lookalikes}
        longer = {other for other, effect in catalogue.items() if name in (effect.extends, *effect.contains)}
        left |= looks_like | longer | {*catalogue[name].lookalikes, catalogue[name].extends}
    return tuple(sorted(set(catalogue) - left))


def measured(
    model,
    trials=16,
    seed=0,
    noise=(0.0015, 0.005),
    jitter=0.004,
    ends_only=False,
    commands=5,
    speeds=(0.02, 0.2),
    straight=0.0,
    pauses=False,
):
    """A table of measurements of a model's robot: random commands, motors that vary a little, a camera at 25 Hz.

    ``straight``: the share of commands in which both wheels are told the same; ``pauses``: is every other command a stop?
    """
    rng = np.random.default_rng(seed)
    kind = (noise, jitter, ends_only, commands, speeds, straight, pauses)
    return pd.concat([_trial(model, i, rng, *kind) for i in range(trials)], ignore_index=True)


def _trial(model, number, rng, noise, jitter, ends_only, commands, speeds, straight, pauses):
    left, right = rng.uniform(*speeds, (2, commands))
    if pauses:
        left[1::2] = right[1::2] = 0.0
    if straight:
        right = np.where(rng.uniform(size=commands) < straight, left, right)
    duration = np.round(rng.uniform(0.4, 2.0, commands) / FRAME_S) * FRAME_S
    scatter = 1 + jitter * rng.normal(size=(2, commands))
    start = [*rng.uniform(-0.4, 0.4, 2), rng.uniform(-3, 3)]
    seen = track(model, [left * scatter[0]], [right * scatter[1]], [duration], dense_dt_s=FRAME_S, start=start)
    poses = observe(seen.poses[0], None, model)
    poses = poses + rng.normal(size=poses.shape) * [noise[0], noise[0], noise[1]]
    t = seen.t_s[0]
    force = np.searchsorted(np.cumsum(duration), t + 1e-9, side="right")
    told = [np.where(force < commands, u[np.minimum(force, commands - 1)], np.nan) for u in (left, right)]
    table = pd.DataFrame(
        {
            "trial": number,
            "t_s": t,
            "left_m_s": told[0],
            "right_m_s": told[1],
            "x_m": poses[:, 0],
            "y_m": poses[:, 1],
            "heading_rad": poses[:, 2],
        }
    )
    if ends_only:
        changes = np.concatenate([[True], np.diff(force) != 0])
        table = table[changes]
    return table
