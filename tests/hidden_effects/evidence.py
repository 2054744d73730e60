"""How well the data of a world can tell another explanation from the true one, whatever software looks at it.

The distance of a set of effects from the truth is the chi-square that its best parameters leave on noise-free poses, in units of
the noise that the world has: white camera noise, and jitter of the wheels, which is known up to its size and therefore free to
explain what it can at a price (generalised least squares, written as least squares over the jitter too). The robot's true
starting pose is nobody's knowledge and is free altogether. Small distance: no honest method could decide.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import replace

import numpy as np
from scipy.optimize import least_squares

from tests.hidden_effects.camera import Layout, stamps
from tests.hidden_effects.cause import Cause
from tests.hidden_effects.driving import Driving
from tests.hidden_effects.listed import cause
from tests.hidden_effects.luck import luck
from tests.hidden_effects.motion import move
from tests.hidden_effects.world import World

TRIALS, STEP_S, PLACED_STEP_S = 10, 8e-3, 0.02
PER_TRIAL = 0.5
"""Of a wheel's jitter, the part that stays through a trial, as a share of the part that changes with every command."""
FREE_START = 10.0
"""Metres and radians: as good as unknown."""

Values = dict[str, dict[str, float]]
Guess = dict[str, tuple[float, float, float, float]]

GUESSES: dict[str, Guess] = {  # parameter: (start, step, least, most)
    "speed-gain": {"gain": (1.0, 0.1, 0.3, 3.0)},
    "wheel-mismatch": {"ratio": (1.0, 0.1, 0.3, 3.0)},
    "wheelbase": {"factor": (1.0, 0.1, 0.3, 3.0)},
    "motor-lag": {"tau_s": (0.05, 0.05, 1e-3, 2.0)},
    "command-delay": {"delay_s": (0.05, 0.05, 0.0, 0.45)},
    "dead-zone": {"width_m_s": (0.004, 0.004, 0.0, 0.05)},
    "speed-limit": {"max_m_s": (0.85, 0.1, 0.2, 1.0)},
    "acceleration-limit": {"max_m_s2": (0.6, 0.3, 0.05, 50.0)},
    "turn-slip": {"slip_s": (0.02, 0.05, 0.0, 1.0)},
    "side-slip": {"slip_s": (0.0, 0.05, -1.0, 1.0)},
    "battery-sag": {"rate_per_s": (1e-5, 5e-5, 0.0, 5e-4)},
    "floor-slope": {"x_m_s": (0.0, 0.005, -0.1, 0.1), "y_m_s": (0.0, 0.005, -0.1, 0.1)},
    "carpet-drift": {"x_share": (0.0, 0.01, -0.5, 0.5), "y_share": (0.0, 0.01, -0.5, 0.5)},
    "yaw-bias": {"rate_rad_s": (0.0, 0.03, -1.0, 1.0)},
    "tether-pull": {
        "anchor_x_m": (0.8, 1.0, -12.0, 12.0),
        "anchor_y_m": (0.5, 1.0, -12.0, 12.0),
        "pull_per_s": (0.003, 0.003, 0.0, 0.5),
    },
    "clock-offset": {"offset_s": (0.0, 0.05, -0.45, 0.45)},
    "marker-offset": {"forward_m": (0.0, 0.01, -0.2, 0.2), "left_m": (0.0, 0.01, -0.2, 0.2)},
    "camera-scale": {"factor": (1.0, 0.1, 0.3, 3.0)},
    "camera-rotation": {"angle_rad": (0.0, 0.05, -1.0, 1.0)},
}
"""Where to begin with each effect, and how far a parameter may go. Limits of speed are shares of the fastest command."""


class Evidence:
    """What the data of one world says."""

    def __init__(self, world: World) -> None:
        self.world = replace(world, trials=TRIALS, camera=replace(world.camera, lost=0.0))
        self.scale = world.trials / TRIALS
        self.driving = self.world.driving()
        self.times = _times(self.world, self.driving)
        self.still = np.zeros_like(self.driving.wheels_m_s)
        self.truth = self.poses(self.world.causes())
        self.noise = _noise(self.world)
        self.free = [np.linalg.qr(rows)[0] for rows in self._nuisances()]

    def distance(self, names: Sequence[str], beside: Values | None = None) -> tuple[float, Values]:
        """(chi-square of all trials, parameters) of the best model with these effects; `beside` are not refitted."""
        fixed = [cause(name, parameters) for name, parameters in (beside or {}).items()]
        guess = [(name, key, *values) for name in names for key, values in GUESSES[name].items()]
        if not guess:
            return self._chi_square(self._rest(fixed)), {}
        start, step, least, most = (np.array([row[i] for row in guess], float) for i in range(2, 6))

        def rest(point: np.ndarray) -> np.ndarray:
            return self._rest([*fixed, *self._causes(guess, point * step)])

        found = least_squares(rest, start / step, bounds=(least / step, most / step), diff_step=1e-3, max_nfev=20)
        return self._chi_square(found.fun), self._values(guess, found.x * step)

    def poses(self, causes: Sequence[Cause], jitter: np.ndarray | None = None) -> list[np.ndarray]:
        """Noise-free tracked poses (rows, 3) of every trial."""
        step = PLACED_STEP_S if any(each.depends_on_pose for each in causes) else STEP_S
        rng = luck(self.world.seed, self.world.name, "effects")
        jitter = self.still if jitter is None else jitter
        tail = self.world.layout.tail_s
        paths = move(self.driving, self.world.nominal.wheelbase_m, causes, jitter, rng, tail, step)
        out = [paths.stamped(trial, times, causes) for trial, times in enumerate(self.times)]
        for each in causes:
            out = [each.seen(poses) for poses in out]
        return out

    def _causes(self, guess: Sequence[tuple], point: Iterable[float]) -> list[Cause]:  # type: ignore[type-arg]
        return [cause(name, parameters) for name, parameters in self._values(guess, point).items()]

    def _values(self, guess: Sequence[tuple], point: Iterable[float]) -> Values:  # type: ignore[type-arg]
        values: Values = {}
        for (name, key, *_), value in zip(guess, point, strict=True):
            share = self.world.nominal.fastest_m_s if key == "max_m_s" else 1.0
            values.setdefault(name, {})[key] = float(value) * share
        return values

    def _rest(self, causes: Sequence[Cause]) -> np.ndarray:
        """Whitened differences from the truth that the nuisances cannot explain."""
        rest = []
        for poses, true, free in zip(self.poses(causes), self.truth, self.free, strict=True):
            difference = ((poses - true) / self.noise).ravel()
            padded = np.concatenate([difference, np.zeros(len(free) - len(difference))])
            rest.append(padded - free @ (free.T @ padded))
        return np.concatenate(rest)

    def _chi_square(self, rest: np.ndarray) -> float:
        return float(self.scale * rest @ rest)

    def _nuisances(self) -> list[np.ndarray]:
        """One matrix a trial: poses' answers to jitter of one standard deviation and to the start, above a unit prior."""
        count = self.still.shape[1]
        columns = [self._answer(slice(k, k + 1), wheel, 1.0) for k in range(count) for wheel in range(2)]
        columns += [self._answer(slice(None), wheel, PER_TRIAL) for wheel in range(2)]
        stacked = [np.stack([column[trial] for column in columns], axis=1) for trial in range(TRIALS)]
        whole = [
            np.concatenate([rows, FREE_START * self._starts(trial) / self._repeated(trial)], axis=1)
            for trial, rows in enumerate(stacked)
        ]
        return [np.concatenate([rows, np.eye(rows.shape[1])]) for rows in whole]

    def _answer(self, commands: slice, wheel: int, share: float) -> list[np.ndarray]:
        small = 0.1
        jitter = self.still.copy()
        jitter[:, commands, wheel] = small * share * self.world.jitter
        moved = self.poses(self.world.causes(), jitter)
        return [((a - b) / small / self.noise).ravel() for a, b in zip(moved, self.truth, strict=True)]

    def _repeated(self, trial: int) -> np.ndarray:
        return np.tile(self.noise, len(self.truth[trial]))[:, None]

    def _starts(self, trial: int) -> np.ndarray:
        """(3 rows, 3): shift east, shift north, turn about the first pose."""
        away = self.truth[trial] - self.truth[trial][0]
        out = np.zeros((len(away), 3, 3))
        out[:, 0, 0] = out[:, 1, 1] = out[:, 2, 2] = 1.0
        out[:, 0, 2], out[:, 1, 2] = -away[:, 1], away[:, 0]
        return out.reshape(-1, 3)


def _times(world: World, driving: Driving) -> list[np.ndarray]:
    """Every second frame, its noise that of the mean of two; or the ends of commands."""
    out = []
    for trial, count in enumerate(driving.counts):
        edges = driving.edges_s[trial, : count + 1]
        if world.layout.rows == "ends":
            out.append(edges)
        else:
            out.append(stamps(edges, Layout("frames", tail_s=world.layout.tail_s))[0][::2])
    return out


def _noise(world: World) -> np.ndarray:
    """(3,) standard deviations of a row, quantisation included."""
    camera = world.camera
    share = 1.0 if world.layout.rows == "ends" else 0.5
    place = camera.position_m**2 + camera.quantum_m**2 / 12 + (0.1 * camera.stamp_s) ** 2
    turn = camera.heading_rad**2 + camera.quantum_rad**2 / 12
    return np.sqrt(share * np.array([place, place, turn]))


